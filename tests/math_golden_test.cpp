// The elementary functions against values to some 50 digits, without long double, libm, heap or files: what the host
// and every target have to pass with the same bounds.
#include <doctest.h>

#include <cstdint>
#include <cstring>

#include "golden/math.hpp"
#include "mellin/core/math.hpp"

using namespace mellin;

namespace {

double as_double(std::uint64_t bits) {
  double value = 0.0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

float as_float(std::uint32_t bits) {
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

std::uint64_t to_bits(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// 2^(exponent of the exact value - `digits`): its unit in the last place; `high` is its nearest double, and `low` is
/// what that lacks.
double unit(double high, double low, std::uint64_t digits) {
  constexpr std::uint64_t kMantissa = 0xFFFFFFFFFFFFFU;
  std::uint64_t exponent = to_bits(high) >> 52U & 0x7FFU;
  if ((to_bits(high) & kMantissa) == 0 && high * low < 0.0) {
    --exponent;  // the exact value is in the binade below
  }
  return exponent > digits ? as_double((exponent - digits) << 52U) : as_double(1);
}

/// Error of a result, in units of the exact value's last place.
double error(double value, std::uint64_t high, std::uint64_t low) {
  const double difference = (value - as_double(high)) - as_double(low);
  const double ulps = difference / unit(as_double(high), as_double(low), 52);
  return ulps < 0.0 ? -ulps : ulps;
}

double error(float value, std::uint64_t exact) {
  const double ulps = (static_cast<double>(value) - as_double(exact)) / unit(as_double(exact), 0.0, 23);
  return ulps < 0.0 ? -ulps : ulps;
}

}  // namespace

TEST_CASE("sine and cosine in double: within 0.85 ulp of the golden values") {
  for (const golden::Value& v : golden::kSin) {
    CAPTURE(v.x);
    CHECK(error(sincos(as_double(v.x)).sin, v.high, v.low) < 0.85);
  }
  for (const golden::Value& v : golden::kCos) {
    CAPTURE(v.x);
    CHECK(error(sincos(as_double(v.x)).cos, v.high, v.low) < 0.85);
  }
}

TEST_CASE("sine and cosine in float: within 0.8 ulp of the golden values") {
  for (const golden::FloatValue& v : golden::kFloat) {
    CAPTURE(v.x);
    const SinCosF result = sincos(as_float(v.x));
    CHECK(error(result.sin, v.sin) < 0.8);
    CHECK(error(result.cos, v.cos) < 0.8);
  }
}

TEST_CASE("exp: within 0.8 ulp of the golden values") {
  for (const golden::Value& v : golden::kExp) {
    CAPTURE(v.x);
    CHECK(error(mellin::exp(as_double(v.x)), v.high, v.low) < 0.8);
  }
}

TEST_CASE("log: within 0.9 ulp of the golden values") {
  for (const golden::Value& v : golden::kLog) {
    CAPTURE(v.x);
    CHECK(error(mellin::log(as_double(v.x)), v.high, v.low) < 0.9);
  }
}

TEST_CASE("atan2: within 0.55 ulp of the golden values, in all quadrants and on the axes") {
  for (const golden::AngleValue& v : golden::kAtan2) {
    CAPTURE(v.y);
    CAPTURE(v.x);
    CHECK(error(mellin::atan2(as_double(v.y), as_double(v.x)), v.high, v.low) < 0.55);
  }
}
