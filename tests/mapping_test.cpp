// The local mapper's parts in rooms made by hand, whose truth is known to the digit.
#include <doctest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "mapping/surface.hpp"
#include "mellin/mapping/particle_mapper.hpp"
#include "mellin/mapping/scan_matcher.hpp"
#include "mellin/mapping/scan_memory.hpp"
#include "tests/support/carved.hpp"
#include "tests/support/room.hpp"

using namespace mellin;
using mellin::test::corridor;
using mellin::test::measure;
using mellin::test::room;
using mellin::test::span;
using mellin::test::Walls;

namespace {

constexpr double kDegree = kPi / 180.0;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Heap memory for anything with a carve().
struct Memory {
  std::vector<std::uint64_t> words;
  template <class Part, class Config>
  typename Part::Memory give(const Config& config) {
    return test::give<Part>(words, config);
  }
};

struct Lasers {
  LaserConfig all[kMaxLasers];
  Lasers() {
    all[0].beams = 180;
    all[0].max_range_m = 20.0F;
  }
  Span<const LaserConfig> span() const { return {all, kMaxLasers}; }
};

/// A live grid of the walls as seen from a few poses, and a matcher with a scan taken elsewhere.
struct Bench {
  static constexpr std::uint16_t kSide = 512;
  Lasers lasers;
  Memory memory_scans, memory_matcher;
  std::vector<CellCount> cells = std::vector<CellCount>(std::size_t{kSide} * kSide);
  std::vector<std::uint8_t> field = std::vector<std::uint8_t>(std::size_t{kSide} * kSide);
  ScanMemory scans;
  LiveGrid grid;
  ScanMatcherConfig config;
  ScanMatcher matcher;

  explicit Bench(float cell_m = 0.05F, double angle_min = -kHalfPi, std::uint16_t beams = 180,
                 const Pose2& mount = {}) {
    lasers.all[0].beams = beams;
    lasers.all[0].angle_min_rad = static_cast<float>(angle_min);
    lasers.all[0].base_T_laser = mount;
    const ScanMemoryConfig scan_config{32, beams};
    scans = ScanMemory(scan_config, memory_scans.give<ScanMemory>(scan_config), lasers.span());
    grid = LiveGrid({{{cells.data(), cells.size()}, {}}, {field.data(), field.size()}, {}}, 0, kSide, cell_m);
    grid.reset({});
    config.max_points = beams;
    matcher = ScanMatcher(config, memory_matcher.give<ScanMatcher>(config));
  }
  void map(const Walls& walls, const std::vector<Pose2>& poses) {
    for (const Pose2& pose : poses) {
      const std::vector<float> ranges = measure(walls, pose, lasers.all[0]);
      scans.stage({0, span(ranges), {}, 0});
      const std::uint32_t number = scans.take_staged();
      grid.add(scans, number, pose, grid.grid().window());
    }
  }
  std::size_t look(const Walls& walls, const Pose2& pose) {
    const std::vector<float> ranges = measure(walls, pose, lasers.all[0]);
    return set(ranges);
  }
  std::size_t set(const std::vector<float>& ranges) {
    scans.stage({0, span(ranges), {}, 0});
    return matcher.set_scan(scans.ranges(scans.end()), scans.directions(scans.end()), lasers.all[0].base_T_laser,
                            grid.cell_m());
  }
};

Sym3 prior_of(double sigma_m, double sigma_rad) {
  return diagonal(1.0 / (sigma_m * sigma_m), 1.0 / (sigma_m * sigma_m), 1.0 / (sigma_rad * sigma_rad));
}

/// Poses round the middle of the room from which all its walls are seen.
std::vector<Pose2> views() {
  std::vector<Pose2> poses;
  for (int i = 0; i < 24; ++i) {
    poses.push_back({-0.5 + 0.043 * i, -0.7 + 0.051 * i, 2.0 * kPi * i / 24});
  }
  return poses;
}

}  // namespace

