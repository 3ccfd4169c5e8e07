// The ways to find a rotation, each by itself: what the paper does, what it leaves open, and what this library does.
#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <vector>

#include "mellin/spectral/matcher.hpp"
#include "tests/support/matcher_bench.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

constexpr RotationMode kModes[] = {RotationMode::rings, RotationMode::linear_polar, RotationMode::log_polar,
                                   RotationMode::log_polar_scale};

/// A picture's value between pixels, 0 beyond the border, in double.
double sampled(const Picture& picture, std::size_t side, double x, double y) {
  const auto pixel = [&](double c, double r) {
    const auto last = static_cast<double>(side - 1);
    return c < 0.0 || r < 0.0 || c > last || r > last
               ? 0.0
               : static_cast<double>(picture[static_cast<std::size_t>(r) * side + static_cast<std::size_t>(c)]);
  };
  const double c = std::floor(x);
  const double r = std::floor(y);
  const double u = x - c;
  const double v = y - r;
  return (1 - v) * ((1 - u) * pixel(c, r) + u * pixel(c + 1, r)) +
         v * ((1 - u) * pixel(c, r + 1) + u * pixel(c + 1, r + 1));
}

/// `picture` enlarged and turned about its middle, or about a point `off_centre` pixels from it along both axes.
Picture turned(const Picture& picture, std::size_t side, double angle_rad, double scale = 1.0, double off_centre = 0) {
  Picture out(picture.size());
  const double centre = 0.5 * static_cast<double>(side - 1) + off_centre;
  const double c = std::cos(angle_rad) / scale;
  const double s = std::sin(angle_rad) / scale;
  for (std::size_t r = 0; r < side; ++r) {
    for (std::size_t k = 0; k < side; ++k) {
      const double x = static_cast<double>(k) - centre;
      const double y = static_cast<double>(r) - centre;
      out[r * side + k] = static_cast<std::uint8_t>(
          std::lround(sampled(picture, side, c * x + s * y + centre, -s * x + c * y + centre)));
    }
  }
  return out;
}

/// A triangle of one-pixel stroke.
Picture triangle(std::size_t side) {
  Picture picture(side * side, 0);
  const double n = static_cast<double>(side);
  const double corners[3][2] = {{0.2 * n, 0.25 * n}, {0.82 * n, 0.36 * n}, {0.41 * n, 0.8 * n}};
  for (int i = 0; i < 3; ++i) {
    const double* const from = corners[i];
    const double* const to = corners[(i + 1) % 3];
    const int points = static_cast<int>(std::max(std::fabs(to[0] - from[0]), std::fabs(to[1] - from[1])));
    for (int k = 0; k <= points; ++k) {
      const double t = static_cast<double>(k) / points;
      const auto x = static_cast<std::size_t>(std::lround(from[0] + t * (to[0] - from[0])));
      const auto y = static_cast<std::size_t>(std::lround(from[1] + t * (to[1] - from[1])));
      picture[y * side + x] = 255;
    }
  }
  return picture;
}

MatcherConfig with_mode(MatcherConfig config, RotationMode mode) {
  config.rotation = mode;
  return config;
}

/// An office seen from two places; pixels of 0.4 m.
struct Views {
  Picture a;
  Picture b;
};

Views views(std::uint64_t seed, const Pose2& a_T_b, std::uint16_t side, double noise = 0.0) {
  const auto grid = static_cast<std::uint16_t>(4 * side);
  const double cell = 38.4 / grid;
  Random random(seed, 9);
  const auto look = [&](const Pose2& pose) {
    std::vector<Wall> walls = office(seed);
    walls.erase(std::remove_if(walls.begin(), walls.end(), [&](const Wall&) { return random.uniform() < noise; }),
                walls.end());
    return digest_of(render(walls, pose, grid, cell, 17.0), grid, side);
  };
  return {look({}), look(a_T_b)};
}

double pixel_of(std::uint16_t side) { return 38.4 / side; }

}  // namespace

