// Counts by cell of the world grid, for brute-force references: dense, since targets have no C++ library that
// could keep a tree.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mellin/grid/counting_grid.hpp"

namespace mellin::test {

class CellMap {
 public:
  /// The cells of a rectangle; counts elsewhere are dropped.
  explicit CellMap(const CellRect& rect)
      : rect_(rect),
        cells_(static_cast<std::size_t>(rect.column_end - rect.column_min) *
               static_cast<std::size_t>(rect.row_end - rect.row_min)) {}

  /// Counts a beam.
  void count(std::int32_t column, std::int32_t row, bool hit) {
    if (rect_.contains(column, row)) {
      CellCount& cell = cells_[index(column, row)];
      ++cell.observations;
      cell.hits = static_cast<decltype(cell.hits)>(cell.hits + (hit ? 1 : 0));
    }
  }
  /// Zeros where nothing was counted.
  CellCount at(std::int32_t column, std::int32_t row) const {
    return rect_.contains(column, row) ? cells_[index(column, row)] : CellCount{};
  }

 private:
  std::size_t index(std::int32_t column, std::int32_t row) const {
    return static_cast<std::size_t>(row - rect_.row_min) *
               static_cast<std::size_t>(rect_.column_end - rect_.column_min) +
           static_cast<std::size_t>(column - rect_.column_min);
  }

  CellRect rect_;
  std::vector<CellCount> cells_;
};

}  // namespace mellin::test
