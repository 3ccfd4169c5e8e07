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

/// Edges of a cell that are taken, m.
inline constexpr double kFinestResolution_m = 1e-4;
inline constexpr double kCoarsestResolution_m = 100.0;

/// How grids of at most `largest` cells along a side are registered: pixels and verification near 0.2 m, as many
/// hypotheses aligned as can be. Throws std::invalid_argument where the grids are too large.
RegistrationConfig grid_registration_config(std::size_t largest, double resolution_m);

/// A grid in the middle of a square one, whose frame has its origin in the centre as a submap's has.
struct PaddedGrid {
  std::vector<std::uint8_t> cells;
  std::uint16_t side = 0;
  float cell_m = 0.0F;
  Pose2 centre_T_corner;  ///< from the picture's frame to the square grid's
  GridView view() const { return {{cells.data(), cells.size()}, side, cell_m}; }
};

/// Two grids as they are registered.
struct PaddedPair {
  RegistrationConfig config;
  PaddedGrid a;
  PaddedGrid b;
  /// A pose between the square grids' frames as one between the pictures'.
  Pose2 between_corners(const Pose2& a_T_b) const {
    return compose(compose(inverse(a.centre_T_corner), a_T_b), b.centre_T_corner);
  }
};

/// Throws as register_grids() does.
PaddedPair pad(const OccupancyImage& a, const OccupancyImage& b, double resolution_m);

/// All distinct hypotheses, best confidence first; empty where a grid shows nothing. `resolution_m` is the edge of a
/// cell in both. Throws std::invalid_argument where it is not one that is taken, or the grids are too large.
std::vector<GridHypothesis> register_grids(const OccupancyImage& a, const OccupancyImage& b, double resolution_m);
std::vector<GridHypothesis> register_grids(const PaddedPair& pair);

}  // namespace mellin::host
