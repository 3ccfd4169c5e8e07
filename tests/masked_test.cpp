// Masked registration against the definition: the correlation coefficient of what both pictures have observed.
#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "mellin/spectral/matcher.hpp"
#include "tests/support/matcher_bench.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

constexpr std::size_t kSide = 48;
constexpr std::size_t kPixels = kSide * kSide;

struct Seen {
  Picture picture;
  std::vector<std::uint8_t> observed;  // a byte a pixel, 0 or 1

  std::vector<std::uint8_t> mask() const {
    std::vector<std::uint8_t> bits(mask_bytes(kSide));
    for (std::size_t i = 0; i < kPixels; ++i) {
      bits[i / 8] = static_cast<std::uint8_t>(bits[i / 8] | (observed[i] << (i % 8)));
    }
    return bits;
  }
};

/// Random bytes at a third of the pixels of a plan, of which a view sees a disc. Nothing lies within nine pixels of the
/// border, where edges are blurred.
Seen view(std::uint64_t seed, int dx, int dy, double centre_x, double centre_y, double radius) {
  Seen seen{Picture(kPixels, 0), std::vector<std::uint8_t>(kPixels, 0)};
  for (int r = 9; r < 39; ++r) {
    for (int c = 9; c < 39; ++c) {
      if (std::hypot(c - centre_x, r - centre_y) < radius) {
        const auto i = static_cast<std::size_t>(r) * kSide + static_cast<std::size_t>(c);
        Random cell(seed, static_cast<std::uint64_t>((r - dy + 100) * 1000 + c - dx + 100));
        seen.observed[i] = 1;
        seen.picture[i] = cell.uniform() < 0.33 ? static_cast<std::uint8_t>(55 + 200 * cell.uniform()) : 0;
      }
    }
  }
  return seen;
}

struct Best {
  double value = -1.0;
  int x = 0;
  int y = 0;
};

/// The highest coefficient of all cyclic shifts of `b`, written out in double precision.
Best brute_force(const Seen& a, const Seen& b, double min_overlap) {
  const auto area = [](const Seen& s) { return std::count(s.observed.begin(), s.observed.end(), 1); };
  const double least = min_overlap * static_cast<double>(std::min(area(a), area(b)));
  Best best;
  for (std::size_t dy = 0; dy < kSide; ++dy) {
    for (std::size_t dx = 0; dx < kSide; ++dx) {
      double n = 0, f = 0, g = 0, ff = 0, gg = 0, fg = 0;
      for (std::size_t r = 0; r < kSide; ++r) {
        for (std::size_t c = 0; c < kSide; ++c) {
          const std::size_t i = ((r + dy) % kSide) * kSide + (c + dx) % kSide;
          const std::size_t k = r * kSide + c;
          if (a.observed[i] != 0 && b.observed[k] != 0) {
            const double u = a.picture[i] / 255.0;
            const double v = b.picture[k] / 255.0;
            n += 1, f += u, g += v, ff += u * u, gg += v * v, fg += u * v;
          }
        }
      }
      const double variance = (ff - f * f / n) * (gg - g * g / n);
      if (n >= least && n > 0 && variance > 1e-9) {
        const double value = (fg - f * g / n) / std::sqrt(variance);
        if (value > best.value) {
          best = {value, static_cast<int>(dx), static_cast<int>(dy)};
        }
      }
    }
  }
  return best;
}

Seen half_turned(const Seen& seen) {
  Seen out = seen;
  std::reverse(out.picture.begin(), out.picture.end());
  std::reverse(out.observed.begin(), out.observed.end());
  return out;
}

MatcherConfig masked_config() {
  MatcherConfig config = config_of(kSide);
  config.masked = true;
  config.com_radius = 0;
  config.peak_fit = PeakFit::centre_of_mass;
  config.peak_share = 0.0F;
  return config;
}

