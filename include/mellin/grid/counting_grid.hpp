// The counting grid (paper, Section III-A): a cell holds how often beams crossed it and how often they ended in it.
// Counts are integers, so adding a scan and later removing it restores every cell exactly. The grid is a torus: it
// shows a square window of the unbounded world grid, and when the window moves only the cells that enter are cleared.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/grid/ray.hpp"

namespace mellin {

struct CellCount {
  std::uint16_t observations = 0;  ///< beams that crossed the cell or ended in it
  std::uint16_t hits = 0;          ///< beams that ended in it
};

/// The most that a cell can count. A configuration is valid only if (beams x remembered scans) stays within.
inline constexpr std::uint32_t kMaxCellCount = 65535;

/// The cell of the world grid that holds `coordinate_m`.
std::int32_t cell_of(double coordinate_m, float cell_m);

class CountingGrid {
 public:
  struct Memory {
    Span<CellCount> cells;
  };
  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t side, std::size_t grids = 1) {
    return {arena.template take<CellCount>(grids * side * side, Part::grid)};
  }

  CountingGrid() = default;
  /// `cells` has side * side elements.
  CountingGrid(Span<CellCount> cells, std::uint16_t side) : cells_(cells), side_(side) {}

  std::uint16_t side() const { return side_; }
  CellRect window() const { return {column_min_, row_min_, column_min_ + side_, row_min_ + side_}; }

  /// Forgets everything and shows the window that begins at the given cell.
  void reset(std::int32_t column_min, std::int32_t row_min);

  /// Moves the window; cells that stay inside keep their counts, cells that enter are empty. Cost: the cells that
  /// enter.
  void roll_to(std::int32_t column_min, std::int32_t row_min);

  /// Takes over the window of a grid of the same side; its cells are copied by the caller.
  void set_window_of(const CountingGrid& other) {
    column_min_ = other.column_min_;
    row_min_ = other.row_min_;
    column_base_ = other.column_base_;
    row_base_ = other.row_base_;
  }

  /// Requires window().contains(column, row).
  CellCount& at(std::int32_t column, std::int32_t row) { return cells_[index(column, row)]; }
  const CellCount& at(std::int32_t column, std::int32_t row) const { return cells_[index(column, row)]; }

  /// Where a cell of the window lies in memory; arrays that go with the grid use the same places.
  std::size_t index(std::int32_t column, std::int32_t row) const {
    assert(window().contains(column, row));
    return static_cast<std::size_t>(wrap(row - row_min_ + row_base_)) * side_ +
           static_cast<std::size_t>(wrap(column - column_min_ + column_base_));
  }

  /// Whether all cells up to `reach` columns and rows from (column, row) are in the window, and lie in memory without a
  /// break: cell (column + dx, row + dy) at index(column, row) + dy * side() + dx.
  bool unbroken(std::int32_t column, std::int32_t row, std::int32_t reach) const {
    const std::int32_t c = column - column_min_;
    const std::int32_t r = row - row_min_;
    const std::int32_t last = side_ - 1 - reach;
    if (c < reach || c > last || r < reach || r > last) {
      return false;
    }
    const std::int32_t cc = wrap(c + column_base_);
    const std::int32_t rr = wrap(r + row_base_);
    return cc >= reach && cc <= last && rr >= reach && rr <= last;
  }

  Span<CellCount> cells() { return cells_; }
  Span<const CellCount> cells() const { return cells_; }

 private:
  std::int32_t wrap(std::int32_t i) const { return i >= side_ ? i - side_ : i; }
  std::int32_t base(std::int32_t cell) const {
    const std::int32_t rest = cell % side_;
    return rest < 0 ? rest + side_ : rest;
  }
  void clear(const CellRect& rect);

  Span<CellCount> cells_;
  std::uint16_t side_ = 0;
  std::int32_t column_min_ = 0;
  std::int32_t row_min_ = 0;
  std::int32_t column_base_ = 0;  ///< column_min modulo side: where the window's first column lies in memory
  std::int32_t row_base_ = 0;
};

/// The byte of a submap (grid/submap.hpp) for a cell's counts.
inline std::uint8_t submap_cell(const CellCount& cell) {
  if (cell.observations == 0) {
    return 255;
  }
  return static_cast<std::uint8_t>((254U * 2U * cell.hits + cell.observations) / (2U * cell.observations));
}

}  // namespace mellin
