#include "mellin/core/math.hpp"

#include <cmath>
#include <cstring>
#include <limits>

namespace mellin {
namespace {

// pi/2 in four parts. The first three have 33 significant bits, so k * part is exact for |k| < 2^20.
constexpr double kHalfPi1 = 0x1.921fb544p+0;
constexpr double kHalfPi2 = 0x1.0b4611a6p-34;
constexpr double kHalfPi3 = 0x1.3198a2ep-69;
constexpr double kHalfPi4 = 0x1.b839a252049c1p-104;
/// What kHalfPi lacks.
constexpr double kHalfPiRest = 0x1.1a62633145c07p-54;

// ln 2 in two parts, the first of 32 bits.
constexpr double kLn2Hi = 0x1.62e42feep-1;
constexpr double kLn2Lo = 0x1.a39ef35793c76p-33;

std::uint64_t to_bits(double x) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}

double from_bits(std::uint64_t bits) {
  double x = 0.0;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// 2^k for k in [-1022, 1023].
double power_of_two(int k) { return from_bits(static_cast<std::uint64_t>(k + 1023) << 52U); }

/// A number in two parts: what one float cannot hold of it is in the second.
template <class Real>
struct Pair {
  Real high;
  Real low;
};

/// a + b without loss, where |a| >= |b| or the sum is exact (Dekker 1971).
template <class Real>
Pair<Real> exact_sum(Real a, Real b) {
  const Real sum = a + b;
  return {sum, (a - sum) + b};
}

/// a b without loss, for factors well inside the range (Dekker 1971).
Pair<double> exact_product(double a, double b) {
  constexpr double kSplit = 0x1p27 + 1.0;
  const double a_wide = kSplit * a;
  const double a_high = a_wide - (a_wide - a);
  const double a_low = a - a_high;
  const double b_wide = kSplit * b;
  const double b_high = b_wide - (b_wide - b);
  const double b_low = b - b_high;
  const double product = a * b;
  return {product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low};
}

// Taylor series (sin r - r) / r^3 and (cos r - 1 + r^2/2) / r^4 in z = r^2; on |r| <= pi/4 what is left out of sine and
// cosine is below 2e-18 in double and 2e-9 in float.
double sin_series(double z) {
  double p = 1.0 / 355687428096000.0;
  p = p * z - 1.0 / 1307674368000.0;
  p = p * z + 1.0 / 6227020800.0;
  p = p * z - 1.0 / 39916800.0;
  p = p * z + 1.0 / 362880.0;
  p = p * z - 1.0 / 5040.0;
  p = p * z + 1.0 / 120.0;
  return p * z - 1.0 / 6.0;
}

double cos_series(double z) {
  double p = 1.0 / 20922789888000.0;
  p = p * z - 1.0 / 87178291200.0;
  p = p * z + 1.0 / 479001600.0;
  p = p * z - 1.0 / 3628800.0;
  p = p * z + 1.0 / 40320.0;
  p = p * z - 1.0 / 720.0;
  return p * z + 1.0 / 24.0;
}

float sin_series(float z) {
  float p = 1.0F / 362880.0F;
  p = p * z - 1.0F / 5040.0F;
  p = p * z + 1.0F / 120.0F;
  return p * z - 1.0F / 6.0F;
}

float cos_series(float z) {
  float p = -1.0F / 3628800.0F;
  p = p * z + 1.0F / 40320.0F;
  p = p * z - 1.0F / 720.0F;
  return p * z + 1.0F / 24.0F;
}

/// Sine and cosine of r + quadrant pi/2, or of the mirrored angle where `negative`. To first order in r.low, which is
/// at most half a unit in the last place of r.high.
template <class Out, class Real>
Out by_quadrant(int quadrant, const Pair<Real>& r, bool negative) {
  constexpr Real kOne = 1;
  constexpr Real kHalf = kOne / 2;
  const Real z = r.high * r.high;
  const Real s = r.high + (r.high * z * sin_series(z) + r.low * (kOne - kHalf * z));
  const Pair<Real> parabola = exact_sum(kOne, -(kHalf * z));
  const Real c = parabola.high + (parabola.low + (z * z * cos_series(z) - r.high * r.low));
  const bool swapped = (quadrant & 1) != 0;
  const Real sine = swapped ? c : s;
  const Real cosine = swapped ? s : c;
  const bool sine_minus = ((quadrant & 2) != 0) != negative;
  const bool cosine_minus = ((quadrant + 1) & 2) != 0;
  return {sine_minus ? -sine : sine, cosine_minus ? -cosine : cosine};
}

/// The quarter of a turn next to n/d, and its arctangent.
struct AtanQuarter {
  double first;  ///< two powers of two (or 0) that add up to the quarter
  double second;
  Pair<double> atan;
};
constexpr AtanQuarter kAtanQuarters[5] = {
    {0.0, 0.0, {0.0, 0.0}},
    {0.25, 0.0, {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57}},
    {0.5, 0.0, {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56}},
    {0.5, 0.25, {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56}},
    {1.0, 0.0, {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}},
};

/// atan(n/d) for 1 <= d < 2, 2^-28 d < n <= d: turned back by the nearest c of 0, 1/4 ... 1, by
/// atan(n/d) = atan c + atan r with r = (n - c d) / (d + c n), |r| <= 1/8, where the series to r^17 leaves 4e-19.
Pair<double> atan_ratio(double n, double d) {
  const AtanQuarter& c = kAtanQuarters[static_cast<int>(n / d * 4.0 + 0.5)];
  const double numerator =
      (n - c.first * d) - c.second * d;  // both differences are exact: each at most halves or doubles
  const Pair<double> once = exact_sum(d, c.first * n);
  const Pair<double> denominator = exact_sum(once.high, c.second * n);
  const double quotient = numerator / denominator.high;
  const Pair<double> back = exact_product(quotient, denominator.high);
  const double rest = ((numerator - back.high) - back.low) - quotient * (once.low + denominator.low);
  const double z = quotient * quotient;
  double p = 1.0 / 17.0;
  p = p * z - 1.0 / 15.0;
  p = p * z + 1.0 / 13.0;
  p = p * z - 1.0 / 11.0;
  p = p * z + 1.0 / 9.0;
  p = p * z - 1.0 / 7.0;
  p = p * z + 1.0 / 5.0;
  p = p * z - 1.0 / 3.0;
  const double small = quotient * z * p + rest / denominator.high;
  const Pair<double> sum = c.first > 0.0 ? exact_sum(c.atan.high, quotient) : Pair<double>{quotient, 0.0};
  return {sum.high, sum.low + (c.atan.low + small)};
}

/// The power of two that brings x into [1, 2), for finite x > 0; in two factors, since one may be out of range.
Pair<double> scale_to_one(double x) {
  const auto exponent = static_cast<int>(to_bits(x) >> 52U);
  if (exponent == 0) {  // subnormal
    const auto rest = static_cast<int>(to_bits(x * 0x1p54) >> 52U);
    return {0x1p54, power_of_two(1023 - rest)};
  }
  const int k = 1023 - exponent;
  return {power_of_two(k / 2), power_of_two(k - k / 2)};
}

}  // namespace

SinCos sincos(double x) {
  if (!(std::fabs(x) <= 1e6)) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan};
  }
  const double magnitude = std::fabs(x);
  const double k = std::floor(magnitude * (1.0 / kHalfPi) + 0.5);
  const Pair<double> two = exact_sum(magnitude - k * kHalfPi1, -(k * kHalfPi2));
  const Pair<double> r = exact_sum(two.high, -(k * kHalfPi3));
  const Pair<double> rest = {r.high, r.low + two.low - k * kHalfPi4};
  return by_quadrant<SinCos>(static_cast<int>(k), rest, std::signbit(x));
}

