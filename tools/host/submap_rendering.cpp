#include "host/submap_rendering.hpp"

#include "host/map_picture.hpp"

namespace mellin::host {

Pose2 centred_frame(const std::vector<PosedScan>& scans, double heading_rad) {
  const Pose2 axes{0.0, 0.0, heading_rad};
  MapBounds box;
  for (const PosedScan& scan : scans) {
    const Pose2 axes_T_laser = between(axes, scan.world_T_laser);
    for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
      if (hit_something(scan, beam)) {
        const PointM end = end_point(scan, beam, axes_T_laser);
        box.include(end.x, end.y);
      }
    }
  }
  return box.empty() ? axes : compose(axes, {0.5 * (box.min_x + box.max_x), 0.5 * (box.min_y + box.max_y), 0.0});
}

RenderedSubmap render_submap(const std::vector<PosedScan>& scans, const Pose2& world_T_submap, std::uint16_t side,
                             float cell_m) {
  const double half = 0.5 * side;
  CellCounts counts(side, side, static_cast<double>(cell_m), -half, -half);
  for (const PosedScan& scan : scans) {
    counts.add(scan, between(world_T_submap, scan.world_T_laser));
  }
  RenderedSubmap submap{world_T_submap, side, cell_m, std::vector<std::uint8_t>(counts.size(), kUnobserved)};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::uint32_t observations = counts.observations(i);
    if (observations > 0) {
      submap.cells[i] = static_cast<std::uint8_t>((254 * counts.hits(i) + observations / 2) / observations);
    }
  }
  return submap;
}

}  // namespace mellin::host
