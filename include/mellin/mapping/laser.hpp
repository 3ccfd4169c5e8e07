// The sensor: where a laser scanner sits on the base and which beams it has, and what one scan of it is.
#pragma once

#include <cstdint>

#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"

namespace mellin {

/// Scanners that a configuration can name: front and rear, or those of the robots whose logs are mapped together.
inline constexpr std::size_t kMaxLasers = 4;

struct LaserConfig {
  std::uint16_t beams = 0;                    ///< ranges a scan has, 1 to 4096; 0: there is no such laser
  float angle_min_rad = -1.57079633F;         ///< direction of the first beam in the laser's frame
  float angle_increment_rad = 0.0174532925F;  ///< from beam to beam; the field of view may be a full circle
  float min_range_m = 0.05F;                  ///< shorter ranges are no measurement
  float max_range_m = 30.0F;                  ///< a range at or over it is a beam that hit nothing
  Pose2 base_T_laser;                         ///< where the laser is mounted on the base
};

/// One scan with the odometry of its moment.
struct Scan {
  std::int64_t stamp_us = 0;   ///< kept with the submaps; results do not depend on it
  Span<const float> ranges_m;  ///< one a beam; NaN, infinite, negative or out of range: no measurement
  Pose2 odom_T_base;           ///< dead reckoning, in any fixed frame
  std::uint8_t laser = 0;      ///< index into Config::lasers
};

}  // namespace mellin
