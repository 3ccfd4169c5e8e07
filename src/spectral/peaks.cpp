#include "spectral/peaks.hpp"

#include <algorithm>

#include "mellin/spectral/fft2.hpp"

namespace mellin {

bool is_peak(Span<const float> line, std::size_t i) {
  constexpr std::size_t kNeighbours = 2;
  for (std::size_t k = 1; k <= kNeighbours; ++k) {
    const int offset = static_cast<int>(k);
    // Of equal neighbours the first is the peak.
    if (line[i] <= line[cyclic(i, -offset, line.size())] || line[i] < line[cyclic(i, offset, line.size())]) {
      return false;
    }
  }
  return true;
}

float highest(const float* values, std::size_t count) {
  // Lanes without order between them, so that the compiler may take them side by side. Sides are even.
  float lanes[2 * Fft2::kBlock] = {};
  constexpr std::size_t kLanes = 2 * Fft2::kBlock;
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      lanes[k] = values[i + k] > lanes[k] ? values[i + k] : lanes[k];
    }
  }
  float result = 0.0F;
  for (; i < count; ++i) {
    result = std::max(result, values[i]);
  }
  for (const float lane : lanes) {
    result = std::max(result, lane);
  }
  return result;
}

}  // namespace mellin
