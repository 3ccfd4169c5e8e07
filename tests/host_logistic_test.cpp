// Logistic regression and reliability against what mathematics says they must be.
#include <doctest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "host/logistic.hpp"

using namespace mellin::host;

TEST_SUITE("host_logistic") {
  TEST_CASE("with an intercept alone the probability is the share of right ones") {
    std::vector<Judged> samples(10, {{1.0}, false});
    for (std::size_t i = 0; i < 3; ++i) {
      samples[i].right = true;
    }
    const std::vector<double> weights = fit_logistic(samples, {-1e9});
    CHECK(weights[0] == doctest::Approx(std::log(0.3 / 0.7)));
  }

  TEST_CASE("a yes-or-no term: the weights are the differences of the log odds") {
    // 1 of 4 is right without it, 3 of 4 with it.
    std::vector<Judged> samples;
    for (int i = 0; i < 4; ++i) {
      samples.push_back({{1.0, 0.0}, i == 0});
      samples.push_back({{1.0, 1.0}, i != 0});
    }
    const std::vector<double> weights = fit_logistic(samples, {-1e9, 0.0}, 0.0);
    CHECK(weights[0] == doctest::Approx(-std::log(3.0)).epsilon(1e-5));
    CHECK(weights[1] == doctest::Approx(2.0 * std::log(3.0)).epsilon(1e-5));
    SUBCASE("held at its least value, the intercept fits what is left") {
      const std::vector<double> held = fit_logistic(samples, {-1e9, 5.0}, 0.0);
      CHECK(held[1] == 5.0);
      // The sum of the probabilities is the number of right ones: 4 p(0) + 4 p(5) = 4.
      const auto p = [&](double x) { return 1.0 / (1.0 + std::exp(-(held[0] + x))); };
      CHECK(4.0 * p(0.0) + 4.0 * p(5.0) == doctest::Approx(4.0));
    }
    SUBCASE("a term that speaks against may not") {
      for (Judged& sample : samples) {
        sample.right = !sample.right;
      }
      const std::vector<double> none = fit_logistic(samples, {-1e9, 0.0}, 0.0);
      CHECK(none[1] == 0.0);
      CHECK(none[0] == doctest::Approx(0.0));
    }
  }

  TEST_CASE("known weights come back from what they generate") {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    std::vector<Judged> samples;
    for (int i = 0; i < 40000; ++i) {
      const double x = normal(random);
      const double y = normal(random);
      const double p = 1.0 / (1.0 + std::exp(-(-1.0 + 2.0 * x + 0.5 * y)));
      samples.push_back({{1.0, x, y}, uniform(random) < p});
    }
    const std::vector<double> weights = fit_logistic(samples, {-1e9, 0.0, 0.0}, 0.0);
    CHECK(weights[0] == doctest::Approx(-1.0).epsilon(0.05));
    CHECK(weights[1] == doctest::Approx(2.0).epsilon(0.05));
    CHECK(weights[2] == doctest::Approx(0.5).epsilon(0.1));
  }

  TEST_CASE("one kind of samples, or terms of different number, are refused") {
    CHECK_THROWS_AS(fit_logistic({{{1.0}, true}}, {0.0}), std::invalid_argument);
    CHECK_THROWS_AS(fit_logistic({{{1.0}, true}, {{1.0, 2.0}, false}}, {0.0}), std::invalid_argument);
  }

  TEST_CASE("reliability: bins, calibration error, Brier score by hand") {
    const std::vector<Stated> stated = {{0.05, false}, {0.15, true}, {0.95, true}, {1.0, true}};
    const std::vector<ReliabilityBin> bins = reliability(stated, 10);
    REQUIRE(bins.size() == 10);
    CHECK(bins[0].count == 1);
    CHECK(bins[1].observed == 1.0);
    CHECK(bins[9].count == 2);
    CHECK(bins[9].stated == doctest::Approx(0.975));
    CHECK(calibration_error(bins) == doctest::Approx((0.05 + 0.85 + 2 * 0.025) / 4));
    CHECK(brier_score(stated) == doctest::Approx((0.0025 + 0.7225 + 0.0025) / 4));
  }
}
