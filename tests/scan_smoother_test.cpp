// Smoothing of the remembered scans' poses: exact scans of a known room, from poses that are wrong in a known way.
#include "mellin/mapping/scan_smoother.hpp"

#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "mellin/core/random.hpp"
#include "tests/support/carved.hpp"
#include "tests/support/room.hpp"

using namespace mellin;
using mellin::test::corridor;
using mellin::test::give;
using mellin::test::measure;
using mellin::test::room;
using mellin::test::span;
using mellin::test::Walls;

namespace {

/// Scans of a world from true poses, and a smoother for them.
struct Bench {
  LaserConfig lasers[kMaxLasers];
  std::vector<std::uint64_t> scan_words;
  std::vector<std::uint64_t> words;
  ScanMemory scans;
  ScanSmoother smoother;
  std::vector<Pose2> truth;

  Bench(const Walls& walls, const std::vector<Pose2>& poses, ScanSmootherConfig config = {},
        const Pose2& base_T_laser = {})
      : truth(poses) {
    lasers[0].beams = 180;
    lasers[0].max_range_m = 20.0F;
    lasers[0].base_T_laser = base_T_laser;
    const ScanMemoryConfig memory{static_cast<std::uint16_t>(poses.size()), 180};
    scans = ScanMemory(memory, give<ScanMemory>(scan_words, memory), {lasers, kMaxLasers});
    for (const Pose2& pose : poses) {
      const std::vector<float> ranges = measure(walls, pose, lasers[0]);
      scans.stage({0, span(ranges), {}, 0});
      (void)scans.take_staged();
    }
    config.max_scans = static_cast<std::uint16_t>(poses.size());
    config.max_beams = 180;
    smoother = ScanSmoother(config, give<ScanSmoother>(words, config));
  }

  std::vector<Pose2> smoothed(std::vector<Pose2> poses) {
    smoother.begin(0, {poses.data(), poses.size()});
    while (smoother.step(scans)) {
    }
    return poses;
  }

  /// Largest error of a scan's pose relative to that of the one in the middle.
  Pose2 worst(const std::vector<Pose2>& poses) const {
    const std::size_t middle = poses.size() / 2;
    Pose2 most;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Pose2 e = between(between(truth[middle], truth[i]), between(poses[middle], poses[i]));
      most = {std::max(most.x, std::fabs(e.x)), std::max(most.y, std::fabs(e.y)),
              std::max(most.theta, std::fabs(e.theta))};
    }
    return most;
  }
};

/// A lap round the room's pillar.
std::vector<Pose2> lap(int count) {
  std::vector<Pose2> poses;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * kPi * i / count;
    poses.push_back({2.4 * std::cos(angle) - 0.6, 1.9 * std::sin(angle), wrap_angle(angle + kHalfPi)});
  }
  return poses;
}

/// Those poses with errors of their own, and with a drift along the way.
std::vector<Pose2> disturbed(const std::vector<Pose2>& poses, double noise_m, double noise_rad, const Pose2& drift) {
  Random random(3, 1);
  std::vector<Pose2> out;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Pose2 step = i == 0 ? poses[0] : compose(between(poses[i - 1], poses[i]), drift);
    out.push_back(i == 0 ? step : compose(out[i - 1], step));
  }
  for (Pose2& pose : out) {
    pose = compose(pose, {noise_m * random.normal(), noise_m * random.normal(), noise_rad * random.normal()});
  }
  return out;
}

/// Steps trusted to 5 cm and 0.02 rad only, so that the scans decide wherever they can.
ScanSmootherConfig loose_steps() {
  ScanSmootherConfig config;
  config.step_sigma_m = 0.05F;
  config.step_sigma_rad = 0.02F;
  return config;
}

}  // namespace

