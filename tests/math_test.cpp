// The elementary functions against libm in a wider format: long double (11 more bits on x86-64) for those in double,
// double for those in float. Bounds in ulp as core/math.hpp states them.
#include "mellin/core/math.hpp"

#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "mellin/core/random.hpp"

using namespace mellin;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
#if defined(__SANITIZE_ADDRESS__)
constexpr int kShare = 10;  // of the samples, one in so many: instrumented code is slow
#else
constexpr int kShare = 1;
#endif

/// Largest error seen, and where.
struct Worst {
  double ulps = 0.0;
  double x = 0.0;
  double y = 0.0;
  void see(double error, double at_x, double at_y = 0.0) {
    if (!(error <= ulps)) {
      ulps = error;
      x = at_x;
      y = at_y;
    }
  }
};

/// Distance from the exact value in units of its last place; subnormal numbers have the least unit of all.
double error(double value, long double exact) {
  if (static_cast<long double>(value) == exact) {
    return 0.0;
  }
  const long double unit = std::ldexp(1.0L, std::max(std::ilogb(exact) - 52, -1074));
  return static_cast<double>(std::fabs((static_cast<long double>(value) - exact) / unit));
}

double error(float value, double exact) {
  if (static_cast<double>(value) == exact) {
    return 0.0;
  }
  const double unit = std::ldexp(1.0, std::max(std::ilogb(exact) - 23, -149));
  return std::fabs((static_cast<double>(value) - exact) / unit);
}

