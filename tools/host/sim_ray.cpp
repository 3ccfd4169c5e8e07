#include "host/sim_ray.hpp"

#include <algorithm>
#include <cmath>

namespace mellin::host {
namespace {

constexpr double kCell_m = 1.0;
constexpr double kPadding_m = 0.01;  // a segment is in all buckets that it comes so near: rounding loses none

/// Distance along the ray to the wall's line where the ray meets the wall; negative or zero where it does not.
double meet(const WallSegment& wall, Point2 from, const SinCos& ray) {
  // In the frame of the ray (x along it) the wall is hit where its ends lie on both sides of the x axis.
  const double ax = wall.a.x - from.x;
  const double ay = wall.a.y - from.y;
  const double bx = wall.b.x - from.x;
  const double by = wall.b.y - from.y;
  const double left_a = ray.cos * ay - ray.sin * ax;
  const double left_b = ray.cos * by - ray.sin * bx;
  if ((left_a > 0.0) == (left_b > 0.0)) {
    return 0.0;
  }
  const double share = left_a / (left_a - left_b);
  return ray.cos * (ax + share * (bx - ax)) + ray.sin * (ay + share * (by - ay));
}

/// The way of a ray through the grid along one axis.
struct Axis {
  Axis(double from, double direction, double low, int cell) {
    step = direction > 0.0 ? 1 : -1;
    const double border = low + kCell_m * (cell + (direction > 0.0 ? 1 : 0));
    next_m = direction != 0.0 ? (border - from) / direction : HUGE_VAL;
    apart_m = direction != 0.0 ? kCell_m / std::fabs(direction) : HUGE_VAL;
  }

  int step = 1;
  double next_m = 0.0;   ///< along the ray to the next border
  double apart_m = 0.0;  ///< from a border to the next
};

}  // namespace

double cast_ray(const std::vector<WallSegment>& segments, Point2 from, double angle_rad, double reach_m) {
  const SinCos ray = sincos(angle_rad);
  double nearest = reach_m;
  for (const WallSegment& wall : segments) {
    const double distance = meet(wall, from, ray);
    if (distance > 0.0 && distance < nearest) {
      nearest = distance;
    }
  }
  return nearest;
}

RayGrid::RayGrid(std::vector<WallSegment> segments) : segments_(std::move(segments)) {
  double max_x = 0.0;
  double max_y = 0.0;
  for (const WallSegment& s : segments_) {
    min_x_ = std::min({min_x_, s.a.x, s.b.x});
    min_y_ = std::min({min_y_, s.a.y, s.b.y});
    max_x = std::max({max_x, s.a.x, s.b.x});
    max_y = std::max({max_y, s.a.y, s.b.y});
  }
  columns_ = 1 + static_cast<int>((max_x - min_x_) / kCell_m);
  rows_ = 1 + static_cast<int>((max_y - min_y_) / kCell_m);
  buckets_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  const double reach = 0.5 * std::sqrt(2.0) * kCell_m + kPadding_m;
  for (std::uint32_t k = 0; k < segments_.size(); ++k) {
    const WallSegment& s = segments_[k];
    for (int j = row(std::min(s.a.y, s.b.y) - kPadding_m); j <= row(std::max(s.a.y, s.b.y) + kPadding_m); ++j) {
      for (int i = column(std::min(s.a.x, s.b.x) - kPadding_m); i <= column(std::max(s.a.x, s.b.x) + kPadding_m); ++i) {
        if (distance(s, {min_x_ + (i + 0.5) * kCell_m, min_y_ + (j + 0.5) * kCell_m}) <= reach) {
          buckets_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(i)]
              .push_back(k);
        }
      }
    }
  }
}

int RayGrid::column(double x) const {
  return std::clamp(static_cast<int>(std::floor((x - min_x_) / kCell_m)), 0, columns_ - 1);
}

int RayGrid::row(double y) const {
  return std::clamp(static_cast<int>(std::floor((y - min_y_) / kCell_m)), 0, rows_ - 1);
}

RayGrid::Hit RayGrid::cast(Point2 from, double angle_rad, double reach_m, double beyond_m) const {
  const SinCos ray = sincos(angle_rad);
  // A ray from outside the grid is followed from where it is all the same: cells outside are empty.
  int i = static_cast<int>(std::floor((from.x - min_x_) / kCell_m));
  int j = static_cast<int>(std::floor((from.y - min_y_) / kCell_m));
  Axis x(from.x, ray.cos, min_x_, i);
  Axis y(from.y, ray.sin, min_y_, j);
  Hit nearest{reach_m, kNothing};
  double entered_m = 0.0;
  while (entered_m <= nearest.distance_m + kPadding_m) {
    if (i >= 0 && i < columns_ && j >= 0 && j < rows_) {
      for (const std::uint32_t k : bucket(i, j)) {
        const double distance = meet(segments_[k], from, ray);
        if (distance > beyond_m && distance < nearest.distance_m) {
          nearest = {distance, k};
        }
      }
    }
    const bool across = x.next_m < y.next_m;
    Axis& axis = across ? x : y;
    (across ? i : j) += axis.step;
    entered_m = axis.next_m;
    axis.next_m += axis.apart_m;
  }
  return nearest;
}

double RayGrid::clearance(Point2 p, double most_m) const {
  double least = most_m;
  for (int j = row(p.y - most_m); j <= row(p.y + most_m); ++j) {
    for (int i = column(p.x - most_m); i <= column(p.x + most_m); ++i) {
      for (const std::uint32_t k : bucket(i, j)) {
        least = std::min(least, distance(segments_[k], p));
      }
    }
  }
  return least;
}

}  // namespace mellin::host
