#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/scorer.hpp"
#include "host/simulator.hpp"
#include "host/tum.hpp"
#include "tests/host_support.hpp"
#include "tests/support/simulated_world.hpp"

using namespace mellin;
using namespace mellin::host;
using mellin::test::clearance;
using mellin::test::cross;
using mellin::test::exact;
using mellin::test::odometry_of;
using mellin::test::read_bytes;
using mellin::test::TemporaryFolder;
using mellin::test::truth_of;

TEST_CASE("rays end at the nearest wall") {
  const std::vector<WallSegment> room{{{-1, -2}, {3, -2}}, {{3, -2}, {3, 2}}, {{3, 2}, {-1, 2}}, {{-1, 2}, {-1, -2}}};
  CHECK(cast_ray(room, {0, 0}, 0.0, 10.0) == doctest::Approx(3.0));
  CHECK(cast_ray(room, {0, 0}, kPi, 10.0) == doctest::Approx(1.0));
  CHECK(cast_ray(room, {0, 0}, kPi / 4.0, 10.0) == doctest::Approx(2.0 * std::sqrt(2.0)));
  CHECK(cast_ray(room, {0, 0}, -kPi / 6.0, 10.0) == doctest::Approx(3.0 / std::cos(kPi / 6.0)));
  CHECK(cast_ray(room, {0, 0}, 0.0, 2.5) == 2.5);
  CHECK(cast_ray(room, {5, 0}, 0.0, 10.0) == 10.0);
  CHECK(cast_ray({}, {0, 0}, 1.0, 10.0) == 10.0);
}

TEST_CASE("an exact scan ends on obstacles and passes through none") {
  SimOptions options = exact();
  options.loops = 1;
  const std::vector<WallSegment> walls = obstacles(make_floor(options, 0));
  const SimSession session = simulate(options, 0);
  int hits = 0;
  for (std::size_t i = 0; i < session.scans.size(); i += 37) {
    const SimScan& scan = session.scans[i];
    const Pose2& p = scan.world_T_base;
    for (std::size_t beam = 0; beam < scan.ranges.size(); beam += 7) {
      const double angle = p.theta + (static_cast<double>(beam) - 90.0) * kPi / 180.0;
      const double range = static_cast<double>(scan.ranges[beam]);
      const bool hit = range <= options.range_m;
      const double open = (hit ? range : options.range_m) - 0.006;  // logs have whole centimetres
      const Point2 end{p.x + open * std::cos(angle), p.y + open * std::sin(angle)};
      for (const WallSegment& wall : walls) {
        REQUIRE(!cross({p.x, p.y}, end, wall.a, wall.b));
      }
      if (hit) {
        ++hits;
        REQUIRE(clearance(walls, {p.x + range * std::cos(angle), p.y + range * std::sin(angle)}) < 0.006);
      }
    }
  }
  CHECK(hits > 300);
}

TEST_CASE("the robot drives far, twice round, in small steps, and into nothing") {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    SimOptions options;
    options.seed = seed;
    options.sessions = 3;
    options.change = 0.3;
    for (int k = 0; k < 3; ++k) {
      CAPTURE(seed);
      CAPTURE(k);
      const SimSession session = simulate(options, k);
      const std::vector<WallSegment> walls = obstacles(make_floor(options, k));
      double round = 0.0;
      double driven = 0.0;
      double nearest = 1e9;
      for (std::size_t i = 1; i < session.scans.size(); ++i) {
        const Pose2& a = session.scans[i - 1].world_T_base;
        const Pose2& b = session.scans[i].world_T_base;
        const double step = std::hypot(b.x - a.x, b.y - a.y);
        REQUIRE(step < 0.25);
        REQUIRE(std::fabs(wrap_angle(b.theta - a.theta)) < 0.25);
        REQUIRE(session.scans[i].seconds > session.scans[i - 1].seconds);
        driven += step;
        round += wrap_angle(std::atan2(b.y, b.x) - std::atan2(a.y, a.x));
        nearest = std::min(nearest, clearance(walls, {b.x, b.y}));
      }
      CHECK(driven > 150.0);
      CHECK(session.path_m == doctest::Approx(driven));
      CHECK(std::fabs(round) > 2.0 * kTwoPi);
      CHECK(nearest > 0.25);
    }
  }
}

TEST_CASE("odometry is many metres off, and exact without its errors") {
  const SimSession bad = simulate(SimOptions{}, 0);
  const TrajectoryScore off = score_trajectory(odometry_of(bad), truth_of(bad));
  CHECK(off.ate_rmse_m > 3.0);
  CHECK(off.step.mean_m < 0.02);
  const SimSession good = simulate(exact(), 0);
  CHECK(score_trajectory(odometry_of(good), truth_of(good)).ate_max_m < 1e-6);
}

