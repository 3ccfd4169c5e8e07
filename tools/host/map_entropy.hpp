// How sharp a map is: the entropy of the occupancy grid that the scans of a log give at the poses of a trajectory. A
// wall drawn twice, or smeared by poses that are off, has more cells that were both hit and seen through than one wall
// has. It needs no truth, but a figure alone says little: glass, people and furniture that moves leave entropy in a
// perfect trajectory's map, too. So it is compared with that of another trajectory over the same scans.
//
// p = (hits + 1/2) / (observations + 1) of a cell is the posterior mean of the share of beams that end in it, under
// Jeffreys' prior Beta(1/2, 1/2). The bare share hits / observations would call a cell certain (0 bits) that a single
// beam has touched, so that a map whose walls are smeared thinly over many cells would count as sharp; with the prior
// such a cell has 0.81 bits and earns its certainty as beams agree.
#pragma once

#include <cstddef>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/cell_counts.hpp"
#include "host/map_picture.hpp"
#include "host/tum.hpp"

namespace mellin::host {

/// A scan of a log and where the robot's base was.
struct ScanPose {
  std::size_t scan = 0;  ///< index into Log::scans
  Pose2 map_T_base;
};

/// The log's scans that the trajectory has a pose for (pairing.hpp), in the order of the log.
std::vector<ScanPose> poses_of_scans(const Log& log, const std::vector<StampedPose>& trajectory);

/// Keeps the scans that both have, and lays `estimate` on `truth` by the best rigid motion: its walls then lie across
/// the cells as those of the truth do, which else changes the entropy of the same map by some per cent. With nothing
/// in common both are empty.
void make_comparable(std::vector<ScanPose>& estimate, std::vector<ScanPose>& truth);

/// The occupancy grid of those scans.
struct DrawnMap {
  CellCounts counts;
  double cell_m = 0.0;
  double origin_x = 0.0;  ///< lower left corner, m
  double origin_y = 0.0;
};

/// Draws it just as large as its beams reach. Throws std::invalid_argument where there is nothing to draw, or where it
/// would have over 200 million cells.
DrawnMap draw_map(const Log& log, const std::vector<ScanPose>& poses, double cell_m);

struct MapEntropy {
  std::size_t cells = 0;  ///< observed at least once
  double bits = 0.0;      ///< sum over them of -p log2 p - (1 - p) log2 (1 - p)

  double bits_per_cell() const { return cells == 0 ? 0.0 : bits / static_cast<double>(cells); }
};

MapEntropy entropy_of(const CellCounts& counts);

/// The grid as a picture: dark where p is large.
MapImage picture_of(const DrawnMap& map);

}  // namespace mellin::host
