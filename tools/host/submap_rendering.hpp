// Submaps rendered from scans at known poses, on the host: references for tests and evaluations that need submaps
// whose true relative poses are known. Independent of the library's own mapper.
#pragma once

#include <cstdint>
#include <vector>

#include "host/cell_counts.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin::host {

/// A submap that owns its cells.
struct RenderedSubmap {
  Pose2 world_T_submap;
  std::uint16_t side = 0;
  float cell_m = 0.0F;
  std::vector<std::uint8_t> cells;
  GridView view() const { return {{cells.data(), cells.size()}, side, cell_m}; }
};

/// Where to put the frame of a submap of these scans: the centre of the box round all their end points in axes turned
/// by `heading_rad`, which becomes the submap's heading.
Pose2 centred_frame(const std::vector<PosedScan>& scans, double heading_rad);

/// Casts every beam through the grid: the cell of its end point is observed and hit, those before it are observed.
RenderedSubmap render_submap(const std::vector<PosedScan>& scans, const Pose2& world_T_submap, std::uint16_t side,
                             float cell_m);

}  // namespace mellin::host
