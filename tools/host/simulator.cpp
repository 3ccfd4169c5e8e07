// The drive through the floor, the laser, the odometry, the files.
#include "host/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "host/file.hpp"
#include "host/sim_ring.hpp"
#include "mellin/core/random.hpp"

namespace mellin::host {
namespace {

constexpr double kSpeed_m_s = 0.5;
constexpr double kTurnSpeed_rad_s = 0.7;
constexpr double kFirstWay_m = 2.0;      // where session 0 begins on the ring
constexpr double kOverlap_m = 4.0;       // driven on after the last loop
constexpr double kSway_m = 0.2;          // how far the robot strays from the centre line
constexpr double kVisitedShare = 0.25;   // of the rooms that are open
constexpr double kBeyondReach_m = 0.19;  // real scanners: 8 m reach, 8.19 where nothing was hit

constexpr double kLeastStep_m = 0.005;
constexpr double kLeastStep_rad = 0.005;

enum Stream : std::uint64_t { kDrive = 1'000'000, kLaser = 2'000'000, kWheels = 3'000'000, kFrame = 4'000'000 };

Random stream(const SimOptions& options, Stream part, int session) {
  return {options.seed, static_cast<std::uint64_t>(part) + static_cast<std::uint64_t>(session)};
}

struct TimedPose {
  double seconds = 0.0;
  Pose2 pose;
};

/// Collects the poses at which scans are taken.
class Drive {
 public:
  Drive(const SimOptions& options, const Pose2& start) : options_(options), poses_{{0.0, start}} {}

  const Pose2& pose() const { return poses_.back().pose; }
  double path_m() const { return path_m_; }
  const std::vector<TimedPose>& poses() const { return poses_; }

  /// Scans again at the next pose, unless it is the present one.
  void move_to(const Pose2& next) {
    const double way = translation(between(pose(), next));
    const double turn = std::fabs(wrap_angle(next.theta - pose().theta));
    if (way < kLeastStep_m && turn < kLeastStep_rad) {
      return;
    }
    path_m_ += way;
    poses_.push_back({poses_.back().seconds + way / kSpeed_m_s + turn / kTurnSpeed_rad_s, next});
  }

  /// Turns on the spot by an angle.
  void turn_by(double angle) {
    const int steps = static_cast<int>(std::ceil(std::fabs(angle) / options_.turn_rad));
    const Pose2 from = pose();
    for (int i = 1; i <= steps; ++i) {
      move_to({from.x, from.y, wrap_angle(from.theta + angle * i / steps)});
    }
  }

  void turn_to(double theta) { turn_by(wrap_angle(theta - pose().theta)); }

  /// Turns to a point and drives straight to it.
  void go_to(Point2 to) {
    const Pose2 from = pose();
    const double theta = mellin::atan2(to.y - from.y, to.x - from.x);
    turn_to(theta);
    const double way = translation(between(from, {to.x, to.y, 0.0}));
    const int steps = static_cast<int>(std::ceil(way / options_.spacing_m));
    for (int i = 1; i <= steps; ++i) {
      const double share = static_cast<double>(i) / steps;
      move_to({from.x + share * (to.x - from.x), from.y + share * (to.y - from.y), theta});
    }
  }

 private:
  const SimOptions& options_;
  std::vector<TimedPose> poses_;
  double path_m_ = 0.0;
};

/// Where the robot drives on the ring: along the centre line, swaying a little.
class RingPath {
 public:
  RingPath(double start_m, double direction, double phase) : start_m_(start_m), direction_(direction), phase_(phase) {}

  Pose2 at(double driven_m) const {
    constexpr double kSways = 5.0 * kTwoPi / ring::kLength_m;
    const SinCos sway = sincos(phase_ + kSways * driven_m);
    const Pose2 line = ring::centre_line(start_m_ + direction_ * driven_m);
    const Pose2 ahead = direction_ > 0.0 ? line : compose(line, {0.0, 0.0, kPi});
    return compose(ahead, {0.0, kSway_m * sway.sin, mellin::atan2(kSway_m * kSways * sway.cos, 1.0)});
  }

