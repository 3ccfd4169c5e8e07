#include "host/cell_counts.hpp"

#include <cmath>
#include <limits>

namespace mellin::host {

bool hit_something(const PosedScan& scan, std::size_t beam) {
  const auto range = static_cast<double>(scan.ranges_m[beam]);
  return std::isfinite(range) && range > 0.0 && range < scan.max_m;
}

PointM end_point(const PosedScan& scan, std::size_t beam, const Pose2& frame_T_laser) {
  const double angle = frame_T_laser.theta + scan.first_rad + static_cast<double>(beam) * scan.step_rad;
  const auto range = static_cast<double>(scan.ranges_m[beam]);
  return {frame_T_laser.x + range * std::cos(angle), frame_T_laser.y + range * std::sin(angle)};
}

CellCounts::CellCounts(std::size_t width, std::size_t height, double cell_m, double first_column, double first_row)
    : width_(width),
      height_(height),
      cell_m_(cell_m),
      first_column_(first_column),
      first_row_(first_row),
      hits_(width * height),
      observations_(width * height) {}

void CellCounts::add(const PosedScan& scan, const Pose2& frame_T_laser) {
  const PointM laser = to_cells({frame_T_laser.x, frame_T_laser.y});
  for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
    if (hit_something(scan, beam)) {
      cast(laser, to_cells(end_point(scan, beam, frame_T_laser)));
    }
  }
}

PointM CellCounts::to_cells(const PointM& p) const {
  return {p.x / cell_m_ - first_column_, p.y / cell_m_ - first_row_};
}

void CellCounts::observe(std::int64_t column, std::int64_t row, bool hit) {
  if (column < 0 || row < 0 || column >= static_cast<std::int64_t>(width_) ||
      row >= static_cast<std::int64_t>(height_)) {
    return;
  }
  const std::size_t cell = static_cast<std::size_t>(row) * width_ + static_cast<std::size_t>(column);
  observations_[cell] += 1;
  hits_[cell] += hit ? 1 : 0;
}

/// Amanatides and Woo 1987: every cell that the segment from `from` to `to` (cells) enters, the last one as hit.
void CellCounts::cast(const PointM& from, const PointM& to) {
  auto column = static_cast<std::int64_t>(std::floor(from.x));
  auto row = static_cast<std::int64_t>(std::floor(from.y));
  const auto last_column = static_cast<std::int64_t>(std::floor(to.x));
  const auto last_row = static_cast<std::int64_t>(std::floor(to.y));
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  const int step_x = dx > 0.0 ? 1 : -1;
  const int step_y = dy > 0.0 ? 1 : -1;
  const double never = std::numeric_limits<double>::infinity();
  const double delta_x = dx != 0.0 ? std::fabs(1.0 / dx) : never;
  const double delta_y = dy != 0.0 ? std::fabs(1.0 / dy) : never;
  const auto to_border = [](double at, std::int64_t cell, double d) {
    return d > 0.0 ? static_cast<double>(cell + 1) - at : at - static_cast<double>(cell);
  };
  double next_x = dx != 0.0 ? to_border(from.x, column, dx) * delta_x : never;
  double next_y = dy != 0.0 ? to_border(from.y, row, dy) * delta_y : never;
  const std::int64_t cells = std::abs(last_column - column) + std::abs(last_row - row);
  for (std::int64_t i = 0; i < cells; ++i) {
    observe(column, row, false);
    if (next_x < next_y) {
      next_x += delta_x;
      column += step_x;
    } else {
      next_y += delta_y;
      row += step_y;
    }
  }
  observe(last_column, last_row, true);
}

}  // namespace mellin::host