TEST_CASE("scan memory: a staged scan is none until it is taken, the oldest is overwritten, numbers count on") {
  Lasers lasers;
  lasers.all[0].beams = 3;
  lasers.all[1].beams = 2;
  lasers.all[1].max_range_m = 5.0F;
  const ScanMemoryConfig config{4, 3};
  Memory memory;
  ScanMemory scans(config, memory.give<ScanMemory>(config), lasers.span());
  const auto ranges_of = [](std::uint32_t i) { return std::vector<float>{1.0F + 0.1F * static_cast<float>(i), 2, 3}; };
  for (std::uint32_t i = 0; i < 11; ++i) {
    const std::vector<float> wrong{9, 9, 9};
    scans.stage({-1, span(wrong), {}, 0});  // matched, not taken
    CHECK(scans.end() == i);
    CHECK_FALSE(scans.holds(i));
    const std::vector<float> ranges = ranges_of(i);
    scans.stage({static_cast<std::int64_t>(i) * 10, span(ranges), {}, 0});
    CHECK(scans.take_staged() == i);
    for (std::uint32_t k = 0; k <= i; ++k) {
      REQUIRE(scans.holds(k) == (k + 4 > i));
      if (scans.holds(k)) {
        CHECK(scans.stamp_us(k) == static_cast<std::int64_t>(k) * 10);
        CHECK(scans.ranges(k).size() == 3);
        CHECK(scans.ranges(k)[0] == 500 + 50 * k);
        CHECK(scans.ranges(k)[2] == 1500);
      }
    }
  }
  CHECK_FALSE(scans.holds(UINT32_MAX));
  // Another laser: fewer beams, its own limits.
  const std::vector<float> two{4.0F, 6.0F};
  scans.stage({0, span(two), {}, 1});
  const std::uint32_t number = scans.take_staged();
  CHECK(scans.ranges(number).size() == 2);
  CHECK(scans.ranges(number)[0] == 2000);
  CHECK(scans.ranges(number)[1] == 0);  // beyond its range
  CHECK(scans.directions(number).size() == 2);
  scans.clear();
  CHECK(scans.end() == 0);
  CHECK_FALSE(scans.holds(0));
}

TEST_CASE("scan memory: beams end where the mounted laser sees them, whatever its angles and the robot's pose") {
  for (const double angle_min : {-kHalfPi, 0.0, 1.0, -kPi, 3.0}) {
    for (const double increment : {kTwoPi / 64, -kTwoPi / 64, 0.02}) {  // a whole turn, clockwise, part of one
      Lasers lasers;
      lasers.all[2].beams = 64;
      lasers.all[2].angle_min_rad = static_cast<float>(angle_min);
      lasers.all[2].angle_increment_rad = static_cast<float>(increment);
      lasers.all[2].max_range_m = 20.0F;
      lasers.all[2].base_T_laser = {0.31, -0.22, 2.4};
      const ScanMemoryConfig config{2, 64};
      Memory memory;
      ScanMemory scans(config, memory.give<ScanMemory>(config), lasers.span());
      std::vector<float> ranges;
      for (int i = 0; i < 64; ++i) {
        ranges.push_back(i % 7 == 3 ? kNaN : 1.0F + 0.17F * static_cast<float>(i));
      }
      scans.stage({0, span(ranges), {}, 2});
      const std::uint32_t number = scans.take_staged();
      for (const Pose2& pose : {Pose2{0.0, 0.0, 0.0}, Pose2{-3.217, 5.9, -2.2}, Pose2{5000.3, -7000.9, 1.1}}) {
        const float cell = 0.1F;
        int beam = 0, wrong = 0, met = 0;
        scans.visit_rays(number, grid_pose(pose, cell), cell, [&](const Ray& ray) {
          beam += beam % 7 == 3 ? 1 : 0;
          const Pose2 laser = compose(pose, lasers.all[2].base_T_laser);
          const double angle = laser.theta + angle_min + beam * increment;
          const double length = 1.0 + 0.17 * beam;
          // Within a quarter of a cell of rounding: ranges are kept to 2 mm, angles in float.
          const auto near = [&](std::int32_t have, double metres) {
            const double exact = metres / 0.1;
            return have + 0.05 > std::floor(exact) - 0.05 &&
                   (have == std::floor(exact) || std::fabs(exact - std::round(exact)) < 0.05);
          };
          wrong += near(ray.column_from, laser.x) && near(ray.row_from, laser.y) ? 0 : 1;
          wrong += near(ray.column_to, laser.x + length * std::cos(angle)) ? 0 : 1;
          wrong += near(ray.row_to, laser.y + length * std::sin(angle)) ? 0 : 1;
          ++met;
          ++beam;
        });
        CHECK(wrong == 0);
        CHECK(met == 64 - 9);
      }
    }
  }
}

