// What befalls the simulated robot and its sensor.
#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "host/sim_disturb.hpp"
#include "host/simulator.hpp"
#include "tests/support/simulated_world.hpp"

using namespace mellin;
using namespace mellin::host;
using mellin::test::exact;

namespace {

/// A step of the truth and the same of the odometry, which is exact but for the disturbance.
struct Step {
  Pose2 truth;
  Pose2 wheels;
  double seconds = 0.0;

  double unseen() const { return std::hypot(truth.x - wheels.x, truth.y - wheels.y); }
  bool standing() const { return truth.x == 0.0 && truth.y == 0.0 && truth.theta == 0.0; }
};

std::vector<Step> steps_of(const SimSession& session) {
  std::vector<Step> steps;
  for (std::size_t i = 1; i < session.scans.size(); ++i) {
    const SimScan& a = session.scans[i - 1];
    const SimScan& b = session.scans[i];
    steps.push_back({between(a.world_T_base, b.world_T_base), between(a.odometry_T_base, b.odometry_T_base),
                     b.seconds - a.seconds});
  }
  return steps;
}

SimOptions short_tour(SimKind kind) {
  SimOptions options = exact(kind);
  options.path_m = 150.0;
  return options;
}

}  // namespace

TEST_CASE("a push moves the robot half a metre to the side, and the wheels see nothing of it") {
  for (const SimKind kind : {SimKind::ring, SimKind::offices, SimKind::hall, SimKind::corridor, SimKind::cave}) {
    CAPTURE(static_cast<int>(kind));
    SimOptions options = short_tour(kind);
    options.pushes = 3;
    const SimSession session = simulate(options, 0);
    const RayGrid walls(obstacles(make_floor(options, 0)));
    int pushes = 0;
    for (const Step& step : steps_of(session)) {
      if (step.unseen() > 1e-6) {
        ++pushes;
        CHECK(step.truth.x == doctest::Approx(0.0));
        CHECK(std::fabs(step.truth.y) == doctest::Approx(0.5));
        CHECK(translation(step.wheels) == 0.0);
      } else {
        // The spacing and, where the way turns by up to 0.3 rad after a push, so much of the half metre.
        REQUIRE(translation(step.truth) < 0.2 + 0.5 * 0.3);
        REQUIRE(std::fabs(wrap_angle(step.truth.theta - step.wheels.theta)) < 1e-6);
      }
    }
    CHECK(pushes == 3);
    for (const SimScan& scan : session.scans) {
      REQUIRE(walls.clearance({scan.world_T_base.x, scan.world_T_base.y}, 0.25) >= 0.25);
    }
  }
}

TEST_CASE("slipping wheels turn 0.5 to 1 m while the robot stands") {
  SimOptions options = short_tour(SimKind::offices);
  options.slips = 4;
  double slipped = 0.0;
  for (const Step& step : steps_of(simulate(options, 0))) {
    if (step.unseen() > 1e-6) {
      CHECK(step.standing());
      CHECK(step.wheels.y == doctest::Approx(0.0));
      slipped += step.wheels.x;
    }
  }
  CHECK(slipped > 4 * 0.5);
  CHECK(slipped < 4 * 1.0);
}

TEST_CASE("a stop is a minute of scans at one pose") {
  SimOptions options = short_tour(SimKind::offices);
  options.stops = 2;
  double stood = 0.0;
  int scans = 0;
  for (const Step& step : steps_of(simulate(options, 0))) {
    if (step.standing()) {
      CHECK(translation(step.wheels) == 0.0);
      stood += step.seconds;
      ++scans;
    }
  }
  CHECK(stood == doctest::Approx(120.0));
  CHECK(scans > 200);
}

TEST_CASE("a kidnapped robot is 10 m away or more, and the wheels see nothing of it") {
  for (const SimKind kind : {SimKind::ring, SimKind::offices, SimKind::hall, SimKind::flat}) {
    SimOptions options = short_tour(kind);
    options.path_m = 300.0;
    options.kidnaps = 2;
    const SimSession session = simulate(options, 0);
    int kidnaps = 0;
    for (const Step& step : steps_of(session)) {
      if (step.unseen() > 1e-6) {
        ++kidnaps;
        CHECK(translation(step.truth) >= 10.0);
        CHECK(translation(step.wheels) == 0.0);
      }
    }
    CHECK(kidnaps == 2);
  }
}

TEST_CASE("all disturbances together happen as often as asked for, and the same in each run") {
  SimOptions options = options_for(SimKind::offices);
  options.stops = 1;
  options.pushes = 2;
  options.slips = 2;
  options.kidnaps = 1;
  options.people = 3;
  options.glass_share = 0.2;
  options.missing_share = 0.2;
  const SimSession once = simulate(options, 0);
  const SimSession again = simulate(options, 0);
  REQUIRE(once.scans.size() == again.scans.size());
  for (std::size_t i = 0; i < once.scans.size(); ++i) {
    REQUIRE(once.scans[i].ranges == again.scans[i].ranges);
    REQUIRE(once.scans[i].odometry_T_base.x == again.scans[i].odometry_T_base.x);
    REQUIRE((i == 0 || once.scans[i].seconds > once.scans[i - 1].seconds));
  }
}

TEST_CASE("a drive without room for its disturbances is refused") {
  SimOptions options = exact(SimKind::flat);
  options.path_m = 10.0;
  options.kidnaps = 5;
  CHECK_THROWS_AS((void)simulate(options, 0), std::invalid_argument);
  options.kidnaps = -1;
  CHECK_THROWS_AS((void)simulate(options, 0), std::invalid_argument);
}

