// Rays against pieces of wall: one by one, and through a grid of buckets.
#pragma once

#include <cstdint>
#include <vector>

#include "host/sim_geometry.hpp"

namespace mellin::host {

/// Distance [m] from (x, y) along `angle_rad` to the first of the segments; reach_m where none is nearer.
double cast_ray(const std::vector<WallSegment>& segments, Point2 from, double angle_rad, double reach_m);

/// The same for many rays: each cell of a uniform grid lists the segments that pass it, and a ray looks into the cells
/// on its way alone (Amanatides and Woo 1987). Its answers are those of cast_ray(), to the bit.
class RayGrid {
 public:
  static constexpr std::uint32_t kNothing = 0xFFFFFFFFU;

  struct Hit {
    double distance_m = 0.0;
    std::uint32_t segment = kNothing;  ///< index of the segment that was hit
  };

  explicit RayGrid(std::vector<WallSegment> segments);

  const std::vector<WallSegment>& segments() const { return segments_; }

  /// The first segment farther away than beyond_m; {reach_m, kNothing} where none is nearer than reach_m.
  Hit cast(Point2 from, double angle_rad, double reach_m, double beyond_m = 0.0) const;

  /// Distance to the nearest segment, or most_m where none is nearer.
  double clearance(Point2 p, double most_m) const;

 private:
  int column(double x) const;
  int row(double y) const;
  const std::vector<std::uint32_t>& bucket(int i, int j) const {
    return buckets_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(i)];
  }

  std::vector<WallSegment> segments_;
  double min_x_ = 0.0;
  double min_y_ = 0.0;
  int columns_ = 1;
  int rows_ = 1;
  std::vector<std::vector<std::uint32_t>> buckets_;
};

}  // namespace mellin::host
