#include "mellin/core/random.hpp"

#include "mellin/core/math.hpp"

namespace mellin {

std::uint64_t mix64(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31U);
}

std::uint64_t Random::bits() { return mix64(key_ + mix64(counter_++)); }

double Random::uniform() { return static_cast<double>(bits() >> 11U) * 0x1p-53; }

double Random::normal() {
  const double radius = sqrt(-2.0 * log(1.0 - uniform()));
  return radius * sincos(kTwoPi * uniform()).cos;
}

}  // namespace mellin