TEST_CASE("people stand in the beams as circles do") {
  SimOptions options = exact();
  options.people = 4;
  options.range_m = 20.0;
  options.beams = 361;
  const RayGrid nothing({});
  Laser laser(options, 0, nothing);
  int seen = 0;
  for (int k = 0; k < 200; ++k) {
    const TimedPose robot{0.5 * k, {3.0 + 0.1 * k, -2.0, 0.01 * k}};
    const std::vector<Point2> people = people_near(options, 0, robot);
    CHECK(people.size() <= 4);
    const std::vector<float> ranges = laser.scan(robot);
    for (int i = 0; i < options.beams; ++i) {
      // |robot + t u - centre| = radius, the smaller t of the two
      const double angle = robot.pose.theta - kPi / 2.0 + kPi / 360.0 * i;
      double expected = 20.19;
      for (const Point2& centre : people) {
        const double dx = robot.pose.x - centre.x;
        const double dy = robot.pose.y - centre.y;
        const double b = dx * std::cos(angle) + dy * std::sin(angle);
        const double c = dx * dx + dy * dy - kPersonRadius_m * kPersonRadius_m;
        REQUIRE(c > 0.0);  // nobody stands where the robot is
        if (b * b > c && b < 0.0) {
          expected = std::min(expected, -b - std::sqrt(b * b - c));
          ++seen;
        }
      }
      REQUIRE(std::fabs(static_cast<double>(ranges[static_cast<std::size_t>(i)]) - expected) < 0.0051);  // whole cm
    }
  }
  CHECK(seen > 1000);
}

TEST_CASE("people walk: at a metre a second and more, and past") {
  SimOptions options = exact();
  options.people = 1;
  int moved = 0;
  for (int k = 0; k < 400; ++k) {
    const TimedPose robot{0.1 * k, {}};
    const std::vector<Point2> now = people_near(options, 0, robot);
    const std::vector<Point2> then = people_near(options, 0, {robot.seconds + 0.1, {}});
    if (now.size() == 1 && then.size() == 1) {
      const double step = std::hypot(then[0].x - now[0].x, then[0].y - now[0].y);
      moved += std::fabs(step - 0.12) < 1e-9 ? 1 : 0;
    }
  }
  CHECK(moved > 300);
}

TEST_CASE("of the beams on glass a tenth returns, eight tenths pass, and straight ones all return") {
  SimOptions options = exact();
  options.glass_share = 1.0;
  options.range_m = 30.0;
  const RayGrid walls({{{2.0, -50.0}, {2.0, 50.0}}, {{4.0, -50.0}, {4.0, 50.0}}});
  Laser laser(options, 0, walls);
  int first = 0;
  int second = 0;
  constexpr int kScans = 20000;
  for (int k = 0; k < kScans; ++k) {
    const std::vector<float> ranges = laser.scan({0.1 * k, {}});
    REQUIRE(static_cast<double>(ranges[90]) == doctest::Approx(2.0));
    const double at45 = static_cast<double>(ranges[135]);
    first += std::fabs(at45 - 2.0 * std::sqrt(2.0)) < 0.01 ? 1 : 0;
    second += std::fabs(at45 - 4.0 * std::sqrt(2.0)) < 0.01 ? 1 : 0;
  }
  // Deviations of the shares: sqrt(p (1 - p) / 20000) = 0.002; the second glass is reached by 8 of 10.
  CHECK(std::fabs(first / static_cast<double>(kScans) - 0.1) < 0.01);
  CHECK(std::fabs(second / static_cast<double>(kScans) - 0.08) < 0.01);
}

TEST_CASE("the given share of the walls is of glass") {
  SimOptions options = exact(SimKind::offices);
  options.glass_share = 0.25;
  std::size_t glass = 0;
  std::size_t all = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    options.seed = seed;
    const RayGrid walls(obstacles(make_floor(options, 0)));
    const Laser laser(options, 0, walls);
    for (std::uint32_t i = 0; i < walls.segments().size(); ++i) {
      glass += laser.is_glass(i) ? 1U : 0U;
      ++all;
    }
  }
  const double share = static_cast<double>(glass) / static_cast<double>(all);
  CHECK(std::fabs(share - 0.25) < 4.0 * std::sqrt(0.25 * 0.75 / static_cast<double>(all)));
}

TEST_CASE("the given share of the scans lacks a third of its beams in one block, and nothing else changes") {
  SimOptions options = options_for(SimKind::offices);
  options.path_m = 300.0;
  const SimSession whole = simulate(options, 0);
  options.missing_share = 0.3;
  const SimSession session = simulate(options, 0);
  REQUIRE(session.scans.size() == whole.scans.size());
  const auto empty = static_cast<float>(no_return_value(options));
  std::size_t changed = 0;
  for (std::size_t i = 0; i < session.scans.size(); ++i) {
    REQUIRE(session.scans[i].world_T_base.x == whole.scans[i].world_T_base.x);
    std::size_t first = 180;
    std::size_t last = 0;
    for (std::size_t beam = 0; beam < 180; ++beam) {
      if (session.scans[i].ranges[beam] != whole.scans[i].ranges[beam]) {
        REQUIRE(session.scans[i].ranges[beam] == empty);
        first = std::min(first, beam);
        last = beam;
      }
    }
    changed += last > 0 ? 1U : 0U;
    REQUIRE((last == 0 || last - first < 60));
    for (std::size_t beam = first; last > 0 && beam <= last; ++beam) {
      REQUIRE(session.scans[i].ranges[beam] == empty);
    }
  }
  const auto scans = static_cast<double>(session.scans.size());
  CHECK(std::fabs(static_cast<double>(changed) / scans - 0.3) < 4.0 * std::sqrt(0.3 * 0.7 / scans));
}
