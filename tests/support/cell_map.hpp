// Counts by cell of the world grid, for brute-force references: a dense square, since tests stay in rooms and targets
// have no C++ library that could keep a tree.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mellin/grid/counting_grid.hpp"

namespace mellin::test {

class CellMap {
 public:
  /// Cells from -reach to reach - 1 in both directions.
  explicit CellMap(std::int32_t reach = 400)
      : reach_(reach), cells_(static_cast<std::size_t>(4 * reach) * static_cast<std::size_t>(reach)) {}

  /// Counts a beam. Requires the cell to be in reach.
  void count(std::int32_t column, std::int32_t row, bool hit) {
    CellCount& cell = cells_.at(index(column, row));
    ++cell.observations;
    cell.hits = static_cast<decltype(cell.hits)>(cell.hits + (hit ? 1 : 0));
  }
  /// Zeros where nothing was counted.
  CellCount at(std::int32_t column, std::int32_t row) const {
    return inside(column) && inside(row) ? cells_[index(column, row)] : CellCount{};
  }

 private:
  bool inside(std::int32_t i) const { return i >= -reach_ && i < reach_; }
  std::size_t index(std::int32_t column, std::int32_t row) const {
    return static_cast<std::size_t>(row + reach_) * static_cast<std::size_t>(2 * reach_) +
           static_cast<std::size_t>(column + reach_);
  }

  std::int32_t reach_;
  std::vector<CellCount> cells_;
};

}  // namespace mellin::test
