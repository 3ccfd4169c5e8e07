#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "host/scorer.hpp"
#include "host/simulator.hpp"
#include "tests/support/simulated_world.hpp"

using namespace mellin;
using namespace mellin::host;
using mellin::test::clearance;
using mellin::test::cross;
using mellin::test::exact;
using mellin::test::odometry_of;
using mellin::test::truth_of;

namespace {

constexpr SimKind kToured[] = {SimKind::offices, SimKind::hall, SimKind::corridor, SimKind::flat, SimKind::cave};

std::vector<WallSegment> random_walls(std::uint64_t seed) {
  Random random(seed, 0);
  std::vector<WallSegment> walls;
  for (int i = 0; i < 300; ++i) {
    const Point2 a{100.0 * random.uniform() - 30.0, 60.0 * random.uniform() - 20.0};
    walls.push_back({a, {a.x + 12.0 * random.uniform() - 6.0, a.y + 12.0 * random.uniform() - 6.0}});
  }
  walls.push_back({{-30.0, 7.0}, {70.0, 7.0}});  // on a border of the grid's cells
  return walls;
}

double step_of(const SimScan& a, const SimScan& b) {
  return std::hypot(b.world_T_base.x - a.world_T_base.x, b.world_T_base.y - a.world_T_base.y);
}

}  // namespace

TEST_CASE("the grid of buckets gives each ray the answer of all walls one by one") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const std::vector<WallSegment> walls = random_walls(seed);
    const RayGrid grid(walls);
    Random random(seed, 1);
    int hits = 0;
    for (int i = 0; i < 3000; ++i) {
      const Point2 from{140.0 * random.uniform() - 50.0, 100.0 * random.uniform() - 40.0};
      const double angle = i % 5 == 0 ? kHalfPi * (i % 4) : kTwoPi * random.uniform();
      const RayGrid::Hit hit = grid.cast(from, angle, 79.0);
      REQUIRE(hit.distance_m == cast_ray(walls, from, angle, 79.0));
      REQUIRE((hit.segment != RayGrid::kNothing) == (hit.distance_m < 79.0));
      hits += hit.distance_m < 79.0 ? 1 : 0;
      const double near = clearance(walls, from);
      REQUIRE(grid.clearance(from, 3.0) == doctest::Approx(std::min(3.0, near)));
    }
    CHECK(hits > 1000);
  }
}

TEST_CASE("a ray goes on beyond a wall where asked to") {
  const RayGrid grid({{{2, -1}, {2, 1}}, {{5, -1}, {5, 1}}});
  CHECK(grid.cast({0, 0}, 0.0, 10.0).segment == 0);
  CHECK(grid.cast({0, 0}, 0.0, 10.0, 2.0).distance_m == doctest::Approx(5.0));
  CHECK(grid.cast({0, 0}, 0.0, 10.0, 5.0).distance_m == 10.0);
  CHECK(grid.cast({0, 0}, 0.0, 10.0, 5.0).segment == RayGrid::kNothing);
}

TEST_CASE("corridors have the width and the length of their plan") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SimOptions options = options_for(SimKind::corridor);
    options.seed = seed;
    const Floor floor = make_floor(options, 0);
    const std::vector<WallSegment> walls = obstacles(floor);
    REQUIRE(floor.nodes.size() >= 6);
    const Point2 first = floor.nodes[0];  // corner of the outer loop: the ends of two corridors
    CHECK(cast_ray(walls, first, kPi, 500.0) == doctest::Approx(1.2));
    CHECK(cast_ray(walls, first, -kHalfPi, 500.0) == doctest::Approx(1.2));
    CHECK(cast_ray(walls, first, 0.0, 500.0) == doctest::Approx(floor.nodes[2].x + 1.2));
    CHECK(cast_ray(walls, first, kHalfPi, 500.0) == doctest::Approx(floor.nodes[3].y + 1.2));
    // A loop of 200 to 400 m on either side of the corridor that they share.
    const double height = floor.nodes[3].y;
    for (const double width : {floor.nodes[1].x, floor.nodes[2].x - floor.nodes[1].x}) {
      CHECK(2.0 * (width + height) > 200.0);
      CHECK(2.0 * (width + height) < 400.0);
    }
    // Across the corridor: the walls, pilasters of up to 0.3 m, niches of up to 0.35 m.
    int niches = 0;
    for (double x = 3.0; x < floor.nodes[1].x - 3.0; x += 0.37) {
      const double aside = cast_ray(walls, {x, 0.0}, -kHalfPi, 500.0);
      REQUIRE(aside > 1.2 - 0.301);
      REQUIRE(aside < 1.2 + 0.351);
      niches += std::fabs(aside - 1.2) > 0.05 ? 1 : 0;
    }
    CHECK(niches > 10);
  }
}

