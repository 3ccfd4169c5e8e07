#include "mellin/core/math.hpp"

#include <cmath>
#include <cstring>
#include <limits>

namespace mellin {
namespace {

// pi/2 in three parts. The first two have 33 significant bits, so k * part is exact for |k| < 2^20.
constexpr double kHalfPi1 = 0x1.921fb544p+0;
constexpr double kHalfPi2 = 0x1.0b4611a6p-34;
constexpr double kHalfPi3 = 0x1.3198a2e037073p-69;

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

// Taylor series; on |r| <= pi/4 the first term left out is below 5e-17.
double sin_series(double r) {
  const double z = r * r;
  double p = -1.0 / 1307674368000.0;
  p = p * z + 1.0 / 6227020800.0;
  p = p * z - 1.0 / 39916800.0;
  p = p * z + 1.0 / 362880.0;
  p = p * z - 1.0 / 5040.0;
  p = p * z + 1.0 / 120.0;
  p = p * z - 1.0 / 6.0;
  return r + r * z * p;
}

double cos_series(double r) {
  const double z = r * r;
  double p = 1.0 / 20922789888000.0;
  p = p * z - 1.0 / 87178291200.0;
  p = p * z + 1.0 / 479001600.0;
  p = p * z - 1.0 / 3628800.0;
  p = p * z + 1.0 / 40320.0;
  p = p * z - 1.0 / 720.0;
  p = p * z + 1.0 / 24.0;
  return 1.0 - 0.5 * z + z * z * p;
}

float sin_series(float r) {
  const float z = r * r;
  float p = 1.0F / 362880.0F;
  p = p * z - 1.0F / 5040.0F;
  p = p * z + 1.0F / 120.0F;
  p = p * z - 1.0F / 6.0F;
  return r + r * z * p;
}

float cos_series(float r) {
  const float z = r * r;
  float p = -1.0F / 3628800.0F;
  p = p * z + 1.0F / 40320.0F;
  p = p * z - 1.0F / 720.0F;
  p = p * z + 1.0F / 24.0F;
  return 1.0F - 0.5F * z + z * z * p;
}

/// Sine and cosine of r + quadrant pi/2.
template <class Pair, class Real>
Pair by_quadrant(int quadrant, Real r) {
  const Real s = sin_series(r);
  const Real c = cos_series(r);
  switch (quadrant & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

/// atan t for t in [0, 1]: moved next to the nearest quarter c by atan t = atan c + atan((t - c) / (1 + t c)), where
/// the series to z^15 leaves less than 3e-17.
double atan_unit(double t) {
  constexpr double kAtanQuarters[5] = {0.0, 0.24497866312686415417, 0.46364760900080611621, 0.64350110879328438680,
                                       0.78539816339744830962};
  const int quarter = static_cast<int>(t * 4.0 + 0.5);
  const double c = 0.25 * quarter;
  const double r = (t - c) / (1.0 + t * c);
  const double z = r * r;
  double p = -1.0 / 15.0;
  p = p * z + 1.0 / 13.0;
  p = p * z - 1.0 / 11.0;
  p = p * z + 1.0 / 9.0;
  p = p * z - 1.0 / 7.0;
  p = p * z + 1.0 / 5.0;
  p = p * z - 1.0 / 3.0;
  return kAtanQuarters[quarter] + (r + r * z * p);
}

}  // namespace

SinCos sincos(double x) {
  if (!(std::fabs(x) <= 1e6)) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    return {nan, nan};
  }
  const double k = std::floor(x * (1.0 / kHalfPi) + 0.5);
  const double r = ((x - k * kHalfPi1) - k * kHalfPi2) - k * kHalfPi3;
  return by_quadrant<SinCos>(static_cast<int>(k), r);
}

SinCosF sincos(float x) {
  if (!(std::fabs(x) <= 1e3F)) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    return {nan, nan};
  }
  // pi/2 in three parts, the first two of 11 bits: k has at most 10.
  constexpr float part1 = 0x1.92p+0F;
  constexpr float part2 = 0x1.fb4p-12F;
  constexpr float part3 = 0x1.4442d2p-24F;
  const float k = std::floor(x * 0.636619772F + 0.5F);
  const float r = ((x - k * part1) - k * part2) - k * part3;
  return by_quadrant<SinCosF>(static_cast<int>(k), r);
}

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const double ax = std::fabs(x);
  const double ay = std::fabs(y);
  double angle = 0.0;
  if (ax == 0.0 && ay == 0.0) {
    return 0.0;
  }
  if (ay <= ax) {
    angle = std::isinf(ay) ? kPi / 4 : atan_unit(ay / ax);
  } else {
    angle = kHalfPi - atan_unit(ax / ay);
  }
  if (x < 0.0) {
    angle = kPi - angle;
  }
  return y < 0.0 ? -angle : angle;
}

double exp(double x) {
  if (std::isnan(x)) {
    return x;
  }
  if (x > 709.78) {
    return std::numeric_limits<double>::infinity();
  }
  if (x < -745.0) {
    return 0.0;
  }
  const double k = std::floor(x * 1.44269504088896340736 + 0.5);
  const double r = (x - k * kLn2Hi) - k * kLn2Lo;
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
  const double e = 1.0 + (r + r * r * p);
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
  // ln m = 2 artanh s, |s| <= 0.172; the series to s^21 leaves less than 1e-18.
  const double s = (m - 1.0) / (m + 1.0);
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
  const double series = 2.0 * (s + s * z * p);
  return k * kLn2Hi + (series + k * kLn2Lo);
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
