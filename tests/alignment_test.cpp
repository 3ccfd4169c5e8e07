#include "mellin/spectral/alignment.hpp"

#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "mellin/core/random.hpp"
#include "tests/support/submaps.hpp"

using namespace mellin;

namespace {

constexpr double kDegree = kPi / 180.0;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// An alignment with its memory.
class Bench {
 public:
  explicit Bench(const AlignmentConfig& config = {}) {
    MeasureArena measure;
    Alignment::carve(measure, config);
    memory_.resize(measure.use().total() / sizeof(double));
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(memory_.data()), measure.use().total()));
    const Alignment::Memory carved = Alignment::carve(arena, config);
    REQUIRE(arena.ok());
    REQUIRE(arena.use().total() == measure.use().total());
    REQUIRE(alignment.init(config, carved) == Status::ok);
  }
  Result<AlignmentResult> align(const GridView& a, const GridView& b, const Pose2& a_T_b) {
    REQUIRE(alignment.begin(a, b, a_T_b) == Status::ok);
    while (alignment.step()) {
    }
    return alignment.result();
  }
  Alignment alignment;

 private:
  std::vector<double> memory_;
};

/// Up to `distance_m` away and `angle_rad` turned, on the right of the pose.
Pose2 disturbed(const Pose2& pose, double distance_m, double angle_rad, Random& random) {
  const double direction = kTwoPi * random.uniform();
  const double distance = distance_m * random.uniform();
  return compose(pose, {distance * std::cos(direction), distance * std::sin(direction),
                        angle_rad * (2.0 * random.uniform() - 1.0)});
}

struct Errors {
  std::vector<double> metres;
  std::vector<double> degrees;
  void add(const Pose2& found, const Pose2& truth) {
    const Pose2 error = between(found, truth);
    metres.push_back(translation(error));
    degrees.push_back(std::fabs(error.theta) / kDegree);
  }
  static double quantile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }
};

/// Submaps of every second scan and of the scans between, of which the true relative pose is known as well as the
/// scans' poses are consistent, aligned from up to 0.4 m and 3 degrees beside it.
Errors align_interleaved(const std::vector<host::PosedScan>& scans, std::size_t step) {
  Bench bench;
  Random random(1, 0);
  Errors errors;
  for (std::size_t first = 0; first + 40 <= scans.size(); first += step) {
    const host::RenderedSubmap a = test::submap(scans, first, 20, 2, kTwoPi * random.uniform());
    const host::RenderedSubmap b = test::submap(scans, first + 1, 20, 2, kTwoPi * random.uniform());
    const Pose2 truth = between(a.world_T_submap, b.world_T_submap);
    const Result<AlignmentResult> result =
        bench.align(a.view(), b.view(), disturbed(truth, 0.4, 3.0 * kDegree, random));
    REQUIRE(result.ok());
    errors.add(result.value().a_T_b, truth);
  }
  return errors;
}

/// Two parallel walls `width_m` apart through the whole grid, at an angle; the last metre of each end is not observed.
host::RenderedSubmap corridor(double angle_rad, double width_m) {
  std::vector<host::PosedScan> scans;
  for (double x = -5.0; x <= 5.0; x += 0.25) {
    host::PosedScan scan{{x * std::cos(angle_rad), x * std::sin(angle_rad), angle_rad}, {}, -kPi, kPi / 180.0, 7.0};
    for (int beam = 0; beam < 360; ++beam) {
      const double across = std::fabs(std::sin(-kPi + beam * kPi / 180.0));
      scan.ranges_m.push_back(across > 0.0 ? static_cast<float>(0.5 * width_m / across) : 100.0F);
    }
    scans.push_back(scan);
  }
  return host::render_submap(scans, {}, 384, 0.05F);
}

}  // namespace

TEST_CASE("alignment finds the pose of simulated submaps to centimetres") {
  const Errors errors = align_interleaved(test::simulated_scans(3), 23);
  REQUIRE(errors.metres.size() >= 5);
  CHECK(Errors::quantile(errors.metres, 0.5) < 0.015);
  CHECK(Errors::quantile(errors.degrees, 0.5) < 0.15);
}

