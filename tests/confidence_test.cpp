// The probability that a registered pose is right.
#include "mellin/spectral/confidence.hpp"

#include <doctest.h>

#include <cmath>
#include <initializer_list>
#include <limits>

using namespace mellin;

namespace {

PoseEvidence middling() {
  PoseEvidence evidence;
  evidence.agreement = 0.8F;
  evidence.inlier_share = 0.9F;
  evidence.overlap = 0.4F;
  evidence.peak = 0.1F;
  evidence.rival_strength = 0.6F;
  evidence.rival_peak = 0.08F;
  return evidence;
}

}  // namespace

TEST_SUITE("confidence") {
  TEST_CASE("the terms are what they are said to be") {
    float terms[ConfidenceModel::kWeights];
    confidence_terms(middling(), terms);
    CHECK(terms[0] == 1.0F);
    CHECK(terms[1] == doctest::Approx(std::log(4.0)));
    CHECK(terms[2] == doctest::Approx(std::log(9.0)));
    CHECK(terms[3] == doctest::Approx(std::log(0.1)));
    CHECK(terms[4] == doctest::Approx(std::sqrt(0.4)));
    CHECK(terms[5] == doctest::Approx(0.12));
    CHECK(terms[6] == doctest::Approx(std::log(1.25)));
  }

  TEST_CASE("it is the logistic function of the weighted terms") {
    ConfidenceModel model;
    for (float& weight : model.weights) {
      weight = 0.0F;
    }
    CHECK(confidence(middling(), model) == doctest::Approx(0.5));
    model.weights[0] = 1.0F;
    CHECK(confidence(middling(), model) == doctest::Approx(1.0 / (1.0 + std::exp(-1.0))));
    model.weights[1] = 2.0F;  // odds times 4^2
    CHECK(confidence(middling(), model) == doctest::Approx(1.0 / (1.0 + std::exp(-1.0) / 16.0)));
  }

  TEST_CASE("it never falls where the evidence grows, and a stronger rival never raises it") {
    const float base = confidence(middling());
    CHECK(base > 0.01F);
    CHECK(base < 0.99F);
    const auto with = [](float PoseEvidence::*field, float value) {
      PoseEvidence evidence = middling();
      evidence.*field = value;
      return confidence(evidence);
    };
    CHECK(with(&PoseEvidence::agreement, 0.9F) > base);
    CHECK(with(&PoseEvidence::inlier_share, 0.95F) > base);
    CHECK(with(&PoseEvidence::overlap, 0.6F) > base);
    CHECK(with(&PoseEvidence::peak, 0.2F) > base);
    CHECK(with(&PoseEvidence::rival_strength, 0.7F) < base);
    CHECK(with(&PoseEvidence::rival_peak, 0.1F) < base);
  }

  TEST_CASE("nonsense is no evidence, and gives a number") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    for (float PoseEvidence::*field : {&PoseEvidence::agreement, &PoseEvidence::inlier_share, &PoseEvidence::overlap,
                                       &PoseEvidence::peak, &PoseEvidence::rival_strength, &PoseEvidence::rival_peak}) {
      for (const float value : {nan, infinity, -infinity, -1.0F, 1e30F}) {
        PoseEvidence evidence = middling();
        evidence.*field = value;
        const float found = confidence(evidence);
        CHECK(found >= 0.0F);
        CHECK(found <= 1.0F);
        if (std::isnan(value)) {
          CHECK(found <= confidence(middling()));
        }
      }
    }
    CHECK(confidence({}) < 0.01F);
  }

  TEST_CASE("of rivals that exclude each other, one is right at most") {
    // Bayes: with odds of 9, 4 and 1 (90, 80 and 50 %) against none of them, the shares are 9, 4, 1 and 1 of 15.
    const float odds_of[] = {odds(0.9F), odds(0.8F), odds(0.5F)};
    CHECK(odds_of[0] == doctest::Approx(9.0));
    CHECK(beside_rivals(0.9F, odds_of[1] + odds_of[2]) == doctest::Approx(9.0 / 15.0));
    CHECK(beside_rivals(0.8F, odds_of[0] + odds_of[2]) == doctest::Approx(4.0 / 15.0));
    CHECK(beside_rivals(0.5F, odds_of[0] + odds_of[1]) == doctest::Approx(1.0 / 15.0));
    CHECK(beside_rivals(0.7F, 0.0F) == doctest::Approx(0.7));
    CHECK(beside_rivals(1.0F, odds(1.0F)) <= 0.5F);
    CHECK(beside_rivals(0.0F, 0.0F) == 0.0F);
  }
}
