// Matching of many pairs for the evaluation: on a simulated building with exact truth, and on poses made by hand.
#include <doctest.h>

#include <cmath>
#include <set>

#include "host/eval_matching.hpp"
#include "mellin/config.hpp"
#include "tests/support/simulated_log.hpp"

using namespace mellin;
using namespace mellin::host;

namespace {

/// A drive through simulated offices, which unlike the ring's bends look different everywhere.
const std::vector<EvalSubmap>& submaps() {
  static const std::vector<EvalSubmap> made = [] {
    const SimOptions sim = options_for(SimKind::offices);
    const test::SimulatedLog log = test::simulated_log(sim, 0);
    SubmapOptions options;
    options.every = 20;
    return make_submaps({drive_live(log.log, log.truth)}, options, 2);
  }();
  return made;
}

const std::vector<EvalPair>& pairs() {
  static const std::vector<EvalPair> made = make_pairs(submaps());
  return made;
}

EvalPair pair_at(const Pose2& a_T_b, double overlap) {
  EvalPair pair;
  pair.a_T_b = a_T_b;
  pair.overlap = overlap;
  return pair;
}

bool equal(const std::vector<std::vector<FoundPose>>& p, const std::vector<std::vector<FoundPose>>& q) {
  bool same = p.size() == q.size();
  for (std::size_t i = 0; same && i < p.size(); ++i) {
    same = p[i].size() == q[i].size();
    for (std::size_t k = 0; same && k < p[i].size(); ++k) {
      const FoundPose& a = p[i][k];
      const FoundPose& b = q[i][k];
      same = a.a_T_b.x == b.a_T_b.x && a.a_T_b.y == b.a_T_b.y && a.a_T_b.theta == b.a_T_b.theta && a.peak == b.peak &&
             a.agreement == b.agreement;
    }
  }
  return same;
}

}  // namespace