TEST_CASE("a corridor has a bare stretch of 10 m, as long as the reach of many lasers") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SimOptions options = options_for(SimKind::corridor);
    options.seed = seed;
    const Floor floor = make_floor(options, 0);
    const std::vector<WallSegment> walls = obstacles(floor);
    double longest = 0.0;
    double bare = 0.0;
    for (double x = 1.5; x < floor.nodes[1].x - 1.5; x += 0.1) {
      const bool plain = std::fabs(cast_ray(walls, {x, 0.0}, kHalfPi, 9.0) - 1.2) < 1e-9 &&
                         std::fabs(cast_ray(walls, {x, 0.0}, -kHalfPi, 9.0) - 1.2) < 1e-9;
      bare = plain ? bare + 0.1 : 0.0;
      longest = std::max(longest, bare);
    }
    CHECK(longest > 9.5);
    CHECK(longest < 45.0);
  }
}

TEST_CASE("offices: the closed corners of corridors, and doors as wide as doors") {
  SimOptions options = options_for(SimKind::offices);
  const Floor floor = make_floor(options, 0);
  const std::vector<WallSegment> walls = obstacles(floor);
  CHECK(cast_ray(walls, floor.nodes[0], kPi, 50.0) == doctest::Approx(1.1));
  CHECK(cast_ray(walls, floor.nodes[0], -kHalfPi, 50.0) == doctest::Approx(1.1));
  CHECK(floor.doors.size() > 12);
  int tried = 0;
  for (const Way& way : floor.ways) {
    if (way.door == Way::kNoDoor) {
      continue;
    }
    ++tried;
    const Door& door = floor.doors[static_cast<std::size_t>(way.door)];
    const Point2 before = floor.nodes[static_cast<std::size_t>(way.from)];
    CHECK(std::hypot(door.latch.x - door.hinge.x, door.latch.y - door.hinge.y) == doctest::Approx(0.95));
    // From the corridor's centre line to the visitor's place: 1.1 m to the door, which lets through where it is open.
    const double angle = std::atan2(door.inside.y - before.y, door.inside.x - before.x);
    const double sight = cast_ray(walls, before, angle, 50.0);
    if (door.open) {
      CHECK(sight > std::hypot(door.inside.x - before.x, door.inside.y - before.y));
    } else {
      CHECK(sight == doctest::Approx(1.1));
    }
  }
  CHECK(tried == static_cast<int>(floor.doors.size()));
}

TEST_CASE("the hall ends at its outer walls or in their gates") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SimOptions options = options_for(SimKind::hall);
    options.seed = seed;
    const Floor floor = make_floor(options, 0);
    const std::vector<WallSegment> walls = obstacles(floor);
    const Point2 first = floor.nodes.front();
    const Point2 last = floor.nodes.back();
    CHECK(last.x + 3.5 > 45.0);
    CHECK(last.y + 3.5 > 25.0);
    // Along the aisles nothing stands, so that the sight is the hall's length.
    const double along = cast_ray(walls, first, 0.0, 500.0);
    CHECK(along >= last.x);
    CHECK(along <= last.x + 1.2);
    const double up = cast_ray(walls, last, -kHalfPi, 500.0);
    CHECK(up >= last.y);
    CHECK(up <= last.y + 1.2);
  }
}