TEST_CASE("alignment finds the pose of real submaps to centimetres") {
  const auto folder = test::data_folder();
  if (!folder) {
    MESSAGE("skipped: no data");
    return;
  }
  for (const char* name : {"intel", "fr079", "aces"}) {
    const Errors errors = align_interleaved(test::real_scans(*folder, name), 40);
    REQUIRE(errors.metres.size() >= 5);
    const double median_m = Errors::quantile(errors.metres, 0.5);
    const double p95_m = Errors::quantile(errors.metres, 0.95);
    const double median_degrees = Errors::quantile(errors.degrees, 0.5);
    const double p95_degrees = Errors::quantile(errors.degrees, 0.95);
    MESSAGE(std::string(name) << ": " << errors.metres.size() << " pairs, median " << median_m << " m "
                              << median_degrees << " degrees, 95 % " << p95_m << " m " << p95_degrees << " degrees");
    CHECK(median_m < 0.015);
    CHECK(p95_m < 0.05);
    CHECK(median_degrees < 0.1);
    CHECK(p95_degrees < 0.4);
  }
}

TEST_CASE("a corridor fixes the pose across it and the heading, and says nothing along it") {
  const double angle = 0.3;
  const host::RenderedSubmap a = corridor(angle, 2.0);
  Bench bench;
  // 0.25 m along the corridor, 0.2 m across it.
  const Pose2 along{std::cos(angle), std::sin(angle), 0.0};
  const Pose2 start{0.25 * along.x - 0.2 * along.y, 0.25 * along.y + 0.2 * along.x, 1.5 * kDegree};
  const Result<AlignmentResult> result = bench.align(a.view(), a.view(), start);
  REQUIRE(result.ok());
  const Pose2 found = result.value().a_T_b;
  CHECK(std::fabs(-found.x * along.y + found.y * along.x) < 0.015);
  CHECK(std::fabs(found.theta) < 0.2 * kDegree);
  const double stiff_along = quadratic_form(result.value().information, along);
  const double stiff_across = quadratic_form(result.value().information, {-along.y, along.x, 0.0});
  CHECK(stiff_across > 1.0 / (0.05 * 0.05));
  CHECK(stiff_along < 0.02 * stiff_across);
  CHECK(stiff_along >= 0.0);
}

TEST_CASE("walls a single wide cell thick hold the pose across themselves, and only there") {
  constexpr std::uint16_t kSide = 160;
  constexpr float kCell = 0.16F;
  for (const bool room : {true, false}) {
    CAPTURE(room);
    // Two walls along x, 9 m apart; in a room two along y as well.
    std::vector<std::uint8_t> cells(std::size_t{kSide} * kSide, std::uint8_t{0});
    for (std::size_t i = 50; i <= 106; ++i) {
      cells[50 * kSide + i] = cells[106 * kSide + i] = 254;
      if (room) {
        cells[i * kSide + 50] = cells[i * kSide + 106] = 254;
      }
    }
    AlignmentConfig config;
    config.final_m = 0.2F;
    Bench bench(config);
    const GridView grid{{cells.data(), cells.size()}, kSide, kCell};
    const Result<AlignmentResult> result = bench.align(grid, grid, {0.02, 0.03, 0.002});
    REQUIRE(result.ok());
    // Known to 0.1 m across walls; along them only where there are others.
    CHECK(result.value().information.yy > 1.0 / (0.1 * 0.1));
    CHECK((result.value().information.xx > 1.0 / (0.1 * 0.1)) == room);
  }
}

TEST_CASE("alignment does not depend on the size of its slices") {
  const std::vector<host::PosedScan> scans = test::simulated_scans(3);
  const host::RenderedSubmap a = test::submap(scans, 0, 20, 2, 0.4);
  const host::RenderedSubmap b = test::submap(scans, 1, 20, 2, -1.0);
  const Pose2 start = compose(between(a.world_T_submap, b.world_T_submap), {0.1, 0.1, 0.02});
  AlignmentConfig small;
  small.rows_per_step = 7;
  const Result<AlignmentResult> whole = Bench().align(a.view(), b.view(), start);
  const Result<AlignmentResult> sliced = Bench(small).align(a.view(), b.view(), start);
  REQUIRE(whole.ok());
  REQUIRE(sliced.ok());
  CHECK(std::memcmp(&whole.value().a_T_b, &sliced.value().a_T_b, sizeof(Pose2)) == 0);
  CHECK(std::memcmp(&whole.value().information, &sliced.value().information, sizeof(Sym3)) == 0);
  CHECK(whole.value().converged);
}

