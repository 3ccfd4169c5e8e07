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

/// The same in half the bytes, for grids in which a scan counts a cell once at most: a configuration is valid only if
/// the remembered scans stay within.
struct SmallCellCount {
  std::uint8_t observations = 0;  ///< scans of which a beam crossed the cell or ended in it
  std::uint8_t hits = 0;          ///< scans of which a beam ended in it
};
inline constexpr std::uint32_t kMaxSmallCellCount = 255;

/// The cell of the world grid that holds `coordinate_m`.
std::int32_t cell_of(double coordinate_m, float cell_m);

class CountingGrid {
 public:
  /// One of the two is empty.
  struct Memory {
    Span<CellCount> cells;
    Span<SmallCellCount> small_cells;
  };
  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t side, std::size_t grids = 1, bool small = false) {
    const std::size_t count = grids * side * side;
    return {arena.template take<CellCount>(small ? 0 : count, Part::grid),
            arena.template take<SmallCellCount>(small ? count : 0, Part::grid)};
  }

  CountingGrid() = default;
  /// side * side elements in one of the spans.
  CountingGrid(const Memory& memory, std::uint16_t side)
      : cells_(memory.cells), small_cells_(memory.small_cells), side_(side) {}

  std::uint16_t side() const { return side_; }
  CellRect window() const { return {column_min_, row_min_, column_min_ + side_, row_min_ + side_}; }

  /// Forgets everything and shows the window that begins at the given cell.
  void reset(std::int32_t column_min, std::int32_t row_min);

  /// Moves the window; cells that stay inside keep their counts, cells that enter are empty. Cost: the cells that
  /// enter.
  void roll_to(std::int32_t column_min, std::int32_t row_min);

  /// Makes this grid equal to another one of the same side and kind.
  void copy_from(const CountingGrid& other);

  /// Requires window().contains(column, row).
  CellCount at(std::int32_t column, std::int32_t row) const { return cell(index(column, row)); }

  /// By the place in memory that index() gives.
  CellCount cell(std::size_t at) const {
    return small_cells_.empty() ? cells_[at] : CellCount{small_cells_[at].observations, small_cells_[at].hits};
  }
  void set_cell(std::size_t at, const CellCount& count) {
    if (small_cells_.empty()) {
      cells_[at] = count;
    } else {
      assert(count.observations <= kMaxSmallCellCount);
      small_cells_[at] = {static_cast<std::uint8_t>(count.observations), static_cast<std::uint8_t>(count.hits)};
    }
  }

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

 private:
  std::int32_t wrap(std::int32_t i) const { return i >= side_ ? i - side_ : i; }
  std::int32_t base(std::int32_t cell) const {
    const std::int32_t rest = cell % side_;
    return rest < 0 ? rest + side_ : rest;
  }
  void clear(const CellRect& rect);

  Span<CellCount> cells_;
  Span<SmallCellCount> small_cells_;
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