TEST_CASE("the walls of a cave are closed curves, as far from the way as planned") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SimOptions options = options_for(SimKind::cave);
    options.seed = seed;
    const Floor floor = make_floor(options, 0);
    std::vector<WallSegment> ways;
    for (const Way& way : floor.ways) {
      ways.push_back({floor.nodes[static_cast<std::size_t>(way.from)], floor.nodes[static_cast<std::size_t>(way.to)]});
    }
    std::map<std::pair<double, double>, int> ends;
    double narrowest = 1e9;
    double widest = 0.0;
    int slanting = 0;
    for (const WallSegment& wall : floor.walls) {
      ++ends[{wall.a.x, wall.a.y}];
      ++ends[{wall.b.x, wall.b.y}];
      narrowest = std::min(narrowest, clearance(ways, wall.a));
      widest = std::max(widest, clearance(ways, wall.a));
      slanting += std::fabs(wall.a.x - wall.b.x) > 1e-6 && std::fabs(wall.a.y - wall.b.y) > 1e-6 ? 1 : 0;
    }
    for (const auto& [point, count] : ends) {
      REQUIRE(count == 2);
    }
    // 1.1 m and up to 1.7 m more; straight pieces in cells of 0.3 m cut the rounding by some centimetres.
    CHECK(narrowest > 1.05);
    CHECK(narrowest < 1.5);
    CHECK(widest < 2.85);
    CHECK(widest > 2.2);
    CHECK(slanting > static_cast<int>(floor.walls.size()) * 9 / 10);
  }
}

TEST_CASE("a flat's rooms are small, and each can be reached from each") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SimOptions options = options_for(SimKind::flat);
    options.seed = seed;
    const Floor floor = make_floor(options, 0);
    CHECK(floor.places.size() >= 9);
    CHECK(floor.furniture.size() > 3 * floor.places.size());
    for (const Place& room : floor.places) {
      CHECK(room.length_m < 5.0);
      CHECK(room.depth_m < 5.0);
    }
    std::vector<bool> reached(floor.nodes.size(), false);
    reached[0] = true;
    for (std::size_t pass = 0; pass < floor.nodes.size(); ++pass) {
      for (const Way& way : floor.ways) {
        const bool either = reached[static_cast<std::size_t>(way.from)] || reached[static_cast<std::size_t>(way.to)];
        reached[static_cast<std::size_t>(way.from)] = either;
        reached[static_cast<std::size_t>(way.to)] = either;
      }
    }
    CHECK(std::all_of(reached.begin(), reached.end(), [](bool r) { return r; }));
  }
}

TEST_CASE("every building is closed: no ray leaves it") {
  for (const SimKind kind : kToured) {
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      CAPTURE(static_cast<int>(kind));
      SimOptions options = exact(kind);
      options.seed = seed;
      options.path_m = 100.0;
      options.range_m = 2.0;
      const RayGrid walls(obstacles(make_floor(options, 0)));
      const SimSession session = simulate(options, 0);
      for (std::size_t i = 0; i < session.scans.size(); i += 10) {
        const Pose2& p = session.scans[i].world_T_base;
        for (int k = 0; k < 64; ++k) {
          REQUIRE(walls.cast({p.x, p.y}, 0.013 + kTwoPi * k / 64, 1000.0).segment != RayGrid::kNothing);
        }
      }
    }
  }
}

TEST_CASE("tours are as long as asked for, in small steps, through no wall, and come back to where they were") {
  for (const SimKind kind : kToured) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const double spacing = seed % 2 == 0 ? 0.2 : 1.0;
      CAPTURE(static_cast<int>(kind));
      CAPTURE(seed);
      SimOptions options = exact(kind);
      options.seed = seed;
      options.spacing_m = spacing;
      options.range_m = 1.0;  // the drive alone is looked at
      const Floor floor = make_floor(options, 0);
      const RayGrid walls(obstacles(floor));
      const SimSession session = simulate(options, 0);
      double driven = 0.0;
      std::vector<double> at{0.0};
      for (std::size_t i = 1; i < session.scans.size(); ++i) {
        const Pose2& a = session.scans[i - 1].world_T_base;
        const Pose2& b = session.scans[i].world_T_base;
        const double step = step_of(session.scans[i - 1], session.scans[i]);
        REQUIRE(step <= spacing + 1e-9);
        REQUIRE(std::fabs(wrap_angle(b.theta - a.theta)) < 0.4);
        REQUIRE(session.scans[i].seconds > session.scans[i - 1].seconds);
        REQUIRE(walls.clearance({b.x, b.y}, 0.25) >= 0.25);
        REQUIRE(std::none_of(walls.segments().begin(), walls.segments().end(), [&](const WallSegment& wall) {
          return cross({a.x, a.y}, {b.x, b.y}, wall.a, wall.b);
        }));
        driven += step;
        at.push_back(driven);
      }
      CHECK(session.path_m == doctest::Approx(driven));
      CHECK(driven > 0.9 * options.path_m);  // rounded corners and long spacings cut the way short
      CHECK(driven < 1.1 * options.path_m + 100.0);
      std::size_t again = 0;
      for (std::size_t i = 0; i < session.scans.size(); i += 5) {
        bool was_here = false;
        for (std::size_t k = 0; k < i && at[k] < at[i] - 20.0 && !was_here; ++k) {
          was_here = step_of(session.scans[k], session.scans[i]) < 1.0;
        }
        again += was_here ? 1U : 0U;
      }
      CHECK(static_cast<double>(again) > 0.1 * static_cast<double>(session.scans.size()) / 5.0);
    }
  }
}

