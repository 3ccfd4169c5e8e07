// How exact a registered pose is: what each peak fit leans to, and whether the covariance says so.
#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <vector>

#include "mellin/spectral/matcher.hpp"
#include "tests/support/matcher_bench.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

constexpr double kSpan = 38.4;  // of the grids, m

/// `walls` from `pose` at `side` pixels, from a grid of 384 cells.
Picture look(const std::vector<Wall>& walls, const Pose2& pose, std::uint16_t side) {
  return digest_of(render(walls, pose, 384, kSpan / 384, 17.0), 384, side);
}

std::vector<Wall> without(std::vector<Wall> walls, double share, Random& random) {
  walls.erase(std::remove_if(walls.begin(), walls.end(), [&](const Wall&) { return random.uniform() < share; }),
              walls.end());
  return walls;
}

MatcherConfig with_fit(std::uint16_t side, PeakFit fit, int com_radius) {
  MatcherConfig config = config_of(side, static_cast<float>(kSpan / side));
  config.peak_fit = fit;
  config.com_radius = static_cast<std::uint8_t>(com_radius);
  return config;
}

struct FitError {
  double pixels = 0.0;  // root mean square along an axis
  double bins = 0.0;
};

/// Over shifts and rotations by eighths of a pixel and of an angular bin.
FitError fit_error(PeakFit fit, int com_radius) {
  const std::uint16_t side = 96;
  Bench bench(with_fit(side, fit, com_radius));
  const double pixel = kSpan / side;
  const double bin = kPi / side;
  FitError error;
  const int trials = test::trials(48);
  for (int i = 0; i < trials; ++i) {
    const std::vector<Wall> walls = office(static_cast<std::uint64_t>(i) / 8);
    const double part = (i % 8) / 8.0;
    const Pose2 shift{pixel * (1.0 + part), -pixel * (2.0 + part), 0.0};
    const Pose2 turn{0.0, 0.0, bin * (20.0 + part)};
    const Picture a = look(walls, {}, side);
    const Pose2 shifted = bench.match(a, look(walls, shift, side))[0].a_T_b;
    const Pose2 turned = bench.match(a, look(walls, turn, side))[0].a_T_b;
    error.pixels += 0.5 * std::pow(error_of(shifted, shift).metres / pixel, 2) / trials;
    error.bins += std::pow(error_of(turned, turn).radians / bin, 2) / trials;
  }
  return {std::sqrt(error.pixels), std::sqrt(error.bins)};
}

struct Calibration {
  double place = 0.0;  // mean squared error over its variance, an axis
  double angle = 0.0;
};

/// Offices of which each view lacks other walls.
Calibration calibration(const MatcherConfig& config, double missing) {
  Bench bench(config);
  Random random(3, 0);
  Calibration sum;
  int count = 0;
  for (int i = 0; i < test::trials(40); ++i) {
    const std::vector<Wall> walls = office(static_cast<std::uint64_t>(i));
    const Pose2 truth{4.0 * random.uniform() - 2.0, 4.0 * random.uniform() - 2.0, kTwoPi * random.uniform()};
    const Picture a = look(without(walls, missing, random), {}, config.side);
    const Picture b = look(without(walls, missing, random), truth, config.side);
    const HypothesisList found = bench.match(a, b);
    if (found.empty() || error_of(found[0].a_T_b, truth).metres > 1.0) {
      continue;  // a wrong match: no covariance covers that
    }
    const Hypothesis& h = found[0];
    const PeakCovariance& c = h.covariance;
    const double x = h.a_T_b.x - truth.x;
    const double y = h.a_T_b.y - truth.y;
    const double theta = wrap_angle(h.a_T_b.theta - truth.theta);
    const double xx = static_cast<double>(c.xx);
    const double xy = static_cast<double>(c.xy);
    const double yy = static_cast<double>(c.yy);
    sum.place += 0.5 * (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy);
    sum.angle += theta * theta / static_cast<double>(c.tt);
    ++count;
  }
  CHECK(count * 10 >= test::trials(40) * 9);
  return {sum.place / count, sum.angle / count};
}

}  // namespace

