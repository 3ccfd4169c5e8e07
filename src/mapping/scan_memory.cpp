#include "mellin/mapping/scan_memory.hpp"

#include <cmath>

#include "mellin/grid/counting_grid.hpp"

namespace mellin {

GridPose grid_pose(const Pose2& grid_T_base, float cell_m) {
  GridPose out;
  out.column = cell_of(grid_T_base.x, cell_m);
  out.row = cell_of(grid_T_base.y, cell_m);
  const auto cell = static_cast<double>(cell_m);
  out.x_cells = static_cast<float>(grid_T_base.x / cell - out.column);
  out.y_cells = static_cast<float>(grid_T_base.y / cell - out.row);
  const SinCos r = sincos(grid_T_base.theta);
  out.sin = static_cast<float>(r.sin);
  out.cos = static_cast<float>(r.cos);
  return out;
}

StoredRange store_range(float range_m, const LaserConfig& laser) {
  // The comparisons are false for NaN.
  if (!(range_m >= laser.min_range_m) || !(range_m < laser.max_range_m)) {
    return 0;
  }
  const float steps = range_m / kRangeStep_m + 0.5F;
  return steps >= 65535.0F ? StoredRange{0} : static_cast<StoredRange>(steps < 1.0F ? 1.0F : steps);
}

ScanMemory::ScanMemory(const ScanMemoryConfig& config, const Memory& memory, Span<const LaserConfig> lasers)
    : config_(config), memory_(memory), lasers_(lasers) {
  for (std::size_t l = 0; l < lasers.size(); ++l) {
    const LaserConfig& laser = lasers[l];
    for (std::size_t i = 0; i < laser.beams && i < config.max_beams; ++i) {
      const double angle = laser.base_T_laser.theta + static_cast<double>(laser.angle_min_rad) +
                           static_cast<double>(i) * static_cast<double>(laser.angle_increment_rad);
      const SinCos r = sincos(angle);
      memory_.directions[l * config.max_beams + i] = {static_cast<float>(r.cos), static_cast<float>(r.sin)};
    }
  }
}

void ScanMemory::stage(const Scan& scan) {
  const std::size_t at = slot(end_);
  const LaserConfig& laser = lasers_[scan.laser];
  for (std::size_t i = 0; i < config_.max_beams; ++i) {
    memory_.ranges[at * config_.max_beams + i] =
        i < scan.ranges_m.size() ? store_range(scan.ranges_m[i], laser) : StoredRange{0};
  }
  memory_.stamps_us[at] = scan.stamp_us;
  memory_.lasers[at] = scan.laser;
}

Span<const StoredRange> ScanMemory::ranges(std::uint32_t number) const {
  assert(holds(number) || number == end_);
  return memory_.ranges.subspan(slot(number) * config_.max_beams, laser(number).beams);
}

Span<const Point2f> ScanMemory::directions(std::uint32_t number) const {
  return memory_.directions.subspan(static_cast<std::size_t>(memory_.lasers[slot(number)]) * config_.max_beams,
                                    laser(number).beams);
}

}  // namespace mellin