TEST_CASE("scans that lie wrong by centimetres come to lie by millimetres") {
  for (const Pose2& mount : {Pose2{}, Pose2{0.3, -0.1, 0.2}, Pose2{-0.2, 0.0, -kPi}}) {
    CAPTURE(mount.theta);
    Bench bench(room(), lap(24), loose_steps(), mount);
    const std::vector<Pose2> wrong = disturbed(bench.truth, 0.02, 0.005, {});
    const Pose2 before = bench.worst(wrong);
    const Pose2 after = bench.worst(bench.smoothed(wrong));
    CHECK(std::max(before.x, before.y) > 0.03);
    CHECK(after.x < 0.006);
    CHECK(after.y < 0.006);
    CHECK(after.theta < 0.0015);
  }
}

TEST_CASE("a loop within the memory closes: the drift along the way goes") {
  // 2 mm and 0.8 mrad a scan, always the same way: 6 cm and 1.4 degrees where the lap ends.
  ScanSmootherConfig config;
  config.iterations = 6;
  Bench bench(room(), lap(32), config);
  const std::vector<Pose2> drifting = disturbed(bench.truth, 0.0, 0.0, {0.002, 0.0, 0.0008});
  const Pose2 before = bench.worst(drifting);
  const Pose2 after = bench.worst(bench.smoothed(drifting));
  CHECK(before.theta > 0.012);
  CHECK(after.theta < 0.2 * before.theta);
  CHECK(std::max(after.x, after.y) < 0.3 * std::max(before.x, before.y));
}

TEST_CASE("true poses stay, and so does the scan in the middle whatever happens") {
  Bench bench(room(), lap(24));
  const Pose2 still = bench.worst(bench.smoothed(bench.truth));
  CHECK(std::max(still.x, still.y) < 0.004);  // ranges are kept in steps of 2 mm
  CHECK(still.theta < 0.001);
  const std::vector<Pose2> wrong = disturbed(bench.truth, 0.02, 0.005, {});
  const std::vector<Pose2> after = bench.smoothed(wrong);
  CHECK(translation(between(wrong[12], after[12])) < 1e-5);
  CHECK(std::fabs(after[12].theta - wrong[12].theta) < 1e-5);
}

TEST_CASE("along a corridor the local mapper's steps stand; across it and in heading the walls decide") {
  std::vector<Pose2> way;
  for (int i = 0; i < 20; ++i) {
    way.push_back({0.5 * i, 0.0, 0.0});
  }
  Bench bench(corridor(), way, loose_steps());
  std::vector<Pose2> wrong;
  for (int i = 0; i < 20; ++i) {
    wrong.push_back({0.52 * i, 0.02 * ((i % 3) - 1), 0.004 * ((i % 2) - 0.5)});  // reads 4 % too long
  }
  const std::vector<Pose2> after = bench.smoothed(wrong);
  for (int i = 0; i < 20; ++i) {
    CAPTURE(i);
    const Pose2 seen = between(after[10], after[static_cast<std::size_t>(i)]);
    CHECK(std::fabs(seen.x - 0.52 * (i - 10)) < 0.01);
    CHECK(std::fabs(seen.y) < 0.004);
    CHECK(std::fabs(seen.theta) < 0.001);
  }
}

TEST_CASE("blind scans keep the steps, two scans are left alone, and switched off it takes no memory") {
  Bench blind({}, lap(12));
  const std::vector<Pose2> wrong = disturbed(blind.truth, 0.02, 0.01, {});
  const std::vector<Pose2> after = blind.smoothed(wrong);
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    CHECK(translation(between(wrong[i], after[i])) < 1e-4);
  }
  Bench two(room(), lap(2));
  const std::vector<Pose2> apart{{}, {1.0, 2.0, 3.0}};
  CHECK(two.smoothed(apart)[1].x == 1.0);
  ScanSmootherConfig off;
  off.iterations = 0;
  off.max_scans = 40;
  off.max_beams = 180;
  MeasureArena measured;
  (void)ScanSmoother::carve(measured, off);
  CHECK(measured.use().total() == 0);
}