std::uint32_t to_bits(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

float as_float(std::uint32_t bits) {
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// The double `steps` places after x.
double nudge(double x, int steps) {
  for (int i = 0; i < std::abs(steps); ++i) {
    x = std::nextafter(x, steps < 0 ? -kInfinity : kInfinity);
  }
  return x;
}

/// A finite double of any magnitude and sign.
double any_double(Random& random) {
  for (;;) {
    const std::uint64_t bits = random.bits();
    double x = 0.0;
    std::memcpy(&x, &bits, sizeof x);
    if (std::isfinite(x)) {
      return x;
    }
  }
}

/// Errors of sine and cosine at x, and that -x gives the same but for the sine's sign.
struct SinCosCheck {
  Worst sin;
  Worst cos;
  double off_circle = 0.0;
  bool symmetric = true;
  void at(double x) {
    const SinCos r = sincos(x);
    const SinCos mirrored = sincos(-x);
    sin.see(error(r.sin, sinl(x)), x);
    cos.see(error(r.cos, cosl(x)), x);
    off_circle = std::max(off_circle, std::fabs(r.sin * r.sin + r.cos * r.cos - 1.0));
    symmetric = symmetric && same_bits(-r.sin, mirrored.sin) && same_bits(r.cos, mirrored.cos);
  }
};

struct SinCosFloatCheck {
  Worst sin;
  Worst cos;
  bool symmetric = true;
  void at(float x) {
    const SinCosF r = sincos(x);
    const SinCosF mirrored = sincos(-x);
    sin.see(error(r.sin, std::sin(static_cast<double>(x))), x);
    cos.see(error(r.cos, std::cos(static_cast<double>(x))), x);
    symmetric = symmetric && to_bits(-r.sin) == to_bits(mirrored.sin) && to_bits(r.cos) == to_bits(mirrored.cos);
  }
};

}  // namespace

static_assert(std::numeric_limits<long double>::digits >= 64, "the references need a wider long double");

TEST_CASE("sine and cosine: within 0.85 ulp, odd and even to the bit, on the unit circle") {
  SinCosCheck check;
  Random random(1, 1);
  for (int i = 0; i < 1000000 / kShare; ++i) {
    check.at((2.0 * random.uniform() - 1.0) * 4.0);
    check.at((2.0 * random.uniform() - 1.0) * 1e6);
    check.at(std::ldexp(1.0 + random.uniform(), -static_cast<int>(random.uniform() * 1074.0)));
  }
  for (int k = 1; k <= 636619;
       k += kShare) {  // next to the multiples of pi/4, where one of both vanishes or halves turn
    for (int steps = -1; steps <= 1; ++steps) {
      check.at(nudge(k * kHalfPi, steps));
      check.at(nudge((k - 0.5) * kHalfPi, steps));
    }
  }
  for (const double x : {5e-324, 2.2250738585072014e-308, 1e-300, 0x1p-27, 0x1p-26, 1.0, 1e6, nudge(1e6, -1)}) {
    check.at(x);
  }
  MESSAGE("sin ", check.sin.ulps, " ulp at ", check.sin.x, ", cos ", check.cos.ulps, " ulp at ", check.cos.x);
  CHECK(check.sin.ulps < 0.85);
  CHECK(check.cos.ulps < 0.85);
  CHECK(check.symmetric);
  CHECK(check.off_circle < 4e-16);
}

TEST_CASE("sine and cosine: zero, the end of the range and what lies beyond") {
  CHECK(same_bits(sincos(0.0).sin, 0.0));
  CHECK(sincos(0.0).cos == 1.0);
  CHECK(sincos(-0.0).sin == 0.0);
  CHECK(sincos(-0.0).cos == 1.0);
  for (const double bad : {nudge(1e6, 1), -nudge(1e6, 1), 1e300, kInfinity, -kInfinity, kNaN}) {
    CHECK(std::isnan(sincos(bad).sin));
    CHECK(std::isnan(sincos(bad).cos));
    const auto narrow = static_cast<float>(bad);
    CHECK(std::isnan(sincos(narrow).sin));
    CHECK(std::isnan(sincos(narrow).cos));
  }
  CHECK_FALSE(std::isnan(sincos(1e6).sin));
  CHECK_FALSE(std::isnan(sincos(1e3F).sin));
  CHECK(std::isnan(sincos(std::nextafter(1e3F, 2e3F)).sin));
}

TEST_CASE("float sine and cosine: within 0.8 ulp over all binades up to 1000, odd and even to the bit") {
  SinCosFloatCheck check;
  constexpr std::uint32_t kStride = 211 * kShare;  // a prime: all low bits come about
  for (std::uint32_t bits = to_bits(0x1p-12F); bits <= to_bits(1e3F); bits += kStride) {
    check.at(as_float(bits));
  }
  for (std::uint32_t bits = 1; bits < to_bits(0x1p-12F); bits += 100003) {
    check.at(as_float(bits));
  }
  for (int k = 1; k <= 636; ++k) {
    const auto quarter = to_bits(static_cast<float>(k * kHalfPi));
    for (std::uint32_t bits = quarter - 200; bits <= quarter + 200; ++bits) {
      check.at(std::min(as_float(bits), 1e3F));
    }
  }
  MESSAGE("sin ", check.sin.ulps, " ulp at ", check.sin.x, ", cos ", check.cos.ulps, " ulp at ", check.cos.x);
  CHECK(check.sin.ulps < 0.8);
  CHECK(check.cos.ulps < 0.8);
  CHECK(check.symmetric);
}

TEST_CASE("float sine and cosine: every float in [-pi, pi]") {
  if (std::getenv("MELLIN_LONG") == nullptr) {
    return;  // a minute or two; the ctest case math_sweep sets it
  }
  SinCosFloatCheck check;
  const std::uint32_t last = to_bits(0x1.921fb6p+1F);  // the float next to pi
  for (std::uint32_t bits = 0; bits <= last; ++bits) {
    check.at(as_float(bits));
  }
  MESSAGE("sin ", check.sin.ulps, " ulp at ", check.sin.x, ", cos ", check.cos.ulps, " ulp at ", check.cos.x);
  CHECK(check.sin.ulps < 0.8);
  CHECK(check.cos.ulps < 0.8);
  CHECK(check.symmetric);
}

TEST_CASE("atan2: within 0.55 ulp in all quadrants and magnitudes, odd in y to the bit") {
  Worst worst;
  Worst tiny;
  bool odd = true;
  const auto at = [&](double y, double x) {
    const double angle = mellin::atan2(y, x);
    const long double exact = atan2l(y, x);
    (std::fabs(exact) < 1e-307L ? tiny : worst).see(error(angle, exact), x, y);
    odd = odd && (y == 0.0 || same_bits(-angle, mellin::atan2(-y, x)));
  };
  Random random(2, 1);
  const auto sign = [&random] { return random.uniform() < 0.5 ? -1.0 : 1.0; };
  for (int i = 0; i < 1000000 / kShare; ++i) {
    at(2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0);
    at(any_double(random), any_double(random));
    const double length = std::ldexp(1.0 + random.uniform(), static_cast<int>(random.uniform() * 2000.0) - 1000);
    at(sign() * length * random.uniform(), sign() * length);
    at(sign() * length, sign() * length * random.uniform());
  }
  // The reduction changes from one quarter to the next at odd eighths; the series ends at 2^-28.
  for (int eighths = 1; eighths <= 8; ++eighths) {
    for (int steps = -50; steps <= 50; ++steps) {
      for (int k = 0; k < 20; ++k) {
        const double x = 1.0 + random.uniform();
        at(nudge(x * eighths * 0.125, steps), x);
        at(x, -nudge(x * eighths * 0.125, steps));
      }
      at(nudge(0x1p-28, steps), 1.0);
    }
  }
  MESSAGE("atan2 ", worst.ulps, " ulp at ", worst.y, ", ", worst.x, "; of results below 1e-307 ", tiny.ulps);
  CHECK(worst.ulps < 0.55);
  CHECK(tiny.ulps <= 1.0);
  CHECK(odd);
}

TEST_CASE("atan2: axes, zeros, infinities and NaN") {
  CHECK(same_bits(mellin::atan2(0.0, 0.0), 0.0));
  CHECK(mellin::atan2(0.0, -0.0) == 0.0);
  CHECK(same_bits(mellin::atan2(0.0, 2.0), 0.0));
  CHECK(mellin::atan2(0.0, -1.0) == kPi);
  CHECK(mellin::atan2(-0.0, -1.0) == kPi);
  CHECK(mellin::atan2(3.0, 0.0) == kHalfPi);
  CHECK(mellin::atan2(-3.0, 0.0) == -kHalfPi);
  CHECK(mellin::atan2(5.0, 5.0) == kPi / 4);
  CHECK(mellin::atan2(-5.0, -5.0) == -3 * kPi / 4);
  for (const double y : {kInfinity, -kInfinity, 1.0, -1.0}) {
    for (const double x : {kInfinity, -kInfinity, 1.0, -1.0}) {
      CHECK(mellin::atan2(y, x) == std::atan2(y, x));
    }
    CHECK(std::isnan(mellin::atan2(kNaN, y)));
    CHECK(std::isnan(mellin::atan2(y, kNaN)));
  }
}

TEST_CASE("exp: within 0.8 ulp, subnormal results within 1, never falling") {
  Worst worst;
  Worst tiny;
  const auto at = [&](double x) {
    const long double exact = expl(x);
    (x < -708.39 ? tiny : worst).see(error(mellin::exp(x), exact), x);
  };
  Random random(3, 1);
  for (int i = 0; i < 1000000 / kShare; ++i) {
    at(random.uniform() * 1418.0 - 708.39);
    at(2.0 * random.uniform() - 1.0);
    at(-708.39 - random.uniform() * 36.7);
    at(std::ldexp(2.0 * random.uniform() - 1.0, -static_cast<int>(random.uniform() * 60.0)));
  }
  int falling = 0;
  for (int k = -1022; k <= 1023; ++k) {  // where the power of two changes
    const double edge = (k + 0.5) * 0x1.62e42fefa39efp-1;
    for (int steps = -20; steps < 20; ++steps) {
      at(std::max(nudge(edge, steps), -708.39));
      falling += mellin::exp(nudge(edge, steps)) <= mellin::exp(nudge(edge, steps + 1)) ? 0 : 1;
    }
  }
  MESSAGE("exp ", worst.ulps, " ulp at ", worst.x, "; of subnormal results ", tiny.ulps);
  CHECK(worst.ulps < 0.8);
  CHECK(tiny.ulps <= 1.0);
  CHECK(falling == 0);
}

TEST_CASE("exp: exact at 0, and at the ends as the exact value rounds") {
  CHECK(mellin::exp(0.0) == 1.0);
  CHECK(mellin::exp(-0.0) == 1.0);
  CHECK(mellin::exp(5e-324) == 1.0);
  const double most = 0x1.62e42fefa39efp+9;
  CHECK(error(mellin::exp(most), expl(most)) < 0.8);
  CHECK(mellin::exp(nudge(most, 1)) == kInfinity);
  const double least = -0x1.74910d52d3051p+9;
  CHECK(mellin::exp(least) == 5e-324);
  CHECK(mellin::exp(nudge(least, -1)) == 0.0);
  CHECK(mellin::exp(kInfinity) == kInfinity);
  CHECK(mellin::exp(-kInfinity) == 0.0);
  CHECK(std::isnan(mellin::exp(kNaN)));
}

TEST_CASE("log: within 0.9 ulp from the least to the largest double, never falling") {
  Worst worst;
  const auto at = [&](double x) { worst.see(error(mellin::log(x), logl(x)), x); };
  Random random(4, 1);
  for (int i = 0; i < 1000000 / kShare; ++i) {
    at(std::fabs(any_double(random)));
    at(0.5 + 1.5 * random.uniform());
    at(1.0 + std::ldexp(2.0 * random.uniform() - 1.0, -1 - static_cast<int>(random.uniform() * 50.0)));
    at(random.uniform() * 0x1p-1022 + 5e-324);
  }
  int falling = 0;
  for (const double edge : {0.5, 1.0, 2.0, 0.70710678118654752, 1.4142135623730951, 2.8284271247461901, 0x1p-1022}) {
    for (int steps = -1000; steps < 1000; ++steps) {
      const double x = nudge(edge, steps);
      if (x != 1.0) {
        at(x);
      }
      falling += mellin::log(x) <= mellin::log(nudge(x, 1)) ? 0 : 1;
    }
  }
  MESSAGE("log ", worst.ulps, " ulp at ", worst.x);
  CHECK(worst.ulps < 0.9);
  CHECK(falling == 0);
}

TEST_CASE("log: exact at 1, and at the ends") {
  CHECK(same_bits(mellin::log(1.0), 0.0));
  const double least = std::numeric_limits<double>::denorm_min();
  CHECK(error(mellin::log(least), logl(least)) < 0.9);
  CHECK(error(mellin::log(std::numeric_limits<double>::max()), logl(std::numeric_limits<double>::max())) < 0.9);
  CHECK(mellin::log(0.0) == -kInfinity);
  CHECK(mellin::log(-0.0) == -kInfinity);
  CHECK(mellin::log(kInfinity) == kInfinity);
  CHECK(std::isnan(mellin::log(-5e-324)));
  CHECK(std::isnan(mellin::log(-kInfinity)));
  CHECK(std::isnan(mellin::log(kNaN)));
}

TEST_CASE("square roots are rounded correctly") {
  Worst worst;
  Worst narrow;
  Random random(5, 1);
  for (int i = 0; i < 300000 / kShare; ++i) {
    const double x = std::fabs(any_double(random));
    worst.see(error(mellin::sqrt(x), sqrtl(x)), x);
    const float f = as_float(static_cast<std::uint32_t>(random.bits() % to_bits(std::numeric_limits<float>::max())));
    narrow.see(error(mellin::sqrt(f), std::sqrt(static_cast<double>(f))), f);
  }
  CHECK(worst.ulps <= 0.5);
  CHECK(narrow.ulps <= 0.5);
  CHECK(std::isnan(mellin::sqrt(-1.0)));
  CHECK(std::isnan(mellin::sqrt(-1.0F)));
}

TEST_CASE("angles wrap into [-pi, pi) by full turns, to the last place of the angle") {
  CHECK(wrap_angle(kPi) == -kPi);
  CHECK(wrap_angle(-kPi) == -kPi);
  CHECK(wrap_angle(nudge(kPi, -1)) == nudge(kPi, -1));
  CHECK(wrap_angle(nudge(-kPi, -1)) == doctest::Approx(kPi));
  CHECK(wrap_angle(0.0) == 0.0);
  Random random(6, 1);
  double worst = 0.0;
  int outside = 0;
  for (int i = 0; i < 1000000 / kShare; ++i) {
    const double angle = (2.0 * random.uniform() - 1.0) * (i % 2 == 0 ? 20.0 : 1e6);
    const double wrapped = wrap_angle(angle);
    outside += wrapped >= -kPi && wrapped < kPi ? 0 : 1;
    const long double exact = std::remainder(static_cast<long double>(angle), static_cast<long double>(kTwoPi));
    // Next to +-pi either end is right.
    const long double off = std::remainder(wrapped - exact, static_cast<long double>(kTwoPi));
    worst = std::max(
        worst, static_cast<double>(std::fabs(off)) / std::ldexp(1.0, std::ilogb(std::max(std::fabs(angle), kPi)) - 52));
  }
  CHECK(outside == 0);
  CHECK(worst <= 1.0);
}

TEST_CASE("is_finite tells numbers from NaN and infinity") {
  for (const double x : {0.0, -0.0, 5e-324, -1.7976931348623157e308}) {
    CHECK(is_finite(x));
  }
  for (const double x : {kInfinity, -kInfinity, kNaN, -kNaN}) {
    CHECK_FALSE(is_finite(x));
  }
}
