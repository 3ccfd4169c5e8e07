// Registration of two occupancy grids of any size: the library's matcher, alignment and verification in a row, with
// memory from the heap.
#pragma once

#include <vector>

#include "host/grid_image.hpp"
#include "mellin/core/se2.hpp"

namespace mellin::host {

/// A place where b may lie in a. The frames have their origin at the outer corner of the lower left cell, x to the
/// right, y up.
struct GridHypothesis {
  Pose2 a_T_b;
  double confidence = 0.0;  ///< 0 to 1; see confidence_of()
  double peak = 0.0;        ///< of the phase-only matched filter
  double agreement = 0.0;   ///< Agreement::score after alignment
  double inlier_share = 0.0;
  double overlap = 0.0;
  double margin = 0.0;
};

/// Hypotheses from this confidence on are a match.
inline constexpr double kAcceptedConfidence = 0.5;

/// A monotone function of the evidence, 0 to 1, not calibrated as a probability: a logistic of
///   agreement * inlier_share + margin / 2 + peak / 4,
/// where inlier_share is that of the alignment, and margin, cut at 0.3, is by how much agreement * inlier_share exceeds
/// that of the best hypothesis elsewhere (buildings that look alike when turned agree with both). Its centre and width
/// were set by eye on submaps of the intel, fr079 and aces logs, on no log held back.
double confidence_of(double agreement, double inlier_share, double margin, double peak);

/// All distinct hypotheses, best confidence first; empty where a grid shows nothing. `resolution_m` is the edge of a
/// cell in both. Throws std::invalid_argument where it is not a positive number.
std::vector<GridHypothesis> register_grids(const OccupancyImage& a, const OccupancyImage& b, double resolution_m);

}  // namespace mellin::host
