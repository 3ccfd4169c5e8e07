#include "host/map_entropy.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "host/pairing.hpp"

namespace mellin::host {
namespace {

constexpr double kMostCells = 2e8;

PosedScan posed(const Log& log, const ScanPose& pose) {
  const LogScan& scan = log.scans[pose.scan];
  const LaserSpec& laser = log.lasers[scan.laser];
  return {compose(pose.map_T_base, laser.base_T_laser), scan.ranges, laser.angle_min_rad, laser.increment_rad,
          laser.max_range_m};
}

/// What the beams reach, the robot included.
MapBounds bounds_of(const Log& log, const std::vector<ScanPose>& poses) {
  MapBounds bounds;
  for (const ScanPose& pose : poses) {
    const PosedScan scan = posed(log, pose);
    for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
      if (hit_something(scan, beam)) {
        const PointM end = end_point(scan, beam, scan.world_T_laser);
        bounds.include(end.x, end.y);
        bounds.include(scan.world_T_laser.x, scan.world_T_laser.y);
      }
    }
  }
  return bounds;
}

double occupancy(const CellCounts& counts, std::size_t cell) {
  return (counts.hits(cell) + 0.5) / (counts.observations(cell) + 1.0);
}

}  // namespace

std::vector<ScanPose> poses_of_scans(const Log& log, const std::vector<StampedPose>& trajectory) {
  const std::vector<StampedPose> sorted = by_time(trajectory);
  std::vector<ScanPose> poses;
  for (std::size_t i = 0; i < log.scans.size(); ++i) {
    const StampedPose* const found = pose_at(sorted, log.scans[i].seconds);
    if (found != nullptr) {
      poses.push_back({i, found->pose});
    }
  }
  return poses;
}

void make_comparable(std::vector<ScanPose>& estimate, std::vector<ScanPose>& truth) {
  std::vector<ScanPose> common_estimate;
  std::vector<ScanPose> common_truth;
  PosePairs pairs;
  std::size_t t = 0;
  for (const ScanPose& pose : estimate) {
    while (t < truth.size() && truth[t].scan < pose.scan) {
      ++t;
    }
    if (t < truth.size() && truth[t].scan == pose.scan) {
      common_estimate.push_back(pose);
      common_truth.push_back(truth[t]);
      pairs.estimate.push_back(pose.map_T_base);
      pairs.truth.push_back(truth[t].map_T_base);
    }
  }
  if (!common_truth.empty()) {
    const Pose2 truth_T_estimate = align(pairs);
    for (ScanPose& pose : common_estimate) {
      pose.map_T_base = compose(truth_T_estimate, pose.map_T_base);
    }
  }
  estimate = common_estimate;
  truth = common_truth;
}

DrawnMap draw_map(const Log& log, const std::vector<ScanPose>& poses, double cell_m) {
  const MapBounds bounds = bounds_of(log, poses);
  if (bounds.empty()) {
    throw std::invalid_argument("map: expected scans that hit something, found none");
  }
  const double first_column = std::floor(bounds.min_x / cell_m);
  const double first_row = std::floor(bounds.min_y / cell_m);
  const double columns = std::floor(bounds.max_x / cell_m) + 1.0 - first_column;
  const double rows = std::floor(bounds.max_y / cell_m) + 1.0 - first_row;
  if (!(columns * rows <= kMostCells)) {
    throw std::invalid_argument("map: " + std::to_string(columns * cell_m) + " m by " + std::to_string(rows * cell_m) +
                                " m are over 200 million cells; a coarser --resolution helps");
  }
  CellCounts counts(static_cast<std::size_t>(columns), static_cast<std::size_t>(rows), cell_m, first_column, first_row);
  for (const ScanPose& pose : poses) {
    const PosedScan scan = posed(log, pose);
    counts.add(scan, scan.world_T_laser);
  }
  return {counts, cell_m, first_column * cell_m, first_row * cell_m};
}

MapEntropy entropy_of(const CellCounts& counts) {
  MapEntropy entropy;
  for (std::size_t cell = 0; cell < counts.size(); ++cell) {
    if (counts.observations(cell) > 0) {
      const double p = occupancy(counts, cell);
      entropy.bits -= p * std::log2(p) + (1.0 - p) * std::log2(1.0 - p);
      ++entropy.cells;
    }
  }
  return entropy;
}

MapImage picture_of(const DrawnMap& map) {
  const CellCounts& counts = map.counts;
  MapImage image{Picture(counts.width(), counts.height(), 1, kMapUnobserved), map.cell_m, map.origin_x, map.origin_y};
  for (std::size_t row = 0; row < counts.height(); ++row) {
    for (std::size_t column = 0; column < counts.width(); ++column) {
      const std::size_t cell = row * counts.width() + column;
      if (counts.observations(cell) > 0) {
        *image.grey.at(column, counts.height() - 1 - row) = map_grey(occupancy(counts, cell));
      }
    }
  }
  return image;
}

}  // namespace mellin::host