TEST_SUITE("matcher_modes") {
  TEST_CASE("Fig. 2: thin obstacles need the rotation between the bins") {
    const std::uint16_t side = 512;
    const Picture picture = triangle(side);
    const auto peak = [&](double degrees, std::uint8_t com_radius) {
      MatcherConfig config = with_mode(paper_matcher(side), RotationMode::log_polar);
      config.com_radius = com_radius;
      Bench bench(config);
      // About a point beside the middle: a shift comes with the turn, and both pictures are resampled.
      const Picture other = turned(picture, side, degrees * kPi / 180.0, 1.0, 20.0);
      const HypothesisList found = bench.match(other, picture);
      REQUIRE_FALSE(found.empty());
      return static_cast<double>(found[0].peak);
    };
    const double on_bin = peak(0.7, 0);
    const double between = peak(0.35, 0);
    const double refined = peak(0.35, 1);
    std::printf("Fig. 2: peak at 0.7 degrees %.3f, at 0.35 degrees %.3f, refined %.3f (the paper: .562, .263, .681)\n",
                on_bin, between, refined);
    CHECK(on_bin > 1.5 * between);
    CHECK(refined > 1.5 * between);
  }

  TEST_CASE("every mode finds rotations over the full circle and shifts, and back") {
    for (const RotationMode mode : kModes) {
      for (const HighPass high_pass : {HighPass::radius, HighPass::reddy}) {
        CAPTURE(static_cast<int>(mode));
        CAPTURE(static_cast<int>(high_pass));
        MatcherConfig config = with_mode(config_of(96, 0.4F), mode);
        config.high_pass = high_pass;
        Bench bench(config);
        Random random(21, static_cast<std::uint64_t>(mode));
        for (int i = 0; i < test::trials(24); ++i) {
          CAPTURE(i);
          const Pose2 a_T_b{6.0 * random.uniform() - 3.0, 6.0 * random.uniform() - 3.0,
                            wrap_angle((15.0 * i + 15.0 * random.uniform()) * kPi / 180.0)};
          const Views seen = views(static_cast<std::uint64_t>(i) / 4, a_T_b, 96);
          const HypothesisList found = bench.match(seen.a, seen.b);
          REQUIRE_FALSE(found.empty());
          CHECK(error_of(found[0].a_T_b, a_T_b).metres < 0.8);
          CHECK(error_of(found[0].a_T_b, a_T_b).radians < kTwoPi / 96);
          CHECK(std::fabs(found[0].scale - 1.0F) < 0.03F);
          const HypothesisList swapped = bench.match(seen.b, seen.a);
          REQUIRE_FALSE(swapped.empty());
          CHECK(error_of(inverse(swapped[0].a_T_b), found[0].a_T_b).metres < 0.4);
          CHECK(error_of(inverse(swapped[0].a_T_b), found[0].a_T_b).radians < kTwoPi / 96);
        }
      }
    }
  }

  TEST_CASE("every mode works at sides of any kind and with a fifth of the walls gone") {
    for (const RotationMode mode : kModes) {
      for (const std::uint16_t side : std::initializer_list<std::uint16_t>{48, 60, 96, 100, 192, 250}) {
        CAPTURE(static_cast<int>(mode));
        CAPTURE(side);
        Bench bench(with_mode(config_of(side, static_cast<float>(pixel_of(side))), mode));
        const Pose2 a_T_b{1.1, -0.7, 2.2};
        const Views seen = views(side, a_T_b, side, 0.2);
        const HypothesisList found = bench.match(seen.a, seen.b);
        bool among = false;
        for (const Hypothesis& h : found) {
          const Error error = error_of(h.a_T_b, a_T_b);
          among = among || (error.metres < 2.0 * pixel_of(side) && error.radians < kTwoPi / side);
        }
        CHECK(among);
      }
    }
    // The smallest side: a picture against itself, moved.
    for (const RotationMode mode : kModes) {
      CAPTURE(static_cast<int>(mode));
      Bench bench(with_mode(config_of(32), mode));
      const Picture small = centred(triangle(24), 24, 32);
      const HypothesisList found = bench.match(moved(small, 32, 2, -3), small);
      REQUIRE_FALSE(found.empty());
      CHECK(error_of(found[0].a_T_b, {2.0, -3.0, 0.0}).metres < 0.2);
    }
  }

  TEST_CASE("moving a picture moves the pose, turning it by 90 degrees turns it") {
    for (const RotationMode mode : kModes) {
      CAPTURE(static_cast<int>(mode));
      const std::size_t side = 96;
      Bench bench(with_mode(config_of(96), mode));
      const Views seen = views(4, {0.8, 0.6, 0.4}, 96);
      const Picture a = centred(seen.a, 96, 96);
      const Pose2 still = bench.match(a, seen.b)[0].a_T_b;
      const Pose2 shifted = bench.match(moved(a, side, 3, -2), seen.b)[0].a_T_b;
      CHECK(error_of(shifted, {still.x + 3.0, still.y - 2.0, still.theta}).metres < 0.2);
      CHECK(error_of(shifted, still).radians < 0.2 * kPi / 96);
      const Pose2 turned_by_quarter = bench.match(quarter_turned(a, side), seen.b)[0].a_T_b;
      const Pose2 expected = compose({0.0, 0.0, kHalfPi}, still);
      CHECK(error_of(turned_by_quarter, expected).metres < 0.2);
      CHECK(error_of(turned_by_quarter, expected).radians < 0.2 * kPi / 96);
    }
  }

  TEST_CASE("scale comes with the rotation, and held at 1 a picture of another scale is not found") {
    const std::size_t side = 192;
    const Picture picture = views(3, {}, 192).a;
    for (const double scale : {0.8, 0.9, 1.1, 1.25}) {
      CAPTURE(scale);
      const Picture other = turned(picture, side, 0.6, scale);
      Bench bench(with_mode(config_of(192), RotationMode::log_polar_scale));
      const Hypothesis found = bench.match(other, picture)[0];
      CHECK(static_cast<double>(found.scale) == doctest::Approx(scale).epsilon(0.01));
      CHECK(std::fabs(wrap_angle(found.a_T_b.theta - 0.6)) < kTwoPi / 192);
      CHECK(translation(found.a_T_b) < 1.0);
      Bench held(with_mode(config_of(192), RotationMode::log_polar));
      const HypothesisList wrong = held.match(other, picture);
      CHECK((wrong.empty() || wrong[0].peak < 0.6F * found.peak));
      for (const Hypothesis& h : wrong) {
        CHECK(h.scale == 1.0F);
      }
    }
  }

  TEST_CASE("the paper's configuration registers offices") {
    Bench bench(paper_matcher(192));
    int right = 0;
    const int trials = test::trials(24);
    for (int i = 0; i < trials; ++i) {
      const Pose2 a_T_b{1.0, -1.5, wrap_angle(0.26 * i)};
      const Views seen = views(static_cast<std::uint64_t>(i), a_T_b, 192);
      MatcherConfig config = paper_matcher(192);
      const HypothesisList found = bench.match(seen.a, seen.b);
      const double metres_a_pixel = pixel_of(192) / static_cast<double>(config.pixel_m);
      for (const Hypothesis& h : found) {
        const Pose2 pose{h.a_T_b.x * metres_a_pixel, h.a_T_b.y * metres_a_pixel, h.a_T_b.theta};
        if (error_of(pose, a_T_b).metres < 0.5 && error_of(pose, a_T_b).radians < 4.0 * kPi / 180.0) {
          ++right;
          break;
        }
      }
    }
    CHECK(right >= trials * 9 / 10);
  }

  TEST_CASE("hypotheses under the threshold are dropped") {
    const Views seen = views(2, {1.0, 0.5, 1.0}, 96);
    MatcherConfig config = config_of(96);
    config.peak_share = 0.0F;
    Bench all(config);
    const HypothesisList before = all.match(seen.a, seen.b);
    REQUIRE(before.size() > 2);
    config.min_peak = 0.5F * (before[0].peak + before[1].peak);
    Bench some(config);
    const HypothesisList after = some.match(seen.a, seen.b);
    REQUIRE(after.size() == 1);
    CHECK(after[0].peak == before[0].peak);
  }

  TEST_CASE("degenerate pictures give no match or finite numbers in every mode, a square all its turns") {
    const std::size_t side = 48;
    std::vector<Picture> pictures;
    const auto draw = [&](auto inside) {
      Picture picture(side * side);
      for (std::size_t i = 0; i < picture.size(); ++i) {
        const std::size_t row = i / side;
        picture[i] = inside(static_cast<double>(i % side) - 23.5, static_cast<double>(row) - 23.5) ? 255 : 0;
      }
      pictures.push_back(picture);
    };
    draw([](double, double) { return false; });                                              // all free or unknown
    draw([](double, double) { return true; });                                               // all occupied
    draw([](double x, double y) { return x == 3.5 && y == -8.5; });                          // one cell
    draw([](double, double y) { return y == 4.5; });                                         // a straight wall
    draw([](double x, double y) { return std::fabs(std::hypot(x, y) - 12.0) < 0.7; });       // a circle
    draw([](double x, double y) { return std::fmax(std::fabs(x), std::fabs(y)) == 10.5; });  // a square room
    for (const bool masked : {false, true}) {
      for (const RotationMode mode : kModes) {
        for (const HighPass high_pass : {HighPass::none, HighPass::radius, HighPass::reddy}) {
          for (const PeakFit fit : {PeakFit::centre_of_mass, PeakFit::gaussian}) {
            CAPTURE(masked);
            CAPTURE(static_cast<int>(mode));
            MatcherConfig config = with_mode(config_of(side), mode);
            config.masked = masked;
            config.high_pass = high_pass;
            config.peak_fit = fit;
            Bench bench(config);
            std::vector<Features> features;
            for (std::size_t i = 0; i < pictures.size(); ++i) {
              features.push_back(bench.carve());
              const Status status = bench.matcher.extract({pictures[i].data(), side * side}, features[i]);
              CHECK((i >= 2 || status == Status::degenerate));
            }
            for (const Features& a : features) {
              for (const Features& b : features) {
                const Status status = bench.matcher.match(a, b);
                CHECK((status == Status::ok) == (a.ready && b.ready));
                CHECK(all_finite(bench.matcher.hypotheses()));
                for (const Hypothesis& h : bench.matcher.hypotheses()) {
                  CHECK(h.peak <= 1.01F);
                  CHECK(std::isfinite(h.scale));
                  CHECK(h.covariance.xx > 0.0F);
                  CHECK(h.covariance.yy > 0.0F);
                  CHECK(h.covariance.tt > 0.0F);
                  CHECK(std::isfinite(h.covariance.xx + h.covariance.xy + h.covariance.yy + h.covariance.tt));
                }
              }
            }
            // Four turns of a square room look the same: the true one is among them, and the others beside it.
            REQUIRE(bench.matcher.match(features.back(), features.back()) == Status::ok);
            bool identity = false;
            int alike = 0;
            const HypothesisList& square = bench.matcher.hypotheses();
            for (const Hypothesis& h : square) {
              identity = identity || (translation(h.a_T_b) < 0.2 && std::fabs(h.a_T_b.theta) < 0.02);
              alike += h.peak > 0.9F * square[0].peak ? 1 : 0;
            }
            CHECK(identity);
            CHECK(alike >= 4);
          }
        }
      }
    }
  }

  TEST_CASE("steps of any size give the same bits in every mode") {
    const Views seen = views(6, {0.5, -0.9, 1.9}, 50);
    for (const RotationMode mode : kModes) {
      CAPTURE(static_cast<int>(mode));
      MatcherConfig config = with_mode(config_of(50), mode);
      Bench whole(config);
      const HypothesisList expected = whole.match(seen.a, seen.b);
      REQUIRE_FALSE(expected.empty());
      for (const int lines : {1, 7, 8, 13, 26}) {
        config.lines_per_step = static_cast<std::uint16_t>(lines);
        Bench sliced(config);
        const HypothesisList found = sliced.match(seen.a, seen.b);
        REQUIRE(found.size() == expected.size());
        for (std::size_t i = 0; i < found.size(); ++i) {
          CHECK(found[i].a_T_b.x == expected[i].a_T_b.x);
          CHECK(found[i].a_T_b.theta == expected[i].a_T_b.theta);
          CHECK(found[i].peak == expected[i].peak);
          CHECK(found[i].scale == expected[i].scale);
        }
      }
    }
  }

  TEST_CASE("memory of features: rings take half of a polar spectrum") {
    MatcherConfig config = config_of(96);
    CHECK(Features::polar_count(config) == 48 * 49);
    for (const RotationMode mode :
         {RotationMode::linear_polar, RotationMode::log_polar, RotationMode::log_polar_scale}) {
      config.rotation = mode;
      CHECK(Features::polar_count(config) == 96 * 49);
    }
  }
}
