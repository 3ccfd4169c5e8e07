// Submaps of the evaluation: true poses, areas and pairs, on poses whose answers are known and on a simulated drive.
#include <doctest.h>

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "host/eval_submaps.hpp"
#include "host/parallel.hpp"
#include "mellin/core/random.hpp"
#include "tests/support/simulated_log.hpp"

using namespace mellin;
using namespace mellin::host;

namespace {

/// A scan in a round room of radius `range_m` whose beams point all round.
LiveScan round_scan(const Pose2& live, const Pose2& truth, float range_m) {
  LiveScan scan;
  scan.session_T_base = live;
  scan.truth_T_base = truth;
  scan.scan = {{}, std::vector<float>(720, range_m), -kPi, kTwoPi / 720.0, 30.0};
  return scan;
}

/// Two submaps of one scan each, of different drives.
std::vector<LiveDrive> two_rooms(double apart_m, float range_a_m, float range_b_m) {
  return {{"a", {round_scan({}, {}, range_a_m)}}, {"b", {round_scan({5, 5, 1}, {apart_m, 0, 0.5}, range_b_m)}}};
}

SubmapOptions one_scan() {
  SubmapOptions options;
  options.scans = 1;
  options.every = 1;
  options.side = 384;
  options.area_cell_m = 0.1;
  return options;
}

/// Area that two discs of one radius share, over the area of one.
double lens(double apart, double radius) {
  const double half = apart / (2.0 * radius);
  return (2.0 * std::acos(half) - 2.0 * half * std::sqrt(1.0 - half * half)) / kPi;
}

}  // namespace

