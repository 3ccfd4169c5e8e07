// Peaks of cyclic correlations: where they are, and how high.
#pragma once

#include <cstddef>

#include "mellin/core/span.hpp"

namespace mellin {

/// Index i + offset in a cyclic line of `size`; |offset| <= size.
inline std::size_t cyclic(std::size_t i, int offset, std::size_t size) {
  return (i + size + static_cast<std::size_t>(static_cast<std::ptrdiff_t>(offset))) % size;
}

/// Whether line[i] is the highest among two neighbours on either side, so that one hump gives one peak.
bool is_peak(Span<const float> line, std::size_t i);

/// The highest of `count` values, or 0 where none is over it.
float highest(const float* values, std::size_t count);

}  // namespace mellin
