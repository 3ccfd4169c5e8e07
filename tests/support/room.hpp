// A room made by hand and a laser in it: scans whose true pose is known, without a simulator's odometry.
#pragma once

#include <vector>

#include "host/simulator.hpp"
#include "mellin/mapping/laser.hpp"

namespace mellin::test {

using Walls = std::vector<host::WallSegment>;

/// 12 x 8 m with a pillar, a niche and a slanted corner: no symmetry, edges in all directions.
inline Walls room() {
  return {{{-6.0, -4.0}, {6.0, -4.0}}, {{6.0, -4.0}, {6.0, 2.0}},   {{6.0, 2.0}, {4.0, 4.0}},
          {{4.0, 4.0}, {-2.0, 4.0}},   {{-2.0, 4.0}, {-2.0, 3.0}},  {{-2.0, 3.0}, {-4.0, 3.0}},
          {{-4.0, 3.0}, {-4.0, 4.0}},  {{-4.0, 4.0}, {-6.0, 4.0}},  {{-6.0, 4.0}, {-6.0, -4.0}},
          {{2.0, -1.0}, {2.6, -1.0}},  {{2.6, -1.0}, {2.6, -0.4}},  {{2.6, -0.4}, {2.0, -0.4}},
          {{2.0, -0.4}, {2.0, -1.0}},  {{-3.0, -4.0}, {-3.0, -2.5}}};
}

/// Two walls along x, 2.4 m apart, too long for their ends to be seen.
inline Walls corridor() { return {{{-100.0, -1.2}, {100.0, -1.2}}, {{-100.0, 1.2}, {100.0, 1.2}}}; }

/// What a laser mounted on a base at `world_T_base` measures, exactly; the maximum range where a beam hits nothing.
inline std::vector<float> measure(const Walls& walls, const Pose2& world_T_base, const LaserConfig& laser) {
  const Pose2 world_T_laser = compose(world_T_base, laser.base_T_laser);
  std::vector<float> ranges;
  for (std::size_t i = 0; i < laser.beams; ++i) {
    const double angle = world_T_laser.theta + static_cast<double>(laser.angle_min_rad) +
                         static_cast<double>(i) * static_cast<double>(laser.angle_increment_rad);
    ranges.push_back(static_cast<float>(
        host::cast_ray(walls, {world_T_laser.x, world_T_laser.y}, angle, static_cast<double>(laser.max_range_m))));
  }
  return ranges;
}

inline Span<const float> span(const std::vector<float>& values) { return {values.data(), values.size()}; }

}  // namespace mellin::test
