// What befalls a robot on its drive: stops, pushes, slipping wheels, and being carried away.
#pragma once

#include <vector>

#include "host/sim_drive.hpp"
#include "host/sim_ray.hpp"

namespace mellin::host {

inline constexpr double kPush_m = 0.5;
inline constexpr double kLeastSlip_m = 0.5;
inline constexpr double kMostSlip_m = 1.0;
inline constexpr double kLeastKidnap_m = 10.0;
inline constexpr double kStop_s = 60.0;

/// A scan's pose and how the robot came there.
struct Move {
  TimedPose to;
  Pose2 turned_wheels;   ///< the motion that the wheels make, from the scan before
  bool carried = false;  ///< pushed or carried: the way is none that it drove
};

/// The drive as moves, with as many disturbances as the options say, spread over it in a random order. Deterministic in
/// (options, session). Throws std::invalid_argument where the drive has no place for one (no room for a push, nothing
/// far enough for a kidnap).
std::vector<Move> disturbed_moves(const SimOptions& options, int session, const Drive& drive, const RayGrid& walls);

}  // namespace mellin::host