TEST_SUITE("host_eval_submaps") {
  TEST_CASE("the truth of a live pose is blended between its neighbours in time") {
    const std::vector<StampedPose> live{{"0", 0.0, {0, 0, 0}}, {"1", 1.0, {1, 0, 0}}, {"2", 2.0, {2, 0, 0}}};
    // The truth is turned by a right angle at the first pose, and a metre farther along its y at the last.
    const std::vector<StampedPose> truth{{"0", 0.0, {10, 0, kHalfPi}}, {"2", 2.0, {10, 3, kHalfPi}}};
    const TruthOfLive of(live, truth);
    Pose2 found;
    REQUIRE(of.correct(1.0, {1, 0, 0}, found));
    CHECK(found.x == doctest::Approx(10.0));
    CHECK(found.y == doctest::Approx(1.5));  // 1 by the first pose, 2 by the last
    CHECK(found.theta == doctest::Approx(kHalfPi));
    REQUIRE(of.correct(0.5, {0.5, 0, 0.1}, found));
    CHECK(found.y == doctest::Approx(0.75 * 0.5 + 0.25 * 1.5));
    CHECK(found.theta == doctest::Approx(kHalfPi + 0.1));
    REQUIRE(of.correct(3.0, {3, 0, 0}, found));  // behind the last: carried by it alone
    CHECK(found.y == doctest::Approx(4.0));
    CHECK_FALSE(of.correct(9.0, {2.0 + 1.1 * kTruthReach_m, 0, 0}, found));
  }

  TEST_CASE("overlap of round rooms is that of discs, over the smaller and over both") {
    for (const double apart : {0.0, 3.0, 6.0, 20.0}) {
      CAPTURE(apart);
      const std::vector<EvalSubmap> submaps = make_submaps(two_rooms(apart, 5.0F, 5.0F), one_scan());
      const std::vector<EvalPair> pairs = make_pairs(submaps);
      REQUIRE(pairs.size() == 1);
      const double expected = apart < 10.0 ? lens(apart, 5.0) : 0.0;
      CHECK(std::fabs(pairs[0].overlap - expected) < 0.02);
      CHECK(std::fabs(pairs[0].union_overlap - expected / (2.0 - expected)) < 0.02);
      // The true pose does not depend on where the session's frame lies: rooms `apart`, turned by their orientations.
      const Pose2 off = between(compose(submaps[0].truth_T_submap, pairs[0].a_T_b), submaps[1].truth_T_submap);
      CHECK(translation(off) < 1e-9);
      CHECK(translation(pairs[0].a_T_b) == doctest::Approx(apart));
    }
    // A small room in a large one: wholly in the smaller, an eighth of both.
    const std::vector<EvalPair> inside =
        make_pairs(make_submaps(two_rooms(1.0, 8.0F, 8.0F / std::sqrt(8.0F)), one_scan()));
    CHECK(inside[0].overlap > 0.99);
    CHECK(std::fabs(inside[0].union_overlap - 0.125) < 0.01);
  }

  TEST_CASE("what lies beyond a submap's grid is no part of its area") {
    SubmapOptions options = one_scan();
    options.frames = SubmapFrames::aligned;
    options.side = 128;  // 6.4 m, in a room of 10 m across
    const std::vector<EvalSubmap> submaps = make_submaps(two_rooms(0.0, 5.0F, 5.0F), options);
    CHECK(std::fabs(static_cast<double>(submaps[0].area.cells) * 0.01 - 6.4 * 6.4) < 1.5);
  }

  TEST_CASE("a submap's true pose is the rigid fit, headings of the frames as asked, pairs share no scan") {
    // Live poses along a line, the truth the same line moved rigidly; a drift that is symmetric must not matter.
    const Pose2 truth_T_session{3, -2, 0.7};
    LiveDrive drive;
    for (int i = 0; i < 12; ++i) {
      const double side = i % 4 == 0 || i % 4 == 3 ? 0.05 : -0.05;
      const Pose2 true_pose = compose(truth_T_session, {0.5 * i, 0, 0});
      drive.scans.push_back(round_scan({0.5 * i, side, 0}, true_pose, 4.0F));
    }
    SubmapOptions options = one_scan();
    options.scans = 4;
    options.every = 1;
    options.frames = SubmapFrames::aligned;
    const std::vector<EvalSubmap> aligned = make_submaps({drive}, options);
    REQUIRE(aligned.size() == 9);
    for (const EvalSubmap& submap : aligned) {
      CHECK(submap.grid.world_T_submap.theta == 0.0);
    }
    const Pose2 off = between(compose(truth_T_session, aligned[0].grid.world_T_submap), aligned[0].truth_T_submap);
    CHECK(translation(off) < 1e-9);
    CHECK(std::fabs(off.theta) < 1e-9);

    const std::vector<EvalPair> pairs = make_pairs(aligned);
    std::size_t expected = 0;
    for (int a = 0; a < 9; ++a) {
      expected += static_cast<std::size_t>(std::max(0, 9 - (a + 4)));
    }
    CHECK(pairs.size() == expected);
    for (const EvalPair& pair : pairs) {
      CHECK(pair.b >= pair.a + 4);
    }
    CHECK(make_pairs(aligned, PairChoice::between_sessions).empty());

    options.frames = SubmapFrames::random;
    const std::vector<EvalSubmap> turned = make_submaps({drive}, options);
    const std::vector<EvalSubmap> again = make_submaps({drive}, options, 3);
    double spread = 0.0;
    for (std::size_t i = 0; i < turned.size(); ++i) {
      spread += std::fabs(turned[i].grid.world_T_submap.theta) / static_cast<double>(turned.size());
      CHECK(turned[i].grid.cells == again[i].grid.cells);
      CHECK(turned[i].area.bits == again[i].area.bits);
    }
    CHECK(spread > 0.5);

    drive.scans[6].stretch = 1;  // a break: three submaps of four scans cross it on each side
    for (std::size_t i = 7; i < 12; ++i) {
      drive.scans[i].stretch = 1;
    }
    CHECK(make_submaps({drive}, options).size() == 6);
  }

  TEST_CASE("a simulated drive: scans are taken as the paper takes them and lie where they truly were") {
    SimOptions sim;
    sim.loops = 1;
    const test::SimulatedLog simulated = test::simulated_log(sim, 0, test::kSanitized ? 120 : 400);
    const LiveDrive drive = drive_live(simulated.log, simulated.truth);
    REQUIRE(drive.scans.size() > 20);
    for (std::size_t i = 1; i < drive.scans.size(); ++i) {
      const Pose2 step = between(drive.scans[i - 1].truth_T_base, drive.scans[i].truth_T_base);
      CHECK(translation(step) < 0.9);
      CHECK((translation(step) > 0.35 || std::fabs(step.theta) > 0.35));
    }
    std::size_t next = 0;
    for (const LiveScan& scan : drive.scans) {
      while (simulated.truth[next].seconds < scan.seconds) {
        ++next;
      }
      CHECK(translation(between(simulated.truth[next].pose, scan.truth_T_base)) < 1e-9);
    }
    CHECK_THROWS_AS(drive_live(simulated.log, {{"1e9", 1e9, {}}}), std::runtime_error);
  }

  TEST_CASE("in_parallel does each job once, whatever the number of threads, and hands on an exception") {
    for (const std::size_t threads : {1U, 2U, 5U}) {
      std::vector<int> done(100);
      in_parallel(threads, done.size(), [&](std::size_t worker, std::size_t i) {
        REQUIRE(worker < threads);
        done[i] += static_cast<int>(i) + 1;
      });
      CHECK(std::accumulate(done.begin(), done.end(), 0) == 5050);
      CHECK_THROWS_WITH_AS(
          in_parallel(threads, 10,
                      [](std::size_t, std::size_t i) { i == 7 ? throw std::runtime_error("seven") : void(); }),
          "seven", std::runtime_error);
    }
  }
}
