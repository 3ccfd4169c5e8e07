// Thickening and halving in one sweep, over whatever a pixel is read from.
#pragma once

#include <algorithm>
#include <cstddef>

namespace mellin {

/// Row `row` of the picture of half the side: each pixel the mean of four pixels thickened by 3 x 3. `read(column,
/// row)` gives a pixel of the full side. It is called at columns ahead of twice the one that is written, and at rows
/// ahead of half the one that is written, so that `out` may lie where the pixels are read from. Returns the row's
/// maximum.
template <class Read>
float thicken_and_halve_row(const Read& read, std::size_t side, std::size_t row, float* out) {
  // The thickened rows 2 row and 2 row + 1 need the rows above and below them; beyond the border there is nothing.
  const std::size_t middle = 2 * row;
  const std::size_t above = middle == 0 ? 0 : middle - 1;
  const std::size_t below = std::min(middle + 2, side - 1);
  struct Pair {
    float upper;
    float lower;
  };
  const auto column_maxima = [&](std::size_t column) {
    const float core = std::max(read(column, middle), read(column, middle + 1));
    return Pair{std::max(core, read(column, above)), std::max(core, read(column, below))};
  };
  float largest = 0.0F;
  Pair left = column_maxima(0);
  Pair first = left;
  for (std::size_t i = 0; i < side / 2; ++i) {
    const Pair second = column_maxima(2 * i + 1);
    const Pair right = 2 * i + 2 < side ? column_maxima(2 * i + 2) : second;
    const float core_upper = std::max(first.upper, second.upper);
    const float core_lower = std::max(first.lower, second.lower);
    const float sum = (std::max(core_upper, left.upper) + std::max(core_upper, right.upper)) +
                      (std::max(core_lower, left.lower) + std::max(core_lower, right.lower));
    out[i] = 0.25F * sum;
    largest = std::max(largest, out[i]);
    left = second;
    first = right;
  }
  return largest;
}

}  // namespace mellin