  /// Metres from the start to a place on the ring, the first time round.
  double to(double ring_m) const {
    const double way = direction_ * (ring_m - start_m_);
    return way - ring::kLength_m * std::floor(way / ring::kLength_m);
  }

 private:
  double start_m_;
  double direction_;
  double phase_;
};

struct Visit {
  double driven_m = 0.0;
  Point2 inside;
};

/// The rooms that the robot visits, in the order of the way. It has its favourites, so that it comes back to some.
std::vector<Visit> plan_visits(const SimOptions& options, const Floor& floor, const RingPath& path, Random& random) {
  std::vector<Visit> visits;
  for (const Door& door : floor.doors) {
    const bool favourite = random.uniform() < kVisitedShare;
    for (int loop = 0; loop < options.loops; ++loop) {
      const bool now = random.uniform() < 0.8;
      if (favourite && now && door.open) {
        visits.push_back({path.to(door.ring_m) + loop * ring::kLength_m, door.inside});
      }
    }
  }
  std::sort(visits.begin(), visits.end(), [](const Visit& a, const Visit& b) { return a.driven_m < b.driven_m; });
  return visits;
}

void visit_room(Drive& drive, Point2 inside, Random& random) {
  const Pose2 corridor = drive.pose();
  drive.go_to(inside);
  const double side = random.uniform() < 0.5 ? 1.0 : -1.0;
  drive.turn_by(side * kPi);
  drive.go_to({corridor.x, corridor.y});
  drive.turn_to(corridor.theta);
}

Drive drive_session(const SimOptions& options, const Floor& floor, int session) {
  Random random = stream(options, kDrive, session);
  const double anywhere = ring::kLength_m * random.uniform();
  const double direction = session % 3 == 2 ? -1.0 : 1.0;
  const RingPath path(session == 0 ? kFirstWay_m : anywhere, direction, kTwoPi * random.uniform());
  const std::vector<Visit> visits = plan_visits(options, floor, path, random);
  const double whole = options.loops * ring::kLength_m + kOverlap_m;
  Drive drive(options, path.at(0.0));
  auto next = visits.begin();
  for (double driven = 0.0; driven < whole;) {
    const bool visiting = next != visits.end() && next->driven_m <= driven + options.spacing_m;
    driven = visiting ? next->driven_m : driven + options.spacing_m;
    drive.move_to(path.at(driven));
    if (visiting) {
      visit_room(drive, next->inside, random);
      ++next;
    }
  }
  return drive;
}

/// What the laser sees: exact distances, noise, beams that come back empty or end early.
std::vector<float> take_scan(const SimOptions& options, const std::vector<WallSegment>& near, const Pose2& pose,
                             Random& random) {
  std::vector<float> ranges(static_cast<std::size_t>(options.beams));
  const double increment = kPi / options.beams;
  for (int i = 0; i < options.beams; ++i) {
    double range = cast_ray(near, {pose.x, pose.y}, pose.theta - kHalfPi + increment * i, options.range_m);
    const bool hit = range < options.range_m && random.uniform() >= options.no_return_share;
    if (hit && random.uniform() < options.outlier_share) {
      range *= random.uniform();
    }
    range += options.range_noise_m * random.normal();
    range = hit ? std::clamp(range, 0.02, options.range_m) : no_return_value(options);
    ranges[static_cast<std::size_t>(i)] = static_cast<float>(std::floor(range * 100.0 + 0.5) / 100.0);
  }
  return ranges;
}

std::vector<WallSegment> within_reach(const std::vector<WallSegment>& segments, const Pose2& pose, double reach_m) {
  std::vector<WallSegment> near;
  for (const WallSegment& s : segments) {
    if (std::max(s.a.x, s.b.x) >= pose.x - reach_m && std::min(s.a.x, s.b.x) <= pose.x + reach_m &&
        std::max(s.a.y, s.b.y) >= pose.y - reach_m && std::min(s.a.y, s.b.y) <= pose.y + reach_m) {
      near.push_back(s);
    }
  }
  return near;
}

/// The step that the wheels report for a true one.
Pose2 odometry_step(const SimOptions& options, const Pose2& step, Random& random) {
  const double way = translation(step);
  const double scale = 1.0 + options.scale_error + options.way_noise * random.normal();
  const double turned = way > 0.0 || step.theta != 0.0 ? options.turn_noise_rad * random.normal() : 0.0;
  return {step.x * scale, step.y * scale, wrap_angle(step.theta + options.turn_error_rad_per_m * way + turned)};
}

}  // namespace

double no_return_value(const SimOptions& options) {
  return std::floor((options.range_m + kBeyondReach_m) * 100.0 + 0.5) / 100.0;
}

SimSession simulate(const SimOptions& options, int session) {
  const Floor floor = make_floor(options, session);
  const std::vector<WallSegment> segments = obstacles(floor);
  const Drive drive = drive_session(options, floor, session);
  Random laser = stream(options, kLaser, session);
  Random wheels = stream(options, kWheels, session);
  Random frame = stream(options, kFrame, session);
  Pose2 odometry;
  if (session > 0) {
    odometry = {20.0 * frame.uniform() - 10.0, 20.0 * frame.uniform() - 10.0, wrap_angle(kTwoPi * frame.uniform())};
  }
  constexpr double kSessionApart_s = 100000.0;
  SimSession result;
  result.path_m = drive.path_m();
  for (std::size_t i = 0; i < drive.poses().size(); ++i) {
    const TimedPose& now = drive.poses()[i];
    if (i > 0) {
      odometry = compose(odometry, odometry_step(options, between(drive.poses()[i - 1].pose, now.pose), wheels));
    }
    result.scans.push_back({kSessionApart_s * session + now.seconds, now.pose, odometry,
                            take_scan(options, within_reach(segments, now.pose, options.range_m), now.pose, laser)});
  }
  return result;
}

namespace {

std::string carmen_line(const SimScan& scan) {
  char text[256];
  std::string line = "FLASER " + std::to_string(scan.ranges.size());
  for (const float range : scan.ranges) {
    (void)std::snprintf(text, sizeof(text), " %.2f", static_cast<double>(range));
    line += text;
  }
  const Pose2& o = scan.odometry_T_base;
  (void)std::snprintf(text, sizeof(text), " %.6f %.6f %.6f %.6f %.6f %.6f %.6f sim %.6f\n", o.x, o.y, o.theta, o.x, o.y,
                      o.theta, scan.seconds, scan.seconds);
  return line + text;
}

/// Half angles through the library's own sine, so that the file's bytes do not depend on libm.
std::string tum_line(const SimScan& scan) {
  char text[256];
  const Pose2& p = scan.world_T_base;
  const SinCos half = sincos(p.theta / 2.0);
  (void)std::snprintf(text, sizeof(text), "%.6f %.6f %.6f 0 0 0 %.9f %.9f\n", scan.seconds, p.x, p.y, half.sin,
                      half.cos);
  return text;
}

}  // namespace

std::vector<std::string> write_simulation(const SimOptions& options, const std::string& directory) {
  std::vector<std::string> logs;
  for (int k = 0; k < options.sessions; ++k) {
    const SimSession session = simulate(options, k);
    std::string log = "# simulated, seed " + std::to_string(options.seed) + ", session " + std::to_string(k) + "\n";
    std::string truth;
    for (const SimScan& scan : session.scans) {
      log += carmen_line(scan);
      truth += tum_line(scan);
    }
    const std::string stem = directory + "/sim-" + std::to_string(k);
    write_file(stem + ".log", log);
    write_file(stem + ".tum", truth);
    logs.push_back(stem + ".log");
  }
  return logs;
}

}  // namespace mellin::host
