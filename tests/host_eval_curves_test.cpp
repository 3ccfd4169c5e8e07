// Curves of the evaluation on examples small enough to be worked out by hand.
#include <doctest.h>

#include "host/eval_curves.hpp"

using namespace mellin::host;

namespace {

Decision decision(double score, bool positive) { return {score, positive, positive}; }

/// By falling score: right, wrong, right, right, wrong.
std::vector<Decision> five() {
  return {decision(0.2, false), decision(0.9, true), decision(0.5, true), decision(0.8, false), decision(0.6, true)};
}

}  // namespace

TEST_SUITE("host_eval_curves") {
  TEST_CASE("precision and recall by falling score") {
    const std::vector<PrecisionRecall> curve = precision_recall(five());
    REQUIRE(curve.size() == 5);
    const double precision[] = {1.0, 1.0 / 2, 2.0 / 3, 3.0 / 4, 3.0 / 5};
    const double recall[] = {1.0 / 3, 1.0 / 3, 2.0 / 3, 1.0, 1.0};
    const double threshold[] = {0.9, 0.8, 0.6, 0.5, 0.2};
    for (std::size_t i = 0; i < 5; ++i) {
      CAPTURE(i);
      CHECK(curve[i].precision == doctest::Approx(precision[i]));
      CHECK(curve[i].recall == doctest::Approx(recall[i]));
      CHECK(curve[i].threshold == threshold[i]);
    }
    CHECK(average_precision(curve) == doctest::Approx((1.0 + 2.0 / 3 + 3.0 / 4) / 3));
    CHECK(recall_at_precision(curve, 0.99) == doctest::Approx(1.0 / 3));
    CHECK(recall_at_precision(curve, 0.7) == doctest::Approx(1.0));
    CHECK(best_f1(curve) == doctest::Approx(2 * 0.75 / 1.75));
  }

  TEST_CASE("equal scores are one point, whatever their order") {
    for (const bool right_first : {true, false}) {
      const std::vector<PrecisionRecall> curve =
          precision_recall({decision(0.5, right_first), decision(0.5, !right_first), decision(0.1, true)});
      REQUIRE(curve.size() == 2);
      CHECK(curve[0].precision == doctest::Approx(0.5));
      CHECK(average_precision(curve) == doctest::Approx(0.5 * 0.5 + 0.5 * 2.0 / 3));
    }
  }

  TEST_CASE("a weight counts like so many equal pairs") {
    std::vector<Decision> repeated = five();
    std::vector<Decision> weighted = five();
    weighted[3].weight = 3.0;
    repeated.insert(repeated.end(), 2, repeated[3]);
    CHECK(average_precision(precision_recall(weighted)) ==
          doctest::Approx(average_precision(precision_recall(repeated))));
    CHECK(average_precision(precision_recall(weighted)) < average_precision(precision_recall(five())));
  }

  TEST_CASE("a yes that was not asked for is no mistake where it is right, and adds nothing to recall") {
    const std::vector<PrecisionRecall> curve =
        precision_recall({{0.9, false, true}, {0.8, true, true}, {0.7, true, false}});
    CHECK(curve[0].precision == 1.0);
    CHECK(curve[0].recall == 0.0);
    CHECK(curve[1].recall == doctest::Approx(0.5));
    CHECK(curve[2].precision == doctest::Approx(2.0 / 3));
    CHECK(curve[2].recall == doctest::Approx(0.5));  // accepted, but not right
  }

  TEST_CASE("nothing wanted, or nothing at all") {
    CHECK(precision_recall({}).empty());
    CHECK(precision_recall({decision(0.3, false)}).empty());
    CHECK(average_precision({}) == 0.0);
    CHECK(recall_at_precision({}, 0.9) == 0.0);
    CHECK(best_f1({}) == 0.0);
    CHECK(pose_errors({}).empty());
    CHECK_FALSE(acceptance_threshold({}).has_value());
  }

  TEST_CASE("pose errors, the acceptance threshold and what it does elsewhere") {
    // Score, wanted, metres, degrees. Wrong by distance at 0.4, by angle at 0.3.
    const std::vector<PoseDecision> poses{
        {0.9, true, 0.1, 1.0}, {0.8, true, 0.3, 0.5}, {0.6, false, 0.2, 3.9},
        {0.5, true, 0.4, 2.0}, {0.4, true, 7.0, 2.0}, {0.3, true, 0.1, 180.0},
    };
    const std::vector<PoseErrors> curve = pose_errors(poses);
    REQUIRE(curve.size() == 6);
    CHECK(curve[0].recall == doctest::Approx(0.2));
    CHECK(curve[2].recall == doctest::Approx(0.4));
    CHECK(curve[2].median_m == 0.2);
    CHECK(curve[2].max_deg == 3.9);
    CHECK(curve[4].max_m == 7.0);
    CHECK(curve[5].max_deg == 180.0);
    CHECK(curve[5].recall == 1.0);

    CHECK(acceptance_threshold(poses) == 0.5);
    CHECK(acceptance_threshold(poses, {10.0, 4.0}) == 0.4);
    CHECK(acceptance_threshold(poses, {10.0, 181.0}) == 0.3);
    CHECK_FALSE(acceptance_threshold(poses, {0.05, 4.0}).has_value());

    const Held held = hold_threshold(poses, 0.35);
    CHECK(held.accepted == 5);
    CHECK(held.wrong == 1);
    CHECK(held.errors.recall == doctest::Approx(0.8));
    CHECK(held.errors.max_m == 7.0);
    CHECK(held.errors.median_m == 0.3);
    CHECK(hold_threshold(poses, 2.0).accepted == 0);
  }

  TEST_CASE("a wrong pose with the score of a right one keeps both out") {
    CHECK(acceptance_threshold({{0.9, true, 0.1, 0.1}, {0.5, true, 0.1, 0.1}, {0.5, true, 9.0, 0.1}}) == 0.9);
  }

  TEST_CASE("quantile and line") {
    CHECK(quantile({{3.0}, {1.0}, {2.0}}, 0.5) == 2.0);
    CHECK(quantile({{3.0, 8.0}, {1.0, 1.0}, {2.0, 1.0}}, 0.1) == 1.0);
    CHECK(quantile({{3.0, 8.0}, {1.0, 1.0}, {2.0, 1.0}}, 0.3) == 3.0);
    CHECK(quantile({{4.0}}, 1.0) == 4.0);
    const Line line = fit_line({0, 1, 2}, {1, 3, 8});  // slope 3.5, through the mean (1, 4)
    CHECK(line.slope == doctest::Approx(3.5));
    CHECK(line.intercept == doctest::Approx(0.5));
  }
}