HypothesisList match(Bench& bench, const Seen& a, const Seen& b) {
  const std::vector<std::uint8_t> mask_a = a.mask();
  const std::vector<std::uint8_t> mask_b = b.mask();
  Features fa = bench.carve(FeatureUse::as_a);
  Features fb = bench.carve(FeatureUse::as_b);
  REQUIRE(bench.matcher.extract({a.picture.data(), kPixels}, fa, {mask_a.data(), mask_a.size()}) == Status::ok);
  REQUIRE(bench.matcher.extract({b.picture.data(), kPixels}, fb, {mask_b.data(), mask_b.size()}) == Status::ok);
  REQUIRE(bench.matcher.match(fa, fb) == Status::ok);
  return bench.matcher.hypotheses();
}

int nearest(int shift) { return shift >= static_cast<int>(kSide) / 2 ? shift - static_cast<int>(kSide) : shift; }

}  // namespace

TEST_SUITE("masked") {
  TEST_CASE("the peak and its place are those of the coefficient written out, turned by 180 degrees, too") {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      CAPTURE(seed);
      const Seen a = view(seed, 3, -2, 22, 24, 12);
      const Seen b = view(seed, 0, 0, 25, 23, 13);
      Bench bench(masked_config());
      const HypothesisList found = match(bench, a, b);
      int compared = 0;
      for (const Hypothesis& h : found) {
        const bool straight = h.a_T_b.theta == 0.0;
        if (!straight && h.a_T_b.theta != -kPi) {
          continue;  // no other angle leaves pixels pixels
        }
        const Best expected = brute_force(a, straight ? b : half_turned(b), 0.3);
        CHECK(static_cast<double>(h.peak) == doctest::Approx(expected.value).epsilon(1e-4));
        CHECK(h.a_T_b.x == doctest::Approx(nearest(expected.x)));
        CHECK(h.a_T_b.y == doctest::Approx(nearest(expected.y)));
        ++compared;
      }
      CHECK(compared == 2);
      CHECK(found[0].a_T_b.x == doctest::Approx(3.0));
      CHECK(found[0].a_T_b.y == doctest::Approx(-2.0));
      // Noise is only where the other one has not looked: what both have seen is the same.
      CHECK(found[0].peak > 0.999F);
    }
  }

  TEST_CASE("the least overlap keeps accidents of a few pixels out") {
    // Unrelated pictures: where only corners overlap, coefficients near 1 are no surprise.
    const Seen a = view(1, 0, 0, 24, 24, 12);
    const Seen b = view(2, 0, 0, 24, 24, 12);
    MatcherConfig config = masked_config();
    const auto best = [&](float share) {
      config.min_overlap = share;
      Bench bench(config);
      return match(bench, a, b)[0].peak;
    };
    CHECK(best(0.01F) > 0.8F);
    CHECK(best(0.3F) < 0.4F);
  }

  TEST_CASE("memory only where masks are used") {
    const auto bytes = [](bool masked) {
      MatcherConfig config = masked_config();
      config.masked = masked;
      MeasureArena measure;
      Matcher::carve(measure, config);
      return measure.use().total();
    };
    CHECK(bytes(true) - bytes(false) == 7 * spectrum_size(kSide) * sizeof(Complex));
  }

  TEST_CASE("steps of any size give the same bits; without a mask all is observed; nothing observed matches nothing") {
    const Seen a = view(5, 2, 1, 24, 24, 14);
    Seen b = view(5, 0, 0, 24, 23, 13);
    MatcherConfig config = masked_config();
    config.com_radius = 1;
    Bench whole(config);
    const HypothesisList expected = match(whole, a, b);
    for (const int lines : {1, 5, 8, 30}) {
      config.lines_per_step = static_cast<std::uint16_t>(lines);
      Bench sliced(config);
      const HypothesisList found = match(sliced, a, b);
      REQUIRE(found.size() == expected.size());
      for (std::size_t i = 0; i < found.size(); ++i) {
        CHECK(found[i].a_T_b.x == expected[i].a_T_b.x);
        CHECK(found[i].peak == expected[i].peak);
      }
    }
    Seen all = b;
    std::fill(all.observed.begin(), all.observed.end(), std::uint8_t{1});
    const HypothesisList plain = whole.match(all.picture, all.picture);
    CHECK(plain[0].peak > 0.999F);
    Seen none = b;
    std::fill(none.observed.begin(), none.observed.end(), std::uint8_t{0});
    CHECK(match(whole, a, none).empty());
  }
}
