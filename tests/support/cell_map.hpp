// Counts by cell of the world grid, for brute-force references: dense, since targets have no C++ library that
// could keep a tree.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mellin/grid/counting_grid.hpp"

namespace mellin::test {

class CellMap {
 public:
  /// The cells of a rectangle; counts elsewhere are dropped.
  explicit CellMap(const CellRect& rect)
      : rect_(rect), cells_(length(rect.column_min, rect.column_end) * length(rect.row_min, rect.row_end)) {}

  /// Counts a beam.
  void count(std::int32_t column, std::int32_t row, bool hit) {
    if (rect_.contains(column, row)) {
      CellCount& cell = cells_[index(column, row)];
      ++cell.observations;
      cell.hits = static_cast<std::uint16_t>(cell.hits + (hit ? 1 : 0));
    }
  }
  /// Adds another's counts; with `once`, each of its cells counts as one observation, and as one hit at most.
  void add(const CellMap& other, bool once) {
    for (std::int32_t row = rect_.row_min; row < rect_.row_end; ++row) {
      for (std::int32_t column = rect_.column_min; column < rect_.column_end; ++column) {
        const CellCount more = other.at(column, row);
        CellCount& sum = cells_[index(column, row)];
        const int seen = once ? std::min<int>(more.observations, 1) : more.observations;
        const int hits = once ? std::min<int>(more.hits, 1) : more.hits;
        sum.observations = static_cast<std::uint16_t>(sum.observations + seen);
        sum.hits = static_cast<std::uint16_t>(sum.hits + hits);
      }
    }
  }
  /// Zeros where nothing was counted.
  CellCount at(std::int32_t column, std::int32_t row) const {
    return rect_.contains(column, row) ? cells_[index(column, row)] : CellCount{};
  }

 private:
  static std::size_t length(std::int32_t from, std::int32_t end) {
    return static_cast<std::size_t>(std::max(end - from, std::int32_t{0}));
  }
  std::size_t index(std::int32_t column, std::int32_t row) const {
    return static_cast<std::size_t>(row - rect_.row_min) *
               static_cast<std::size_t>(rect_.column_end - rect_.column_min) +
           static_cast<std::size_t>(column - rect_.column_min);
  }

  CellRect rect_;
  std::vector<CellCount> cells_;
};

}  // namespace mellin::test