TEST_CASE("matching recovers a known offset to millimetres and a tenth of a degree") {
  for (const Pose2& mount : {Pose2{}, Pose2{0.2, -0.1, 0.5}}) {
    Bench bench(0.05F, -kPi, 360, mount);
    bench.map(room(), views());
    double worst_m = 0.0, worst_rad = 0.0, sum_m = 0.0;
    int count = 0;
    for (const Pose2& truth : {Pose2{0.1, -0.2, 0.3}, Pose2{-0.33, 0.4, 2.0}, Pose2{0.4, 0.1, -1.2}}) {
      for (const Pose2& off : {Pose2{0.05, -0.04, 1.5 * kDegree}, Pose2{-0.06, 0.02, -2.0 * kDegree}, Pose2{}}) {
        REQUIRE(bench.look(room(), truth) > 300);
        const Pose2 start = compose(truth, off);
        const MatchResult match = bench.matcher.refine(bench.grid, start, start, prior_of(0.5, 0.3));
        CHECK(match.good);
        CHECK(match.inlier_share > 0.9F);
        const Pose2 error = between(truth, match.pose);
        worst_m = std::max(worst_m, translation(error));
        worst_rad = std::max(worst_rad, std::fabs(error.theta));
        sum_m += translation(error);
        ++count;
      }
    }
    CHECK(worst_m < 0.012);  // a quarter of a cell
    CHECK(sum_m / count < 0.01);
    CHECK(worst_rad < 0.2 * kDegree);
  }
}

TEST_CASE("correlative search recovers 0.45 m and 19 degrees, where refinement alone is lost") {
  Bench bench(0.05F, -kPi, 360);
  bench.map(room(), views());
  int lost = 0;
  for (const Pose2& off :
       {Pose2{0.45, -0.45, 19.0 * kDegree}, Pose2{-0.45, 0.4, -19.0 * kDegree}, Pose2{0.45, 0.45, -18.0 * kDegree}}) {
    const Pose2 truth{0.2, 0.1, 0.8};
    (void)bench.look(room(), truth);
    const Pose2 start = compose(truth, off);
    const MatchResult match = bench.matcher.search(bench.grid, start, prior_of(0.5, 0.3));
    CHECK(match.good);
    CHECK(translation(between(truth, match.pose)) < 0.02);
    CHECK(std::fabs(between(truth, match.pose).theta) < 0.2 * kDegree);
    const MatchResult near = bench.matcher.refine(bench.grid, start, start, prior_of(0.5, 0.3));
    lost += translation(between(truth, near.pose)) > 0.1 ? 1 : 0;
  }
  CHECK(lost > 0);
}