TEST_CASE("exact scans of every kind end on obstacles") {
  for (const SimKind kind : kToured) {
    for (const int beams : {180, 181, 360, 361}) {
      CAPTURE(static_cast<int>(kind));
      SimOptions options = exact(kind);
      options.path_m = 30.0;
      options.beams = beams;
      const std::vector<WallSegment> walls = obstacles(make_floor(options, 0));
      const SimSession session = simulate(options, 0);
      const double increment = kPi / 180.0 / (beams >= 360 ? 2.0 : 1.0);
      int hits = 0;
      for (std::size_t i = 0; i < session.scans.size(); i += 17) {
        const Pose2& p = session.scans[i].world_T_base;
        REQUIRE(session.scans[i].ranges.size() == static_cast<std::size_t>(beams));
        for (std::size_t beam = 0; beam < session.scans[i].ranges.size(); beam += 11) {
          const double range = static_cast<double>(session.scans[i].ranges[beam]);
          const double angle = p.theta - kPi / 2.0 + increment * static_cast<double>(beam);
          if (range <= options.range_m) {
            ++hits;
            REQUIRE(clearance(walls, {p.x + range * std::cos(angle), p.y + range * std::sin(angle)}) < 0.006);
          }
        }
      }
      CHECK(hits > 50);
    }
  }
}

TEST_CASE("odometry presets: worse ones end farther off, signs come from the seed, noise is of the way") {
  double last = 0.0;
  for (const SimOdometry quality : {SimOdometry::good, SimOdometry::plain, SimOdometry::poor}) {
    double sum = 0.0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      SimOptions options = options_for(SimKind::offices);
      options.seed = seed;
      options.range_m = 1.0;
      set_odometry(options, quality);
      const SimSession session = simulate(options, 0);
      sum += score_trajectory(odometry_of(session), truth_of(session)).ate_rmse_m;
    }
    CHECK(sum > 1.5 * last);
    last = sum;
  }
  bool scales[2] = {false, false};
  bool turns[2] = {false, false};
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    SimOptions options;
    options.seed = seed;
    set_odometry(options, SimOdometry::slipping);
    scales[options.scale_error > 0.0 ? 1 : 0] = true;
    turns[options.turn_error_rad_per_m > 0.0 ? 1 : 0] = true;
    // Variance of a metre: of 1 / spacing steps, each of (noise * spacing)^2 and of turn^2.
    const double way = options.way_noise * options.way_noise * options.spacing_m;
    const double turn = options.turn_noise_rad * options.turn_noise_rad / options.spacing_m;
    options.spacing_m = 1.0;
    set_odometry(options, SimOdometry::slipping);
    CHECK(options.way_noise * options.way_noise == doctest::Approx(way));
    CHECK(options.turn_noise_rad * options.turn_noise_rad == doctest::Approx(turn));
  }
  CHECK((scales[0] && scales[1] && turns[0] && turns[1]));
}

TEST_CASE("the same seed gives the same drive, another seed and another session another one") {
  for (const SimKind kind : kToured) {
    SimOptions options = options_for(kind);
    options.path_m = 20.0;
    options.sessions = 2;
    options.change = 0.5;
    const SimSession first = simulate(options, 0);
    const SimSession again = simulate(options, 0);
    REQUIRE(first.scans.size() == again.scans.size());
    for (std::size_t i = 0; i < first.scans.size(); ++i) {
      REQUIRE(first.scans[i].ranges == again.scans[i].ranges);
      REQUIRE(first.scans[i].odometry_T_base.x == again.scans[i].odometry_T_base.x);
    }
    const SimSession second = simulate(options, 1);
    CHECK(step_of(first.scans.front(), second.scans.front()) > 0.1);
    options.seed = 2;
    CHECK(step_of(first.scans.front(), simulate(options, 0).scans.front()) > 0.1);
  }
}
