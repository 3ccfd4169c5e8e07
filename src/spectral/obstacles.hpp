// What alignment and its distance field take for an obstacle, and where exactly it lies.
#pragma once

#include <algorithm>
#include <cstdint>

#include "mellin/core/se2.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

/// Whether a cell has at least `from` (at least 1) 254ths of hits; one comparison, since unobserved cells are 255.
inline bool is_obstacle(std::uint8_t cell, std::uint8_t from) {
  return static_cast<std::uint8_t>(cell - from) < static_cast<std::uint8_t>(kUnobserved - from);
}

/// Centre of mass of the hits in the 3 x 3 cells round an obstacle, in cells from the grid's corner.
inline Point2f centre_of_hits(const GridView& grid, int column, int row) {
  std::int32_t weight = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;
  const int last = grid.side - 1;
  for (int r = std::max(0, row - 1); r <= std::min(last, row + 1); ++r) {
    const std::uint8_t* const cells = grid.cells.data() + static_cast<std::ptrdiff_t>(r) * grid.side;
    for (int c = std::max(0, column - 1); c <= std::min(last, column + 1); ++c) {
      const std::int32_t w = cells[c] == kUnobserved ? 0 : cells[c];
      weight += w;
      x += w * (c - column);
      y += w * (r - row);
    }
  }
  const float scale = 1.0F / static_cast<float>(weight);
  return {static_cast<float>(column) + 0.5F + static_cast<float>(x) * scale,
          static_cast<float>(row) + 0.5F + static_cast<float>(y) * scale};
}

}  // namespace mellin