TEST_CASE("in a plain corridor the scan says where the robot is across and how it looks, the prior where along") {
  for (const double heading : {0.0, 0.7, kHalfPi}) {
    // The corridor lies along x of the world, the robot looks along it; the grid turns with `heading`.
    const auto turned = [&](const Pose2& p) { return compose({0.0, 0.0, heading}, p); };
    Walls walls;
    for (const host::WallSegment& w : corridor()) {
      const Pose2 a = turned({w.a.x, w.a.y, 0.0}), b = turned({w.b.x, w.b.y, 0.0});
      walls.push_back({{a.x, a.y}, {b.x, b.y}});
    }
    Bench bench(0.05F, -kPi, 360);
    bench.lasers.all[0].max_range_m = 8.0F;  // the map reaches farther: no end of a wall is seen
    std::vector<Pose2> poses;
    for (int i = -5; i <= 5; ++i) {
      poses.push_back(turned({0.4 * i, 0.02 * i, 0.03 * i}));
    }
    bench.map(walls, poses);
    const Pose2 truth = turned({0.0, 0.1, 0.05});
    (void)bench.look(walls, truth);
    const Pose2 start = compose(truth, {0.06, -0.06, 0.03});
    const Sym3 prior = prior_of(0.07, 0.05);  // what odometry leaves open over half a metre
    const MatchResult match = bench.matcher.search(bench.grid, start, prior);
    CHECK(match.good);
    const Pose2 from_axis = between(turned({0.0, 0.0, 0.0}), match.pose);
    const Pose2 start_from_axis = between(turned({0.0, 0.0, 0.0}), start);
    CHECK(std::fabs(from_axis.x - start_from_axis.x) < 0.03);  // stays: the walls' cells pull a little
    CHECK(std::fabs(from_axis.y - 0.1) < 0.02);
    CHECK(std::fabs(from_axis.theta - 0.05) < 0.3 * kDegree);
    // The scan's own information: rich across the corridor and in heading, next to nothing along it.
    const Sym3 own = bench.matcher.scan_information(bench.grid, match.pose);
    CHECK(own.xx < 0.02 * own.yy);
    CHECK(own.tt > 100.0);
  }
}

TEST_CASE("normals of surfaces: of near walls, of walls that beams graze, of single ends none") {
  using surface::normal;
  // A wall along x seen from far: the ends lie 0.1 m, then 1 m and more apart; a step of 0.3 m; a pole.
  const Point2f ends[] = {{0.0F, 1.2F}, {0.1F, 1.2F},  {0.2F, 1.2F},  {0.3F, 1.2F}, {1.2F, 1.2F}, {2.5F, 1.2F},
                          {4.2F, 1.2F}, {6.4F, 1.25F}, {8.0F, 1.55F}, {5.0F, 0.0F}, {5.0F, 4.0F}};
  const Span<const Point2f> seen(ends);
  for (const float unit : {1.0F, 0.05F}) {
    CAPTURE(unit);
    std::vector<Point2f> scaled;
    for (const Point2f& end : ends) {
      scaled.push_back({end.x / unit, end.y / unit});
    }
    const Span<const Point2f> of(scaled.data(), scaled.size());
    for (const std::size_t on_wall : {1U, 2U, 4U, 5U, 6U}) {
      CAPTURE(on_wall);
      CHECK(std::fabs(normal(of, on_wall, unit).x) < 0.02F);
      CHECK(std::fabs(normal(of, on_wall, unit).y) > 0.999F);
    }
    for (const std::size_t single : {7U, 8U, 9U, 10U}) {  // off the line of its neighbours, or too far from them
      CAPTURE(single);
      CHECK(normal(of, single, unit).x == 0.0F);
      CHECK(normal(of, single, unit).y == 0.0F);
    }
  }
  CHECK(normal(seen.first(1), 0, 1.0F).y == 0.0F);
}

TEST_CASE("no points, and an empty map: the prior stays, and the match is not good") {
  Bench bench;
  const Pose2 start{0.3, -0.2, 0.1};
  const Sym3 prior = prior_of(0.1, 0.05);
  // An empty map.
  REQUIRE(bench.look(room(), {}) == 180);
  for (const MatchResult& match :
       {bench.matcher.refine(bench.grid, start, start, prior), bench.matcher.search(bench.grid, start, prior)}) {
    CHECK_FALSE(match.good);
    CHECK(match.score == 0.0F);
    CHECK(match.inlier_share == 0.0F);
    CHECK(translation(between(start, match.pose)) < 1e-6);
  }
  // No points.
  bench.map(room(), views());
  REQUIRE(bench.set(std::vector<float>(180, kNaN)) == 0);
  for (const MatchResult& match :
       {bench.matcher.refine(bench.grid, start, start, prior), bench.matcher.search(bench.grid, start, prior)}) {
    CHECK_FALSE(match.good);
    CHECK(match.information.xx == doctest::Approx(prior.xx));
    CHECK(match.information.tt == doctest::Approx(prior.tt));
    CHECK(translation(between(start, match.pose)) < 1e-6);
  }
  CHECK(bench.matcher.scan_information(bench.grid, start).xx == 0.0);
}
