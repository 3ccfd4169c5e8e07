// The scan memory (paper, Section III-A): the last few dozen scans that were taken into the map, as ranges. Poses are
// not in it: each particle remembers its own.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/grid/ray.hpp"
#include "mellin/mapping/laser.hpp"

namespace mellin {

/// Ranges are kept in steps of 2 mm, which 16 bits carry to 131 m. 0: the beam measured nothing.
using StoredRange = std::uint16_t;
inline constexpr float kRangeStep_m = 0.002F;

struct ScanMemoryConfig {
  std::uint16_t capacity = 0;   ///< scans
  std::uint16_t max_beams = 0;  ///< of any laser
};

/// A scan's place in a grid: the cell that the robot lies in and the rest of its pose. What follows is float
/// arithmetic on numbers of the size of the window, however far the robot has driven.
struct GridPose {
  std::int32_t column = 0;
  std::int32_t row = 0;
  float x_cells = 0.0F;  ///< from the cell's lower left corner
  float y_cells = 0.0F;
  float sin = 0.0F;
  float cos = 1.0F;
};
GridPose grid_pose(const Pose2& grid_T_base, float cell_m);

class ScanMemory {
 public:
  struct Memory {
    Span<StoredRange> ranges;
    Span<std::int64_t> stamps_us;
    Span<std::uint8_t> lasers;
    Span<Point2f> directions;
  };
  template <class A>
  static constexpr Memory carve(A& arena, const ScanMemoryConfig& config) {
    const std::size_t rows = config.capacity + std::size_t{1};  // and one for the staged scan
    return {arena.template take<StoredRange>(rows * config.max_beams, Part::scans),
            arena.template take<std::int64_t>(rows, Part::scans), arena.template take<std::uint8_t>(rows, Part::scans),
            arena.template take<Point2f>(kMaxLasers * config.max_beams, Part::scans, Region::fast)};
  }

  ScanMemory() = default;
  /// `lasers` has kMaxLasers elements and stays the caller's.
  ScanMemory(const ScanMemoryConfig& config, const Memory& memory, Span<const LaserConfig> lasers);

  /// Stores a scan's ranges beside the remembered ones, under the number end(), so that they can be matched before it
  /// is known whether the scan is taken. Requires scan.laser < kMaxLasers.
  void stage(const Scan& scan);
  /// Remembers the staged scan, over the oldest one where the memory is full. Returns its number; they count from 0 in
  /// a session.
  std::uint32_t take_staged() { return end_++; }
  void clear() { end_ = 0; }

  /// One past the newest scan's number.
  std::uint32_t end() const { return end_; }
  /// Whether the scan is still in memory.
  bool holds(std::uint32_t number) const { return number < end_ && end_ - number <= config_.capacity; }

  /// The following require holds(number), or number == end() for the staged scan.
  Span<const StoredRange> ranges(std::uint32_t number) const;
  std::int64_t stamp_us(std::uint32_t number) const { return memory_.stamps_us[slot(number)]; }
  const LaserConfig& laser(std::uint32_t number) const { return lasers_[memory_.lasers[slot(number)]]; }
  /// Unit vectors of the beams in the base frame.
  Span<const Point2f> directions(std::uint32_t number) const;

  /// Calls visit(ray) for each beam that measured something, as a ray on the grid for a robot at `pose`.
  template <class Visit>
  void visit_rays(std::uint32_t number, const GridPose& pose, float cell_m, Visit&& visit) const;

 private:
  std::size_t slot(std::uint32_t number) const { return number % (config_.capacity + 1U); }

  ScanMemoryConfig config_;
  Memory memory_;
  Span<const LaserConfig> lasers_;
  std::uint32_t end_ = 0;
};

/// Ranges of a scan that measured nothing are 0; others in steps of kRangeStep_m, at least 1.
StoredRange store_range(float range_m, const LaserConfig& laser);

/// The cell of a coordinate in cells, relative to the pose's own.
inline std::int32_t floor_cell(float cells) {
  const auto truncated = static_cast<std::int32_t>(cells);
  return truncated - (static_cast<float>(truncated) > cells ? 1 : 0);
}

template <class Visit>
void ScanMemory::visit_rays(std::uint32_t number, const GridPose& pose, float cell_m, Visit&& visit) const {
  const Span<const StoredRange> stored = ranges(number);
  const Span<const Point2f> beams = directions(number);
  const Pose2& mount = laser(number).base_T_laser;
  const float inverse_cell = 1.0F / cell_m;
  const float mount_x = static_cast<float>(mount.x) * inverse_cell;
  const float mount_y = static_cast<float>(mount.y) * inverse_cell;
  const float from_x = pose.x_cells + pose.cos * mount_x - pose.sin * mount_y;
  const float from_y = pose.y_cells + pose.sin * mount_x + pose.cos * mount_y;
  Ray ray;
  ray.column_from = pose.column + floor_cell(from_x);
  ray.row_from = pose.row + floor_cell(from_y);
  const float step = kRangeStep_m * inverse_cell;
  for (std::size_t i = 0; i < stored.size(); ++i) {
    if (stored[i] == 0) {
      continue;
    }
    const float length = static_cast<float>(stored[i]) * step;
    const float x = beams[i].x * length;
    const float y = beams[i].y * length;
    ray.column_to = pose.column + floor_cell(from_x + pose.cos * x - pose.sin * y);
    ray.row_to = pose.row + floor_cell(from_y + pose.sin * x + pose.cos * y);
    visit(static_cast<const Ray&>(ray));
  }
}

}  // namespace mellin
