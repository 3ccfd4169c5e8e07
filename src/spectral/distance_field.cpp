#include "mellin/spectral/distance_field.hpp"

#include <algorithm>
#include <cmath>

#include "spectral/obstacles.hpp"

namespace mellin {
namespace {

constexpr std::uint8_t kNone = 255;  // of a count of rows: no obstacle within reach along the column

/// Rows to the nearest obstacle on one side, from the count of the row before.
std::uint8_t counted(bool obstacle, std::uint8_t before, std::uint8_t most) {
  const auto next = static_cast<std::uint8_t>(before + 1);
  return obstacle ? std::uint8_t{0} : (before >= most ? kNone : next);
}

/// Squared distance from `cell` to the obstacle that a run stands for; below 2^32 for any side.
std::uint32_t squared_distance(std::int32_t cell, std::int32_t column, std::int32_t rows_off) {
  const auto columns = static_cast<std::uint32_t>(cell < column ? column - cell : cell - column);
  return columns * columns + static_cast<std::uint32_t>(rows_off * rows_off);
}

}  // namespace

void DistanceField::begin(const GridView& grid, float reach_m, std::uint8_t occupied_from, Span<std::uint8_t> out,
                          const Memory& memory) {
  grid_ = grid;
  out_ = out;
  memory_ = memory;
  occupied_from_ = occupied_from;
  reach_cells_ = std::min(reach_m / grid.cell_m, kMostCellsOfFieldReach);
  units_a_cell_ = kFieldUnitsAtReach * (grid.cell_m / reach_m);
  most_rows_ = static_cast<std::uint8_t>(reach_cells_ + 1.0F);  // the centre of mass may lie in the next cell
  row_ = 0;
  restart_column_counts();
}

void DistanceField::restart_column_counts() { std::fill(memory_.below.begin(), memory_.below.end(), kNone); }

bool DistanceField::step(std::uint32_t rows) {
  const std::uint32_t side = grid_.side;
  for (std::uint32_t i = 0; i < rows && row_ < 2 * side; ++i) {
    if (row_ < side) {
      sweep_down(row_);
    } else {
      if (row_ == side) {
        restart_column_counts();
      }
      sweep_up(2 * side - 1 - row_);
    }
    ++row_;
  }
  return row_ == 2 * side;
}

/// Writes the rows to the nearest obstacle among the rows up to this one.
void DistanceField::sweep_down(std::uint32_t row) {
  const std::size_t side = grid_.side;
  const std::uint8_t from = occupied_from_;
  const std::uint8_t most = most_rows_;
  const std::uint8_t* const cells = grid_.cells.data() + row * side;
  const std::uint8_t* const before = row == 0 ? memory_.below.data() : out_.data() + (row - 1) * side;
  std::uint8_t* const counts = out_.data() + row * side;
  for (std::size_t c = 0; c < side; ++c) {
    counts[c] = counted(is_obstacle(cells[c], from), before[c], most);
  }
}

/// Counts the rows to the nearest obstacle from this row on, and replaces the row's counts by distances.
void DistanceField::sweep_up(std::uint32_t row) {
  const std::size_t side = grid_.side;
  const std::uint8_t from = occupied_from_;
  const std::uint8_t most = most_rows_;
  const std::uint8_t* const cells = grid_.cells.data() + row * side;
  std::uint8_t* const below = memory_.below.data();
  for (std::size_t c = 0; c < side; ++c) {
    below[c] = counted(is_obstacle(cells[c], from), below[c], most);
  }
  write_row(row, envelope(out_.data() + row * side));
}

/// The lower envelope of the parabolas over a row as runs; returns how many.
std::size_t DistanceField::envelope(const std::uint8_t* above) {
  const std::int32_t side = grid_.side;
  const std::uint8_t* const below = memory_.below.data();
  Run* const runs = memory_.runs.data();
  std::size_t count = 0;
  for (std::int32_t column = 0; column < side; ++column) {
    const std::uint8_t nearest = std::min(above[column], below[column]);
    if (nearest == kNone) {
      continue;
    }
    const std::int32_t rows_off = above[column] <= below[column] ? -std::int32_t{nearest} : std::int32_t{nearest};
    std::int32_t first = 0;
    for (; count > 0; --count) {
      const Run& last = runs[count - 1];
      const std::uint32_t here = squared_distance(last.first, column, rows_off);
      const std::uint32_t there = squared_distance(last.first, last.column, last.rows_off);
      if (here >= there) {
        // The first cell that is nearer to this obstacle than to the last one.
        const auto apart = static_cast<std::uint32_t>(column - std::int32_t{last.column});
        first = last.first + static_cast<std::int32_t>((here - there) / (2 * apart)) + 1;
        break;
      }
    }
    if (first >= side) {
      continue;
    }
    runs[count++] = {static_cast<std::uint16_t>(column), static_cast<std::uint16_t>(first),
                     static_cast<std::int16_t>(rows_off)};
  }
  return count;
}

void DistanceField::write_row(std::uint32_t row, std::size_t runs) {
  const std::int32_t side = grid_.side;
  std::uint8_t* const distances = out_.data() + static_cast<std::size_t>(row) * grid_.side;
  std::fill(distances, distances + side, kFieldBeyond);
  const auto reach = static_cast<std::int32_t>(reach_cells_ + 1.0F);
  constexpr float kEnd = kFieldUnitsAtReach + 0.5F;
  for (std::size_t i = 0; i < runs; ++i) {
    const Run& run = memory_.runs[i];
    const std::int32_t end = i + 1 < runs ? memory_.runs[i + 1].first : side;
    const std::int32_t from = std::max<std::int32_t>(run.first, run.column - reach);
    const std::int32_t to = std::min(end, run.column + reach + 1);
    if (from >= to) {
      continue;
    }
    const Point2f obstacle = centre_of_hits(grid_, run.column, static_cast<std::int32_t>(row) + run.rows_off);
    const float dy = (static_cast<float>(row) + 0.5F - obstacle.y) * units_a_cell_;
    for (std::int32_t c = from; c < to; ++c) {
      const float dx = (static_cast<float>(c) + 0.5F - obstacle.x) * units_a_cell_;
      const float squared = dx * dx + dy * dy;
      if (squared < kEnd * kEnd) {
        distances[c] = static_cast<std::uint8_t>(std::sqrt(squared) + 0.5F);
      }
    }
  }
}

}  // namespace mellin