TEST_SUITE("host_eval_matching") {
  TEST_CASE("overlapping pairs rank first, whatever the number of threads") {
    MatchVariant variant;
    variant.matcher.side = 96;
    const std::vector<std::vector<FoundPose>> found = match_pairs(submaps(), pairs(), variant, 1);
    CHECK(equal(found, match_pairs(submaps(), pairs(), variant, 3)));
    std::vector<Decision> decisions;
    double right = 0.0;
    double positives = 0.0;
    const std::vector<PoseDecision> poses = pose_decisions(pairs(), found, PairScore::peak);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const bool negative = pairs()[i].overlap <= kNegativeOverlap;
      if (poses[i].wanted || negative) {
        decisions.push_back({poses[i].score, poses[i].wanted, poses[i].wanted});
      }
      positives += poses[i].wanted ? 1.0 : 0.0;
      right += poses[i].wanted && PoseLimits{0.8, 6.0}.hold(poses[i]) ? 1.0 : 0.0;
    }
    REQUIRE(positives > 10);
    MESSAGE("average precision " << average_precision(precision_recall(decisions)) << ", right poses "
                                 << right / positives << " of " << positives << " in " << decisions.size());
    CHECK(average_precision(precision_recall(decisions)) > 0.9);
    CHECK(right / positives > 0.8);
  }

  TEST_CASE("the whole registration finds the true poses of pairs that overlap") {
    std::vector<EvalPair> positive;
    for (const EvalPair& pair : pairs()) {
      if (pair.overlap >= kPositiveOverlap && positive.size() < 12) {
        positive.push_back(pair);
      }
    }
    REQUIRE(positive.size() >= 5);
    const Config config = resolved(desktop_profile());
    const std::vector<std::vector<FoundPose>> found = register_pairs(submaps(), positive, config.registration, 1);
    CHECK(equal(found, register_pairs(submaps(), positive, config.registration, 2)));
    std::size_t right = 0;
    for (const PoseDecision& d : pose_decisions(positive, found, PairScore::agreement)) {
      right += PoseLimits{}.hold(d) ? 1U : 0U;
    }
    CHECK(right >= positive.size() - 1);
  }

  TEST_CASE("an empty submap matches nothing, and no pair is no work") {
    std::vector<EvalSubmap> two(2);
    for (EvalSubmap& submap : two) {
      submap.grid.side = 192;
      submap.grid.cell_m = 0.2F;
      submap.grid.cells.assign(std::size_t{192} * 192, kUnobserved);
    }
    MatchVariant variant;
    variant.matcher.side = 96;
    EvalPair pair;
    pair.b = 1;
    const std::vector<std::vector<FoundPose>> found = match_pairs(two, {pair}, variant, 1);
    REQUIRE(found.size() == 1);
    CHECK(found[0].empty());
    const std::vector<PoseDecision> decisions = pose_decisions({pair}, found, PairScore::peak);
    CHECK(decisions[0].score < 0.0);
    CHECK_FALSE(PoseLimits{}.hold(decisions[0]));
    CHECK(match_pairs(two, {}, variant, 1).empty());
  }

  TEST_CASE("the score decides which hypothesis counts, and errors are those of b's frame") {
    const std::vector<FoundPose> found{{{1, 0, 0}, 0.5, 0.2}, {{0, 2, 0.1}, 0.3, 0.7}};
    CHECK(deciding(found, PairScore::peak) == &found[0]);
    CHECK(deciding(found, PairScore::agreement) == &found[1]);
    CHECK(deciding({}, PairScore::peak) == nullptr);
    const PoseError error = pose_error(pair_at({3, 4, kHalfPi}, 1.0), {{0, 0, kPi}, 0, 0});
    CHECK(error.metres == doctest::Approx(5.0));
    CHECK(error.degrees == doctest::Approx(90.0));
  }

  TEST_CASE("wrong poses are named") {
    EvalSubmap corridor;  // 20 m long, along a line at 30 degrees
    corridor.grid.side = 400;
    corridor.grid.cell_m = 0.05F;
    corridor.grid.cells.assign(std::size_t{400} * 400, kUnobserved);
    for (int i = 0; i < 400 * 400; ++i) {
      const double x = i % 400 - 200.0;
      const double y = static_cast<double>(i / 400) - 200.0;
      if (std::fabs(-0.5 * x + std::sqrt(0.75) * y) < 20.0) {
        corridor.grid.cells[static_cast<std::size_t>(i)] = 0;
      }
    }
    const auto named = [&](const Pose2& found, double overlap = 0.6) {
      return confusion_of(pair_at({1, 1, 0.2}, overlap), corridor, {found, 0.5, 0.5});
    };
    CHECK(named({1, 1, 0.2 + kPi}) == Confusion::half_turn);
    CHECK(named({1, 1, 0.2 - kHalfPi}) == Confusion::quarter_turn);
    CHECK(named({1 + 3 * std::sqrt(0.75), 1 + 1.5, 0.2}) == Confusion::slid);
    CHECK(named({1 - 3 * std::sqrt(0.75), 1 - 1.5, 0.2}) == Confusion::slid);
    CHECK(named({1 - 1.5, 1 + 3 * std::sqrt(0.75), 0.2}) == Confusion::shifted);
    CHECK(named({1, 1, 1.0}) == Confusion::other);
    CHECK(named({1.5, 1.5, 0.3}) == Confusion::near);
    CHECK(named({1.5, 1.5, 0.2 + 10.0 * kPi / 180.0}) != Confusion::near);
    CHECK(named({1, 1, 0.2 + kPi}, 0.05) == Confusion::elsewhere);
    CHECK(std::string(to_string(Confusion::half_turn)) == "turned by 180 degrees");
  }

  TEST_CASE("a sample stands for all pairs: weights add up, strata are filled, seeds repeat") {
    std::vector<EvalPair> all;
    for (std::size_t i = 0; i < 300; ++i) {
      EvalPair pair = pair_at({}, i < 30 ? 0.5 : i < 230 ? 0.0 : 0.2);
      pair.a = i;
      all.push_back(pair);
    }
    const std::vector<EvalPair> sample = sample_pairs(all, 60, 7);
    CHECK(sample.size() == 60);
    double weight[3] = {};
    std::set<std::size_t> seen;
    for (const EvalPair& pair : sample) {
      weight[pair.overlap >= 0.4 ? 0 : pair.overlap <= 0.1 ? 1 : 2] += pair.weight;
      seen.insert(pair.a);
    }
    CHECK(seen.size() == 60);
    CHECK(weight[0] == doctest::Approx(30));
    CHECK(weight[1] == doctest::Approx(200));
    CHECK(weight[2] == doctest::Approx(70));
    const std::vector<EvalPair> again = sample_pairs(all, 60, 7);
    const std::vector<EvalPair> other = sample_pairs(all, 60, 8);
    std::size_t same = 0;
    std::size_t different = 0;
    for (std::size_t i = 0; i < 60; ++i) {
      same += again[i].a == sample[i].a ? 1U : 0U;
      different += other[i].a != sample[i].a ? 1U : 0U;
    }
    CHECK(same == 60);
    CHECK(different > 10);
    CHECK(sample_pairs(all, 0, 1).size() == 300);
    CHECK(sample_pairs(all, 1000, 1).size() == 300);
  }
}
