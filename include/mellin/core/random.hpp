// Random numbers by counter: the n-th number of a stream is a function of (seed, stream, n) alone, so draws do not
// depend on the order in which parts of the program ask for them (Salmon et al. 2011 call these counter-based).
#pragma once

#include <cstdint>

namespace mellin {

/// A bijective scrambling of 64 bits (Stafford's variant 13 of the MurmurHash3 finaliser).
std::uint64_t mix64(std::uint64_t x);

class Random {
 public:
  Random() = default;
  Random(std::uint64_t seed, std::uint64_t stream) : key_(mix64(seed ^ mix64(stream))) {}

  /// 64 equally distributed bits.
  std::uint64_t bits();
  /// Uniform in [0, 1).
  double uniform();
  /// Normal with mean 0 and deviation 1 (Box and Muller 1958; two draws a call).
  double normal();

 private:
  std::uint64_t key_ = 0;
  std::uint64_t counter_ = 0;
};

}  // namespace mellin