SinCosF sincos(float x) {
  if (!(std::fabs(x) <= 1e3F)) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    return {nan, nan};
  }
  // pi/2 in four parts, three of them of 11 bits: k has at most 10, so that k * part and the first two differences
  // are exact.
  constexpr float part1 = 0x1.92p+0F;
  constexpr float part2 = 0x1.fb4p-12F;
  constexpr float part3 = 0x1.444p-24F;
  constexpr float part4 = 0x1.68c234p-39F;
  const float magnitude = std::fabs(x);
  const float k = std::floor(magnitude * 0.636619772F + 0.5F);
  const Pair<float> r = exact_sum((magnitude - k * part1) - k * part2, -(k * part3));
  return by_quadrant<SinCosF>(static_cast<int>(k), Pair<float>{r.high, r.low - k * part4}, std::signbit(x));
}

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (x == 0.0 && y == 0.0) {
    return 0.0;
  }
  const double ax = std::fabs(x);
  const double ay = std::fabs(y);
  const bool steep = ay > ax;
  const double large = steep ? ay : ax;
  const double small = steep ? ax : ay;
  Pair<double> angle = {0.0, 0.0};
  if (std::isinf(large)) {
    angle = std::isinf(small) ? kAtanQuarters[4].atan : angle;
  } else if (small <= large * 0x1p-28) {
    angle.high = small / large;  // the next term is beyond the last place
  } else {
    const Pair<double> scale = scale_to_one(large);
    angle = atan_ratio(small * scale.high * scale.low, large * scale.high * scale.low);
  }
  // From the nearer axis: 0 + angle, pi/2 - angle, pi/2 + angle or pi - angle.
  if (steep != (x < 0.0)) {
    angle = {-angle.high, -angle.low};
  }
  const double axis = steep ? 1.0 : x < 0.0 ? 2.0 : 0.0;
  if (axis > 0.0) {
    const Pair<double> sum = exact_sum(axis * kHalfPi, angle.high);
    angle = {sum.high, sum.low + (axis * kHalfPiRest + angle.low)};
  }
  const double magnitude = angle.high + angle.low;
  return y < 0.0 ? -magnitude : magnitude;
}