TEST_CASE("noise, empty beams and outliers are as many as asked for") {
  SimOptions options = exact();
  const SimSession clean = simulate(options, 0);
  options.range_noise_m = 0.02;
  options.no_return_share = 0.05;
  const SimSession noisy = simulate(options, 0);
  REQUIRE(clean.scans.size() == noisy.scans.size());
  const double empty = no_return_value(options);
  double squares = 0.0;
  std::size_t hits = 0;
  std::size_t lost = 0;
  for (std::size_t i = 0; i < clean.scans.size(); ++i) {
    for (std::size_t beam = 0; beam < clean.scans[i].ranges.size(); ++beam) {
      const double truth = static_cast<double>(clean.scans[i].ranges[beam]);
      const double range = static_cast<double>(noisy.scans[i].ranges[beam]);
      if (truth > 7.8) {
        continue;  // the reach would clip the noise
      }
      ++hits;
      if (range > empty - 0.001) {
        ++lost;
      } else {
        squares += (range - truth) * (range - truth);
      }
    }
  }
  // Both logs are rounded to centimetres: variance 1/12 cm^2 each.
  const double expected = std::sqrt(0.02 * 0.02 + 2.0 * 0.01 * 0.01 / 12.0);
  CHECK(std::sqrt(squares / static_cast<double>(hits - lost)) == doctest::Approx(expected).epsilon(0.02));
  CHECK(static_cast<double>(lost) / static_cast<double>(hits) == doctest::Approx(0.05).epsilon(0.05));
}

TEST_CASE("the given share of furniture and doors changes from session to session") {
  SimOptions options;
  options.sessions = 2;
  for (const double change : {0.0, 0.25, 1.0}) {
    options.change = change;
    const Floor before = make_floor(options, 0);
    const Floor after = make_floor(options, 1);
    REQUIRE(before.furniture.size() == after.furniture.size());
    REQUIRE(before.doors.size() == after.doors.size());
    std::size_t changed = 0;
    for (std::size_t i = 0; i < before.furniture.size(); ++i) {
      const Pose2& a = before.furniture[i].world_T_box;
      const Pose2& b = after.furniture[i].world_T_box;
      changed += a.x != b.x || a.y != b.y || a.theta != b.theta ? 1U : 0U;
    }
    for (std::size_t i = 0; i < before.doors.size(); ++i) {
      changed += before.doors[i].open != after.doors[i].open ? 1U : 0U;
    }
    const double all = static_cast<double>(before.furniture.size() + before.doors.size());
    CHECK(all > 50.0);
    // A box that finds no other spot in its room stays.
    CHECK(static_cast<double>(changed) <= change * all + 0.5);
    CHECK(static_cast<double>(changed) >= change * all * 0.95 - 0.5);
  }
}

TEST_CASE("sessions share the floor, start elsewhere and have odometry frames of their own") {
  SimOptions options;
  options.sessions = 2;
  const SimSession first = simulate(options, 0);
  const SimSession second = simulate(options, 1);
  const SimScan& a = first.scans.front();
  const SimScan& b = second.scans.front();
  CHECK(std::hypot(a.world_T_base.x - b.world_T_base.x, a.world_T_base.y - b.world_T_base.y) > 1.0);
  CHECK(a.odometry_T_base.x == 0.0);
  CHECK(std::fabs(b.odometry_T_base.theta) > 0.01);
  CHECK(make_floor(options, 0).walls.size() == make_floor(options, 1).walls.size());
}

TEST_CASE("the same seed gives the same files, another one another floor") {
  const TemporaryFolder folder;
  SimOptions options;
  options.loops = 1;
  const std::vector<std::string> logs = write_simulation(options, folder.path());
  REQUIRE(logs.size() == 1);
  const std::string log = read_bytes(logs[0]);
  const std::string truth = read_bytes(folder.path() + "/sim-0.tum");
  write_simulation(options, folder.path());
  CHECK(read_bytes(logs[0]) == log);
  CHECK(read_bytes(folder.path() + "/sim-0.tum") == truth);
  options.seed = 2;
  write_simulation(options, folder.path());
  CHECK(read_bytes(logs[0]) != log);
}

TEST_CASE("the files read back as what was simulated") {
  const TemporaryFolder folder;
  SimOptions options;
  options.sessions = 2;
  options.loops = 1;
  options.beams = 360;
  const std::vector<std::string> logs = write_simulation(options, folder.path());
  REQUIRE(logs.size() == 2);
  for (int k = 0; k < 2; ++k) {
    const SimSession session = simulate(options, k);
    const Log log = read_carmen_log(logs[static_cast<std::size_t>(k)]);
    const std::vector<StampedPose> truth = read_tum(folder.path() + "/sim-" + std::to_string(k) + ".tum");
    REQUIRE(log.scans.size() == session.scans.size());
    REQUIRE(truth.size() == session.scans.size());
    CHECK(log.bad_line_count == 0);
    CHECK(log.lasers.at(0).increment_rad == doctest::Approx(kPi / 360.0));
    CHECK(log.lasers[0].max_range_source == MaxRangeSource::detected);
    CHECK(log.lasers[0].max_range_m == doctest::Approx(no_return_value(options)).epsilon(1e-3));
    for (std::size_t i = 0; i < truth.size(); ++i) {
      REQUIRE(log.scans[i].stamp == truth[i].stamp);
      REQUIRE(log.scans[i].ranges == session.scans[i].ranges);
      REQUIRE(translation(between(truth[i].pose, session.scans[i].world_T_base)) < 2e-6);
      REQUIRE(translation(between(log.scans[i].odometry, session.scans[i].odometry_T_base)) < 2e-6);
    }
  }
}

TEST_CASE("options outside their limits are refused") {
  SimOptions options;
  options.beams = 182;
  CHECK_THROWS_AS((void)simulate(options, 0), std::invalid_argument);
  options = {};
  options.range_m = NAN;
  CHECK_THROWS_AS((void)simulate(options, 0), std::invalid_argument);
  options = {};
  CHECK_THROWS_AS((void)simulate(options, 1), std::invalid_argument);
  CHECK_THROWS_AS((void)write_simulation(options, "/nonexistent/folder"), std::runtime_error);
}
