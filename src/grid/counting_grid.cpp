#include "mellin/grid/counting_grid.hpp"

#include <cmath>

namespace mellin {

std::int32_t cell_of(double coordinate_m, float cell_m) {
  return static_cast<std::int32_t>(std::floor(coordinate_m / static_cast<double>(cell_m)));
}

void CountingGrid::reset(std::int32_t column_min, std::int32_t row_min) {
  for (CellCount& cell : cells_) {
    cell = CellCount{};
  }
  for (SmallCellCount& cell : small_cells_) {
    cell = SmallCellCount{};
  }
  column_min_ = column_min;
  row_min_ = row_min;
  column_base_ = base(column_min);
  row_base_ = base(row_min);
}

void CountingGrid::roll_to(std::int32_t column_min, std::int32_t row_min) {
  const CellRect old = window();
  const CellRect now{column_min, row_min, column_min + side_, row_min + side_};
  if (intersection(old, now).empty()) {
    reset(column_min, row_min);
    return;
  }
  column_min_ = column_min;
  row_min_ = row_min;
  column_base_ = base(column_min);
  row_base_ = base(row_min);
  // What enters: full rows below and above the old window, and the columns beside it.
  clear({now.column_min, now.row_min, now.column_end, old.row_min});
  clear({now.column_min, old.row_end, now.column_end, now.row_end});
  clear({now.column_min, now.row_min, old.column_min, now.row_end});
  clear({old.column_end, now.row_min, now.column_end, now.row_end});
}

void CountingGrid::copy_from(const CountingGrid& other) {
  assert(cells_.size() == other.cells_.size() && small_cells_.size() == other.small_cells_.size());
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    cells_[i] = other.cells_[i];
  }
  for (std::size_t i = 0; i < small_cells_.size(); ++i) {
    small_cells_[i] = other.small_cells_[i];
  }
  column_min_ = other.column_min_;
  row_min_ = other.row_min_;
  column_base_ = other.column_base_;
  row_base_ = other.row_base_;
}

void CountingGrid::clear(const CellRect& rect) {
  const CellRect inside = intersection(rect, window());
  for (std::int32_t row = inside.row_min; row < inside.row_end; ++row) {
    for (std::int32_t column = inside.column_min; column < inside.column_end; ++column) {
      set_cell(index(column, row), {});
    }
  }
}

}  // namespace mellin