TEST_CASE("alignment does not depend on what it keeps from one hypothesis or pair to the next") {
  const std::vector<host::PosedScan> scans = test::simulated_scans(3);
  const host::RenderedSubmap a = test::submap(scans, 0, 20, 2, 0.4);
  const host::RenderedSubmap b = test::submap(scans, 1, 20, 2, -1.0);
  const host::RenderedSubmap other = test::submap(scans, 60, 20, 2, 2.0);
  const Pose2 start = compose(between(a.world_T_submap, b.world_T_submap), {0.1, 0.1, 0.02});
  const Result<AlignmentResult> fresh = Bench().align(a.view(), b.view(), start);
  REQUIRE(fresh.ok());
  for (const bool keep_both : {true, false}) {
    AlignmentConfig config;
    config.keep_both = keep_both;
    Bench bench(config);
    Alignment& alignment = bench.alignment;
    const auto run = [&alignment](const Pose2& a_T_b) {
      REQUIRE(alignment.begin(a_T_b) == Status::ok);
      while (alignment.step()) {
      }
      return alignment.result();
    };
    REQUIRE(alignment.set_b(b.view()) == Status::ok);
    REQUIRE(alignment.set_a(other.view()) == Status::ok);
    (void)run({1.0, 2.0, 0.5});
    REQUIRE(alignment.set_a(a.view()) == Status::ok);
    (void)run(compose(start, {0.3, 0.0, 0.1}));
    const Result<AlignmentResult> kept = run(start);
    REQUIRE(kept.ok());
    CHECK(std::memcmp(&fresh.value().a_T_b, &kept.value().a_T_b, sizeof(Pose2)) == 0);
    CHECK(std::memcmp(&fresh.value().information, &kept.value().information, sizeof(Sym3)) == 0);
  }
}

TEST_CASE("a wrong place shows in the evidence") {
  const std::vector<host::PosedScan> scans = test::simulated_scans(3);
  const host::RenderedSubmap a = test::submap(scans, 0, 20, 2, 0.4);
  const host::RenderedSubmap b = test::submap(scans, 1, 20, 2, -1.0);
  const Pose2 truth = between(a.world_T_submap, b.world_T_submap);
  Bench bench;
  const Result<AlignmentResult> right = bench.align(a.view(), b.view(), truth);
  const Result<AlignmentResult> wrong = bench.align(a.view(), b.view(), compose(truth, {0.0, 0.0, 0.5}));
  REQUIRE(right.ok());
  CHECK(right.value().inlier_share > 0.9F);
  if (wrong.ok()) {
    CHECK(wrong.value().inlier_share < 0.7F);
    CHECK(wrong.value().information.xx < 0.7 * right.value().information.xx);
  }
}

TEST_CASE("alignment refuses misuse and says where there is nothing to align") {
  AlignmentConfig config;
  config.max_side = 64;
  config.final_m = 2.0F * config.capture_m;
  CHECK(Alignment().init(config, {}) == Status::invalid_config);
  config = {};
  CHECK(Alignment().init(config, {}) == Status::insufficient_memory);

  config.max_side = 64;
  Bench bench(config);
  const std::vector<std::uint8_t> free(64 * 64, 0);
  const std::vector<std::uint8_t> blind(64 * 64, kUnobserved);
  const GridView grid{{free.data(), free.size()}, 64, 0.05F};
  const GridView unknown{{blind.data(), blind.size()}, 64, 0.05F};
  const std::vector<std::uint8_t> large(66 * 66, 0);
  CHECK(bench.alignment.begin({{large.data(), large.size()}, 66, 0.05F}, grid, {}) == Status::invalid_argument);
  CHECK(bench.alignment.begin(grid, {{free.data(), 10}, 64, 0.05F}, {}) == Status::invalid_argument);
  CHECK(bench.alignment.begin(grid, grid, {kNan, 0.0, 0.0}) == Status::invalid_argument);
  CHECK(bench.alignment.result().status() == Status::busy);
  REQUIRE(bench.alignment.begin(grid, grid, {}) == Status::ok);
  CHECK(bench.alignment.result().status() == Status::busy);
  CHECK(bench.align(grid, grid, {}).status() == Status::degenerate);
  CHECK(bench.align(unknown, grid, {1e9, -1e9, 3.0}).status() == Status::degenerate);
  // Cells of absurd sizes and a grid full of obstacles end as well.
  const std::vector<std::uint8_t> full(64 * 64, kCertainlyOccupied);
  for (const float cell_m : {1e-30F, 1e-3F, 1e30F}) {
    const GridView odd{{full.data(), full.size()}, 64, cell_m};
    REQUIRE(bench.alignment.begin(odd, odd, {0.1, 0.0, 0.0}) == Status::ok);
    while (bench.alignment.step()) {
    }
    CHECK(bench.alignment.result().status() != Status::busy);
  }
}
