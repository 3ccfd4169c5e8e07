#include "mellin/mapping/live_grid.hpp"

#include <cstring>

namespace mellin {
namespace {

constexpr int kReach = 2;  // cells over which the field falls off

/// The field by squared distance and solidity.
struct FieldValues {
  std::uint8_t of[9][16] = {};
};
constexpr FieldValues field_values() {
  // round(255 exp(-d^2 / (2 1.5^2))) for d^2 = dx^2 + dy^2.
  constexpr std::uint8_t kFallOff[9] = {255, 204, 164, 0, 105, 84, 0, 0, 43};
  FieldValues values;
  for (unsigned d2 = 0; d2 < 9; ++d2) {
    for (unsigned solidity = 0; solidity < 16; ++solidity) {
      values.of[d2][solidity] = static_cast<std::uint8_t>(kFallOff[d2] * solidity / 15U);
    }
  }
  return values;
}
constexpr FieldValues kFieldValues = field_values();

}  // namespace

std::uint8_t field_value(std::uint8_t solidity, int dx, int dy) { return kFieldValues.of[dx * dx + dy * dy][solidity]; }

LiveGrid::LiveGrid(const Memory& memory, std::size_t index, std::uint16_t side, float cell_m)
    : marks_(memory.marks), cell_m_(cell_m) {
  const std::size_t cells = std::size_t{side} * side;
  CountingGrid::Memory counts;
  if (memory.marks.empty()) {
    counts.cells = memory.counts.cells.subspan(index * cells, cells);
  } else {
    counts.small_cells = memory.counts.small_cells.subspan(index * cells, cells);
  }
  grid_ = CountingGrid(counts, side);
  field_ = memory.field.subspan(index * cells, cells);
}

void LiveGrid::reset(const Pose2& centre) {
  const std::int32_t half = grid_.side() / 2;
  grid_.reset(cell_of(centre.x, cell_m_) - half, cell_of(centre.y, cell_m_) - half);
  for (std::uint8_t& value : field_) {
    value = 0;
  }
}

std::int32_t LiveGrid::off_centre(const Pose2& point) const {
  const CellRect window = grid_.window();
  const std::int32_t half = grid_.side() / 2;
  const std::int32_t dc = cell_of(point.x, cell_m_) - (window.column_min + half);
  const std::int32_t dr = cell_of(point.y, cell_m_) - (window.row_min + half);
  const std::int32_t ac = dc < 0 ? -dc : dc;
  const std::int32_t ar = dr < 0 ? -dr : dr;
  return ac > ar ? ac : ar;
}

void LiveGrid::roll_to(const Pose2& centre) {
  const CellRect old = grid_.window();
  const std::int32_t half = grid_.side() / 2;
  grid_.roll_to(cell_of(centre.x, cell_m_) - half, cell_of(centre.y, cell_m_) - half);
  const CellRect now = grid_.window();
  const CellRect kept = intersection(old, now);
  if (kept.empty()) {
    for (std::uint8_t& value : field_) {
      value = 0;
    }
    return;
  }
  // Cells that entered, and those whose neighbourhood changed: all but the kept ones that lie deeper than the reach
  // within both windows. A side that did not move has no such margin.
  const CellRect same{kept.column_min + (old.column_min == now.column_min ? 0 : kReach),
                      kept.row_min + (old.row_min == now.row_min ? 0 : kReach),
                      kept.column_end - (old.column_min == now.column_min ? 0 : kReach),
                      kept.row_end - (old.row_min == now.row_min ? 0 : kReach)};
  recompute({now.column_min, now.row_min, now.column_end, same.row_min});
  recompute({now.column_min, same.row_end, now.column_end, now.row_end});
  recompute({now.column_min, same.row_min, same.column_min, same.row_end});
  recompute({same.column_end, same.row_min, now.column_end, same.row_end});
}

void LiveGrid::recompute(const CellRect& rect) {
  const CellRect inside = intersection(rect, grid_.window());
  for (std::int32_t row = inside.row_min; row < inside.row_end; ++row) {
    for (std::int32_t column = inside.column_min; column < inside.column_end; ++column) {
      field_[grid_.index(column, row)] = 0;
    }
  }
  if (inside.empty()) {
    return;
  }
  const CellRect sources = intersection(
      {inside.column_min - kReach, inside.row_min - kReach, inside.column_end + kReach, inside.row_end + kReach},
      grid_.window());
  for (std::int32_t row = sources.row_min; row < sources.row_end; ++row) {
    for (std::int32_t column = sources.column_min; column < sources.column_end; ++column) {
      if (grid_.at(column, row).hits != 0) {
        spread(column, row, inside);
      }
    }
  }
}

/// Raises the field round a cell, within `rect`, to what the cell's solidity makes of it.
void LiveGrid::spread(std::int32_t column, std::int32_t row, const CellRect& rect) {
  const std::uint8_t solid = solidity(grid_.at(column, row));
  for (int dy = -kReach; dy <= kReach; ++dy) {
    for (int dx = -kReach; dx <= kReach; ++dx) {
      if (rect.contains(column + dx, row + dy)) {
        std::uint8_t& value = field_[grid_.index(column + dx, row + dy)];
        const std::uint8_t now = field_value(solid, dx, dy);
        value = now > value ? now : value;
      }
    }
  }
}

/// recomputed() where the neighbourhood lies in memory without a break.
std::uint8_t LiveGrid::recomputed_unbroken(std::size_t index) const {
  std::uint8_t best = 0;
  for (int dy = -kReach; dy <= kReach; ++dy) {
    const std::ptrdiff_t line = static_cast<std::ptrdiff_t>(index) + dy * grid_.side();
    for (int dx = -kReach; dx <= kReach; ++dx) {
      const CellCount cell = grid_.cell(static_cast<std::size_t>(line + dx));
      if (cell.hits != 0) {
        const std::uint8_t value = field_value(solidity(cell), dx, dy);
        best = value > best ? value : best;
      }
    }
  }
  return best;
}

std::uint8_t LiveGrid::recomputed(std::int32_t column, std::int32_t row) const {
  if (grid_.unbroken(column, row, kReach)) {
    return recomputed_unbroken(grid_.index(column, row));
  }
  const CellRect window = grid_.window();
  std::uint8_t best = 0;
  for (int dy = -kReach; dy <= kReach; ++dy) {
    for (int dx = -kReach; dx <= kReach; ++dx) {
      if (window.contains(column + dx, row + dy)) {
        const std::uint8_t value = field_value(solidity(grid_.at(column + dx, row + dy)), dx, dy);
        best = value > best ? value : best;
      }
    }
  }
  return best;
}

void LiveGrid::solidity_changed(std::int32_t column, std::int32_t row, std::uint8_t before, std::uint8_t after) {
  const CellRect window = grid_.window();
  for (int dy = -kReach; dy <= kReach; ++dy) {
    for (int dx = -kReach; dx <= kReach; ++dx) {
      if (!window.contains(column + dx, row + dy)) {
        continue;
      }
      std::uint8_t& value = field_[grid_.index(column + dx, row + dy)];
      const std::uint8_t now = field_value(after, dx, dy);
      if (now >= value) {
        value = now;
      } else if (before > after && value == field_value(before, dx, dy)) {
        value = recomputed(column + dx, row + dy);  // this cell may have been the nearest solid one
      }
    }
  }
}

template <int kSign>
void LiveGrid::count_cell(std::int32_t column, std::int32_t row, bool hit) {
  const std::size_t index = grid_.index(column, row);
  CellCount cell = grid_.cell(index);
  const std::uint8_t before = solidity(cell);
  cell.observations = static_cast<std::uint16_t>(cell.observations + kSign);
  cell.hits = static_cast<std::uint16_t>(cell.hits + (hit ? kSign : 0));
  grid_.set_cell(index, cell);
  const std::uint8_t after = solidity(cell);
  if (after != before) {
    solidity_changed(column, row, before, after);
  }
}

/// Each beam counts.
template <int kSign>
void LiveGrid::count(const ScanMemory& scans, std::uint32_t number, const Pose2& pose, const CellRect& rect) {
  const CellRect inside = intersection(rect, grid_.window());
  scans.visit_rays(number, grid_pose(pose, cell_m_), cell_m_, [&](const Ray& ray) {
    visit_ray(ray, inside,
              [&](std::int32_t column, std::int32_t row, bool hit) { count_cell<kSign>(column, row, hit); });
  });
}

/// Marks a cell; false where it was marked already.
bool LiveGrid::mark(std::int32_t column, std::int32_t row) {
  const std::size_t index = grid_.index(column, row);
  const auto bit = static_cast<std::uint8_t>(1U << (index % 8));
  std::uint8_t& byte = marks_[index / 8];
  const bool first = (byte & bit) == 0;
  byte = static_cast<std::uint8_t>(byte | bit);
  return first;
}

/// Each cell counts once: as hit where any beam ends in it, else as crossed. What a cell counts depends on the scan and
/// its pose alone, not on `rect`, so that what was added is removed even when the window has cut the rectangle.
template <int kSign>
void LiveGrid::count_once(const ScanMemory& scans, std::uint32_t number, const Pose2& pose, const CellRect& rect) {
  const CellRect inside = intersection(rect, grid_.window());
  const GridPose from = grid_pose(pose, cell_m_);
  std::memset(marks_.data(), 0, marks_.size());
  scans.visit_rays(number, from, cell_m_, [&](const Ray& ray) {
    if (ray.hit && inside.contains(ray.column_to, ray.row_to) && mark(ray.column_to, ray.row_to)) {
      count_cell<kSign>(ray.column_to, ray.row_to, true);
    }
  });
  scans.visit_rays(number, from, cell_m_, [&](const Ray& ray) {
    visit_ray(ray, inside, [&](std::int32_t column, std::int32_t row, bool /*hit*/) {
      if (mark(column, row)) {
        count_cell<kSign>(column, row, false);
      }
    });
  });
}

void LiveGrid::add(const ScanMemory& scans, std::uint32_t number, const Pose2& pose, const CellRect& rect) {
  if (marks_.empty()) {
    count<1>(scans, number, pose, rect);
  } else {
    count_once<1>(scans, number, pose, rect);
  }
}

void LiveGrid::remove(const ScanMemory& scans, std::uint32_t number, const Pose2& pose, const CellRect& rect) {
  if (marks_.empty()) {
    count<-1>(scans, number, pose, rect);
  } else {
    count_once<-1>(scans, number, pose, rect);
  }
}

void LiveGrid::copy_from(const LiveGrid& other) {
  grid_.copy_from(other.grid_);
  std::memcpy(field_.data(), other.field_.data(), field_.size());
}

}  // namespace mellin
