#include <doctest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/map_entropy.hpp"
#include "host/pairing.hpp"

using namespace mellin;
using namespace mellin::host;

namespace {

constexpr double kCell = 0.1;

double binary_entropy(double p) { return -p * std::log2(p) - (1.0 - p) * std::log2(1.0 - p); }

/// A log of a laser with one beam straight ahead, one scan a second that reads 0.4 m.
Log log_of(std::size_t scans) {
  Log log;
  log.lasers.push_back({false, 1, 0.0, 0.01, 8.0, MaxRangeSource::option, {}});
  for (std::size_t i = 0; i < scans; ++i) {
    LogScan scan;
    scan.seconds = static_cast<double>(i);
    scan.ranges = {0.4F};
    log.scans.push_back(scan);
  }
  return log;
}

/// The robot stands in the middle of cell (0, 0) for each scan; the i-th one is off by `off(i)` along the beam.
template <class Off>
std::vector<StampedPose> standing(std::size_t scans, Off off) {
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < scans; ++i) {
    poses.push_back({"", static_cast<double>(i), {kCell / 2.0 + off(i), kCell / 2.0, 0.0}});
  }
  return poses;
}

MapEntropy entropy(const Log& log, const std::vector<StampedPose>& trajectory) {
  return entropy_of(draw_map(log, poses_of_scans(log, trajectory), kCell).counts);
}

}  // namespace

TEST_CASE("a perfect map: each cell is as sure as so many agreeing beams make it") {
  for (const std::size_t scans : {1U, 10U, 1000U}) {
    CAPTURE(scans);
    const MapEntropy e = entropy(log_of(scans), standing(scans, [](std::size_t) { return 0.0; }));
    CHECK(e.cells == 5);  // four free ones and the wall
    CHECK(e.bits == doctest::Approx(5.0 * binary_entropy(0.5 / (static_cast<double>(scans) + 1.0))));
    CHECK(e.bits_per_cell() == doctest::Approx(e.bits / 5.0));
  }
}

TEST_CASE("a wall drawn twice has a cell of one bit less than certain, by hand") {
  // Half of the scans a cell too far: cell 4 is the wall for the one half and free for the other, cell 5 is the wall
  // of the second half, cell 0 the robot's place of the first half only.
  constexpr std::size_t kScans = 100;
  const Log log = log_of(kScans);
  const MapEntropy e = entropy(log, standing(kScans, [](std::size_t i) { return i % 2 == 0 ? 0.0 : kCell; }));
  CHECK(e.cells == 6);
  const double expected = binary_entropy(50.5 / 101.0)         // cell 4: 50 hits of 100
                          + 3.0 * binary_entropy(0.5 / 101.0)  // cells 1 to 3: free, seen by all
                          + 2.0 * binary_entropy(0.5 / 51.0);  // cells 0 and 5: seen by a half, which agrees
  CHECK(e.bits == doctest::Approx(expected));
  const MapEntropy perfect = entropy(log, standing(kScans, [](std::size_t) { return 0.0; }));
  CHECK(e.bits > 4.0 * perfect.bits);
}

TEST_CASE("beams that hit nothing draw nothing") {
  Log log = log_of(2);
  log.scans[1].ranges = {8.0F};
  const MapEntropy e = entropy(log, standing(2, [](std::size_t) { return 0.0; }));
  CHECK(e.bits == doctest::Approx(5.0 * binary_entropy(0.25)));
  log.scans[0].ranges = {8.0F};
  CHECK_THROWS_AS((void)entropy(log, standing(2, [](std::size_t) { return 0.0; })), std::invalid_argument);
}

TEST_CASE("the laser's place on the robot counts") {
  Log log = log_of(1);
  log.lasers[0].base_T_laser = {0.3, 0.0, kHalfPi};
  const DrawnMap map = draw_map(log, poses_of_scans(log, standing(1, [](std::size_t) { return 0.0; })), kCell);
  CHECK(map.counts.width() == 1);
  CHECK(map.counts.height() == 5);
  CHECK(map.origin_x == doctest::Approx(0.3));
  CHECK(map.origin_y == doctest::Approx(0.0));
  CHECK(map.counts.hits(4) == 1);
  const MapImage picture = picture_of(map);
  CHECK(*picture.grey.at(0, 0) == map_grey(0.75));  // the hit is at the top
  CHECK(*picture.grey.at(0, 4) == map_grey(0.25));
}

TEST_CASE("only scans that both have are compared, and the frame of the estimate does not matter") {
  const Log log = log_of(6);
  std::vector<StampedPose> truth;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto k = static_cast<double>(i);
    truth.push_back({"", k, {0.31 * k, 0.2 * k * k, 0.4 * k}});
  }
  std::vector<StampedPose> moved;
  for (const StampedPose& pose : truth) {
    moved.push_back({"", pose.seconds + 1e-3, compose({3.0, -20.0, 1.1}, pose.pose)});
  }
  moved.erase(moved.begin() + 2);
  truth.erase(truth.begin() + 4);
  std::vector<ScanPose> a = poses_of_scans(log, moved);
  std::vector<ScanPose> b = poses_of_scans(log, truth);
  CHECK(a.size() == 5);
  make_comparable(a, b);
  REQUIRE(a.size() == 4);
  REQUIRE(b.size() == 4);
  const std::size_t expected[] = {0, 1, 3, 5};
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(a[i].scan == expected[i]);
    CHECK(b[i].scan == expected[i]);
    const Pose2 off = between(b[i].map_T_base, a[i].map_T_base);
    CHECK(translation(off) < 1e-9);
    CHECK(std::fabs(off.theta) < 1e-9);
  }
}

TEST_CASE("poses farther than the pairing tolerance belong to no scan") {
  const Log log = log_of(3);
  std::vector<StampedPose> late = standing(3, [](std::size_t) { return 0.0; });
  for (StampedPose& pose : late) {
    pose.seconds += 2e-3;
  }
  CHECK(poses_of_scans(log, late).empty());
  std::vector<ScanPose> a;
  std::vector<ScanPose> b = poses_of_scans(log, standing(3, [](std::size_t) { return 0.0; }));
  make_comparable(a, b);
  CHECK(a.empty());
  CHECK(b.empty());
}
