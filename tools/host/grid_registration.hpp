// Registration of two occupancy grids of any size: the library's registration over both, padded to one square, with
// memory from the heap.
#pragma once

#include <vector>

#include "host/grid_image.hpp"
#include "mellin/collection/registration.hpp"
#include "mellin/core/se2.hpp"

namespace mellin::host {

/// A place where b may lie in a. The frames have their origin at the outer corner of the lower left cell, x to the
/// right, y up.
struct GridHypothesis {
  Pose2 a_T_b;
  double confidence = 0.0;  ///< probability that the pose is right (spectral/confidence.hpp)
  double peak = 0.0;        ///< of the phase-only matched filter
  double agreement = 0.0;   ///< PlaceHypothesis::agreement
};

/// Hypotheses from this confidence on are a match.
inline constexpr double kAcceptedConfidence = 0.5;

/// How grids of at most `largest` cells along a side are registered: pixels and verification near 0.2 m, as many
/// hypotheses aligned as can be. Throws std::invalid_argument where the grids are too large.
RegistrationConfig grid_registration_config(std::size_t largest, double resolution_m);

/// All distinct hypotheses, best confidence first; empty where a grid shows nothing. `resolution_m` is the edge of a
/// cell in both. Throws std::invalid_argument where it is not a positive number, or the grids are too large.
std::vector<GridHypothesis> register_grids(const OccupancyImage& a, const OccupancyImage& b, double resolution_m);

}  // namespace mellin::host
