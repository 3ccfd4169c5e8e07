// Rounds of the ring, with visits to rooms.
#include <algorithm>
#include <cmath>

#include "host/sim_drive.hpp"
#include "host/sim_ring.hpp"

namespace mellin::host {
namespace {

constexpr double kFirstWay_m = 2.0;     // where session 0 begins on the ring
constexpr double kOverlap_m = 4.0;      // driven on after the last loop
constexpr double kSway_m = 0.2;         // how far the robot strays from the centre line
constexpr double kVisitedShare = 0.25;  // of the rooms that are open

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
        visits.push_back({path.to(door.along_m) + loop * ring::kLength_m, door.inside});
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

}  // namespace

Drive drive_ring(const SimOptions& options, const Floor& floor, int session) {
  Random random = random_stream(options, SimStream::drive, session);
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

}  // namespace mellin::host
