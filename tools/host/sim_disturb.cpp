#include "host/sim_disturb.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace mellin::host {
namespace {

constexpr double kStandingScan_s = 0.25;  // from a scan to the next while the robot stands
constexpr double kUnseen_s = 2.0;         // that a push or a carriage takes
constexpr double kBack_m = 2.5;           // way on which a pushed robot drives back to its line
constexpr double kClear_m = 0.35;         // that a pushed robot keeps from walls

enum class Kind { stop, push, slip, kidnap };

struct Event {
  std::size_t due = 0;  ///< index of the pose after which it happens, or later where there is no room
  Kind kind = Kind::stop;
};

std::vector<Event> plan_events(const SimOptions& options, std::size_t poses, Random& random) {
  std::vector<std::pair<std::uint64_t, Kind>> kinds;
  const std::pair<Kind, int> counts[] = {{Kind::stop, options.stops},
                                         {Kind::push, options.pushes},
                                         {Kind::slip, options.slips},
                                         {Kind::kidnap, options.kidnaps}};
  for (const auto& [kind, count] : counts) {
    for (int i = 0; i < count; ++i) {
      kinds.emplace_back(random.bits(), kind);
    }
  }
  std::sort(kinds.begin(), kinds.end());
  std::vector<Event> events;
  const double apart = static_cast<double>(poses) / static_cast<double>(kinds.size() + 1);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const double due = apart * (static_cast<double>(i + 1) + between_limits(random, -0.3, 0.3));
    events.push_back({static_cast<std::size_t>(due), kinds[i].second});
  }
  return events;
}

class Disturber {
 public:
  Disturber(const SimOptions& options, const Drive& drive, const RayGrid& walls, Random random)
      : options_(options),
        poses_(drive.poses()),
        walls_(walls),
        random_(random),
        events_(plan_events(options, poses_.size(), random_)) {}

  std::vector<Move> moves() {
    moves_.push_back({poses_.front(), {}, false});
    next_ = 1;
    auto event = events_.begin();
    while (next_ < poses_.size()) {
      if (event != events_.end() && next_ > event->due && befall(event->kind)) {
        ++event;
        continue;
      }
      drive_to(poses_[next_].pose, poses_[next_].seconds - poses_[next_ - 1].seconds);
      ++next_;
    }
    if (event != events_.end()) {
      throw std::invalid_argument("simulator: the drive has no place for so many pushes and kidnaps");
    }
    return std::move(moves_);
  }

 private:
  const TimedPose& now() const { return moves_.back().to; }

  void drive_to(const Pose2& pose, double seconds) {
    moves_.push_back({{now().seconds + seconds, pose}, between(now().pose, pose), false});
  }

  void carry_to(const Pose2& pose) { moves_.push_back({{now().seconds + kUnseen_s, pose}, {}, true}); }

  /// False where there is no room for it here.
  bool befall(Kind kind) {
    switch (kind) {
      case Kind::stop:
        stop();
        return true;
      case Kind::slip:
        slip();
        return true;
      case Kind::push:
        return push();
      case Kind::kidnap:
        break;
    }
    return kidnap();
  }

  void stop() {
    const double until = now().seconds + kStop_s;
    while (now().seconds + kStandingScan_s <= until) {
      moves_.push_back({{now().seconds + kStandingScan_s, now().pose}, {}, false});
    }
  }

  void slip() {
    const double whole = between_limits(random_, kLeastSlip_m, kMostSlip_m);
    const int steps = std::max(1, static_cast<int>(whole / options_.spacing_m));
    for (int i = 0; i < steps; ++i) {
      moves_.push_back({{now().seconds + kStandingScan_s, now().pose}, {whole / steps, 0.0, 0.0}, false});
    }
  }

  /// To the side, and by itself back to its line on the next metres.
  bool push() {
    const double side = random_.uniform() < 0.5 ? 1.0 : -1.0;
    for (const double aside : {side * kPush_m, -side * kPush_m}) {
      const std::vector<Pose2> back = way_back(aside);
      const Pose2 pushed = compose(now().pose, {0.0, aside, 0.0});
      const bool clear = std::all_of(back.begin(), back.end(), [this](const Pose2& p) {
        return walls_.clearance({p.x, p.y}, kClear_m) >= kClear_m;
      });
      if (back.empty() || !clear || walls_.clearance({pushed.x, pushed.y}, kClear_m) < kClear_m) {
        continue;
      }
      carry_to(pushed);
      for (const Pose2& pose : back) {
        drive_to(pose, poses_[next_].seconds - poses_[next_ - 1].seconds);
        ++next_;
      }
      return true;
    }
    return false;
  }

  /// The next poses of the drive, moved aside less and less; none where it turns or ends before it is back.
  std::vector<Pose2> way_back(double aside) const {
    std::vector<Pose2> back;
    double driven = 0.0;
    for (std::size_t i = next_; i < poses_.size(); ++i) {
      const Pose2& pose = poses_[i].pose;
      driven += translation(between(poses_[i - 1].pose, pose));
      if (std::fabs(wrap_angle(pose.theta - now().pose.theta)) > 0.3) {
        return {};
      }
      if (driven >= kBack_m) {
        return back;
      }
      back.push_back(compose(pose, {0.0, aside * (1.0 - driven / kBack_m), -aside / kBack_m}));
    }
    return {};
  }

  /// To the next pose of the drive that is far away: what lies between is left out.
  bool kidnap() {
    for (std::size_t i = next_; i + 1 < poses_.size(); ++i) {
      if (translation(between(now().pose, poses_[i].pose)) >= kLeastKidnap_m) {
        carry_to(poses_[i].pose);
        next_ = i + 1;
        return true;
      }
    }
    return false;
  }

  const SimOptions& options_;
  const std::vector<TimedPose>& poses_;
  const RayGrid& walls_;
  Random random_;
  std::vector<Event> events_;
  std::vector<Move> moves_;
  std::size_t next_ = 0;  ///< pose of the drive
};

}  // namespace

std::vector<Move> disturbed_moves(const SimOptions& options, int session, const Drive& drive, const RayGrid& walls) {
  return Disturber(options, drive, walls, random_stream(options, SimStream::disturbances, session)).moves();
}

}  // namespace mellin::host