double exp(double x) {
  if (std::isnan(x)) {
    return x;
  }
  if (x > 0x1.62e42fefa39efp+9) {  // the last one whose result is finite
    return std::numeric_limits<double>::infinity();
  }
  if (x < -0x1.74910d52d3051p+9) {  // the last one whose result is not nearer to 0
    return 0.0;
  }
  const double k = std::floor(x * 1.44269504088896340736 + 0.5);
  const Pair<double> reduced = exact_sum(x - k * kLn2Hi, -(k * kLn2Lo));
  const double r = reduced.high;
  // Taylor to r^13 on |r| <= ln(2)/2.
  double p = 1.0 / 6227020800.0;
  p = p * r + 1.0 / 479001600.0;
  p = p * r + 1.0 / 39916800.0;
  p = p * r + 1.0 / 3628800.0;
  p = p * r + 1.0 / 362880.0;
  p = p * r + 1.0 / 40320.0;
  p = p * r + 1.0 / 5040.0;
  p = p * r + 1.0 / 720.0;
  p = p * r + 1.0 / 120.0;
  p = p * r + 1.0 / 24.0;
  p = p * r + 1.0 / 6.0;
  p = p * r + 0.5;
  const Pair<double> line = exact_sum(1.0, r);
  const double e = line.high + (line.low + (r * r * p + (reduced.low + reduced.low * r)));
  const int n = static_cast<int>(k);
  const int half = n / 2;  // two steps, so that subnormal results round once
  return e * power_of_two(half) * power_of_two(n - half);
}

double log(double x) {
  if (std::isnan(x) || x < 0.0) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (x == 0.0) {
    return -std::numeric_limits<double>::infinity();
  }
  if (std::isinf(x)) {
    return x;
  }
  int k = 0;
  if (x < 0x1p-1022) {
    x *= 0x1p54;
    k = -54;
  }
  const std::uint64_t bits = to_bits(x);
  k += static_cast<int>(bits >> 52U) - 1023;
  double m = from_bits((bits & 0xFFFFFFFFFFFFFULL) | (1023ULL << 52U));
  if (m > 1.41421356237309504880) {
    m *= 0.5;
    ++k;
  }
  // ln m = 2 artanh s = 2 s + s t with s = f / (2 + f), |s| <= 0.172; the series to s^21 leaves less than 1e-18. The
  // leading 2 s is f - f^2/2 + s f^2/2, of which f is exact.
  const double f = m - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  double p = 1.0 / 21.0;
  p = p * z + 1.0 / 19.0;
  p = p * z + 1.0 / 17.0;
  p = p * z + 1.0 / 15.0;
  p = p * z + 1.0 / 13.0;
  p = p * z + 1.0 / 11.0;
  p = p * z + 1.0 / 9.0;
  p = p * z + 1.0 / 7.0;
  p = p * z + 1.0 / 5.0;
  p = p * z + 1.0 / 3.0;
  const double t = 2.0 * z * p;
  const double parabola = 0.5 * f * f;
  const double rest = s * (parabola + t) + k * kLn2Lo;
  return k * kLn2Hi - ((parabola - rest) - f);
}

double sqrt(double x) { return std::sqrt(x); }

float sqrt(float x) { return std::sqrt(x); }

double wrap_angle(double angle_rad) {
  if (angle_rad >= -kPi && angle_rad < kPi) {
    return angle_rad;
  }
  const double wrapped = angle_rad - kTwoPi * std::floor((angle_rad + kPi) / kTwoPi);
  return wrapped >= kPi ? -kPi : wrapped;
}

bool is_finite(double x) { return std::isfinite(x); }

}  // namespace mellin