TEST_SUITE("matcher_covariance") {
  TEST_CASE("between pixels the Gaussian leans least, and any fit beats none") {
    const FitError none = fit_error(PeakFit::centre_of_mass, 0);
    const FitError com1 = fit_error(PeakFit::centre_of_mass, 1);
    const FitError com2 = fit_error(PeakFit::centre_of_mass, 2);
    const FitError gaussian = fit_error(PeakFit::gaussian, 1);
    const auto show = [](const char* name, const FitError& error) {
      MESSAGE(std::string(name) << ": " << error.pixels << " pixels, " << error.bins << " bins");
    };
    show("CoM0", none);
    show("CoM1", com1);
    show("CoM2", com2);
    show("Gaussian", gaussian);
    // Without a fit the error is that of rounding to whole numbers: 1 / sqrt(12), as eighths have it.
    const double rounding = std::sqrt((2 * (1.0 + 4.0 + 9.0) + 16.0) / 64.0 / 8.0);
    CHECK(none.pixels == doctest::Approx(rounding).epsilon(0.1));
    CHECK(none.bins == doctest::Approx(rounding).epsilon(0.1));
    CHECK(com1.pixels < 0.6 * none.pixels);
    CHECK(com1.bins < none.bins);
    CHECK(gaussian.pixels < 0.8 * com1.pixels);
    CHECK(gaussian.bins < 0.5 * com2.bins);
  }

  TEST_CASE("squared errors are between a tenth and twice their variances") {
    for (const std::uint16_t side : std::initializer_list<std::uint16_t>{96, 192}) {
      for (const PeakFit fit : {PeakFit::centre_of_mass, PeakFit::gaussian}) {
        for (const double missing : {0.0, 0.3, 0.5}) {
          const MatcherConfig config = with_fit(side, fit, 1);
          const Calibration found = calibration(config, missing);
          CAPTURE(side);
          CAPTURE(static_cast<int>(fit));
          CAPTURE(missing);
          CHECK(found.place > 0.1);
          CHECK(found.place < 2.0);
          CHECK(found.angle > 0.1);
          CHECK(found.angle < 2.0);
        }
      }
    }
  }

  TEST_CASE("polar filters and masks have theirs") {
    for (const bool masked : {false, true}) {
      for (const RotationMode mode : {RotationMode::rings, RotationMode::linear_polar, RotationMode::log_polar}) {
        MatcherConfig config = with_fit(96, PeakFit::gaussian, 1);
        config.rotation = mode;
        config.masked = masked;
        const Calibration found = calibration(config, 0.3);
        CAPTURE(masked);
        CAPTURE(static_cast<int>(mode));
        MESSAGE(found.place << " " << found.angle);
        CHECK(found.place > 0.1);
        CHECK(found.place < 2.0);
        CHECK(found.angle > 0.1);
        CHECK(found.angle < 2.0);
      }
    }
  }

  TEST_CASE("the variance does not depend on how many more peaks are asked for") {
    const std::vector<Wall> walls = office(7);
    const Picture a = look(walls, {}, 96);
    Random random(5, 0);
    const Picture b = look(without(walls, 0.3, random), {0.7, -0.5, 0.6}, 96);
    MatcherConfig config = with_fit(96, PeakFit::gaussian, 1);
    const PeakCovariance one = Bench(config).match(a, b)[0].covariance;
    config.translation_peaks = 4;
    const PeakCovariance four = Bench(config).match(a, b)[0].covariance;
    CHECK(four.xx == doctest::Approx(one.xx));
    CHECK(four.xy == doctest::Approx(one.xy));
    CHECK(four.yy == doctest::Approx(one.yy));
  }

  TEST_CASE("more differences, more variance") {
    const MatcherConfig config = with_fit(96, PeakFit::gaussian, 1);
    Bench bench(config);
    const std::vector<Wall> walls = office(7);
    const Picture a = look(walls, {}, 96);
    const Pose2 pose{0.7, -0.5, 0.6};
    Random random(5, 0);
    const PeakCovariance same = bench.match(a, look(walls, pose, 96))[0].covariance;
    const PeakCovariance half = bench.match(a, look(without(walls, 0.5, random), pose, 96))[0].covariance;
    CHECK(half.xx + half.yy > same.xx + same.yy);
    CHECK(half.tt > same.tt);
  }

  TEST_CASE("along a corridor the place is worse known than across, however the corridor lies") {
    Bench bench(with_fit(96, PeakFit::gaussian, 1));
    const std::vector<Wall> corridor = {
        {-40.0, 1.5, 40.0, 1.5}, {-40.0, -1.2, 40.0, -1.2}, {4.0, 1.5, 4.0, 2.4}, {-6.0, -1.2, -6.0, -1.7}};
    // A door is shut and a cabinet has come: what differs is noise.
    std::vector<Wall> changed = corridor;
    changed[3] = {-6.3, -1.2, -6.3, -0.9};
    changed.push_back({9.0, 1.5, 9.0, 0.9});
    for (const double angle : {0.0, 0.5, 1.2}) {
      CAPTURE(angle);
      const Picture a = look(corridor, {0.0, 0.0, -angle}, 96);
      const Picture b = look(changed, compose({0.0, 0.0, -angle}, {0.3, 0.2, 0.0}), 96);
      const HypothesisList found = bench.match(a, b);
      REQUIRE_FALSE(found.empty());
      const PeakCovariance& m = found[0].covariance;
      const auto along = [&](double direction) {
        const double c = std::cos(direction);
        const double s = std::sin(direction);
        return static_cast<double>(m.xx) * c * c + 2.0 * static_cast<double>(m.xy) * c * s +
               static_cast<double>(m.yy) * s * s;
      };
      CHECK(along(angle) > 1.5 * along(angle + kHalfPi));
    }
  }
}
