// Simulated buildings, a robot that drives through them, its laser and its bad odometry: logs with exact truth.
//
// Kinds of building (SimKind): each has a generator of its own (sim_kinds.hpp); drive, laser, odometry and disturbances
// are the same for all. The ring is a corridor round a core. Four wide bends join four straight stretches with rooms,
// doors and furniture on both sides. One bend or more have smooth, bare walls. In such a bend a laser cannot tell how
// far along the robot is (an annulus looks the same everywhere), and moving along it turns the robot, so that the
// odometry's scale error becomes an error of heading there that no scan matcher corrects: only recognising a place
// does.
//
// The same options give the same bytes on every machine (mellin::Random, mellin::sincos, no libm).
#pragma once

#include <string>
#include <vector>

#include "host/sim_floor.hpp"
#include "host/sim_laser.hpp"
#include "host/sim_options.hpp"
#include "host/sim_ray.hpp"
#include "mellin/core/se2.hpp"

namespace mellin::host {

struct SimScan {
  double seconds = 0.0;
  Pose2 world_T_base;         ///< truth
  Pose2 odometry_T_base;      ///< what the wheels say
  std::vector<float> ranges;  ///< m, rounded to centimetres; no_return_value() where nothing was hit
};

struct SimSession {
  std::vector<SimScan> scans;
  double path_m = 0.0;  ///< true way that the robot drove: not pushed, not carried
};

/// Drives one session. Deterministic in (options, session).
SimSession simulate(const SimOptions& options, int session);

/// Writes DIRECTORY/sim-K.log (CARMEN FLASER lines) and DIRECTORY/sim-K.tum (the truth of every scan, in the frame of
/// the floor, the same for all sessions) for K = 0 … sessions - 1; returns the paths of the logs. Throws
/// std::runtime_error where a file cannot be written.
std::vector<std::string> write_simulation(const SimOptions& options, const std::string& directory);

}  // namespace mellin::host
