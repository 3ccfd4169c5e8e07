#include "host/submap_rendering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mellin::host {
namespace {

struct Point {
  double x;
  double y;
};

bool hit_something(const PosedScan& scan, std::size_t beam) {
  const auto range = static_cast<double>(scan.ranges_m[beam]);
  return std::isfinite(range) && range > 0.0 && range < scan.max_m;
}

/// End point of a beam in the frame that frame_T_laser leads to.
Point end_point(const PosedScan& scan, std::size_t beam, const Pose2& frame_T_laser) {
  const double angle = frame_T_laser.theta + scan.first_rad + static_cast<double>(beam) * scan.step_rad;
  const auto range = static_cast<double>(scan.ranges_m[beam]);
  return {frame_T_laser.x + range * std::cos(angle), frame_T_laser.y + range * std::sin(angle)};
}

struct Counts {
  std::vector<std::uint32_t> hits;
  std::vector<std::uint32_t> observations;
  int side;

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(side) + static_cast<std::size_t>(column);
  }
  void observe(int column, int row, bool hit) {
    if (column < 0 || row < 0 || column >= side || row >= side) {
      return;
    }
    observations[index(column, row)] += 1;
    hits[index(column, row)] += hit ? 1 : 0;
  }
};

/// Amanatides and Woo 1987: every cell that the segment from `from` to `to` (cells) enters, the last one as hit.
void cast(Counts& counts, Point from, Point to) {
  int column = static_cast<int>(std::floor(from.x));
  int row = static_cast<int>(std::floor(from.y));
  const int last_column = static_cast<int>(std::floor(to.x));
  const int last_row = static_cast<int>(std::floor(to.y));
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  const int step_x = dx > 0.0 ? 1 : -1;
  const int step_y = dy > 0.0 ? 1 : -1;
  const double never = std::numeric_limits<double>::infinity();
  const double delta_x = dx != 0.0 ? std::fabs(1.0 / dx) : never;
  const double delta_y = dy != 0.0 ? std::fabs(1.0 / dy) : never;
  double next_x = dx != 0.0 ? (dx > 0.0 ? column + 1 - from.x : from.x - column) * delta_x : never;
  double next_y = dy != 0.0 ? (dy > 0.0 ? row + 1 - from.y : from.y - row) * delta_y : never;
  const int cells = std::abs(last_column - column) + std::abs(last_row - row);
  for (int i = 0; i < cells; ++i) {
    counts.observe(column, row, false);
    if (next_x < next_y) {
      next_x += delta_x;
      column += step_x;
    } else {
      next_y += delta_y;
      row += step_y;
    }
  }
  counts.observe(last_column, last_row, true);
}

}  // namespace

Pose2 centred_frame(const std::vector<PosedScan>& scans, double heading_rad) {
  const Pose2 axes{0.0, 0.0, heading_rad};
  const double infinity = std::numeric_limits<double>::infinity();
  Point low{infinity, infinity};
  Point high{-infinity, -infinity};
  for (const PosedScan& scan : scans) {
    const Pose2 axes_T_laser = between(axes, scan.world_T_laser);
    for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
      if (hit_something(scan, beam)) {
        const Point end = end_point(scan, beam, axes_T_laser);
        low = {std::min(low.x, end.x), std::min(low.y, end.y)};
        high = {std::max(high.x, end.x), std::max(high.y, end.y)};
      }
    }
  }
  return low.x <= high.x ? compose(axes, {0.5 * (low.x + high.x), 0.5 * (low.y + high.y), 0.0}) : axes;
}

RenderedSubmap render_submap(const std::vector<PosedScan>& scans, const Pose2& world_T_submap, std::uint16_t side,
                             float cell_m) {
  const std::size_t size = static_cast<std::size_t>(side) * side;
  Counts counts{std::vector<std::uint32_t>(size), std::vector<std::uint32_t>(size), side};
  const double half = 0.5 * side;
  const auto to_cells = [&](Point p) {
    return Point{p.x / static_cast<double>(cell_m) + half, p.y / static_cast<double>(cell_m) + half};
  };
  for (const PosedScan& scan : scans) {
    const Pose2 submap_T_laser = between(world_T_submap, scan.world_T_laser);
    const Point laser = to_cells({submap_T_laser.x, submap_T_laser.y});
    for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
      if (hit_something(scan, beam)) {
        cast(counts, laser, to_cells(end_point(scan, beam, submap_T_laser)));
      }
    }
  }
  RenderedSubmap submap{world_T_submap, side, cell_m, std::vector<std::uint8_t>(size, kUnobserved)};
  for (std::size_t i = 0; i < size; ++i) {
    if (counts.observations[i] > 0) {
      submap.cells[i] =
          static_cast<std::uint8_t>((254 * counts.hits[i] + counts.observations[i] / 2) / counts.observations[i]);
    }
  }
  return submap;
}

}  // namespace mellin::host
