// Points and pieces of wall of a simulated building.
#pragma once

#include <algorithm>
#include <cmath>

#include "mellin/core/math.hpp"
#include "mellin/core/random.hpp"
#include "mellin/core/se2.hpp"

namespace mellin::host {

struct Point2 {
  double x = 0.0;
  double y = 0.0;
};

/// A piece of wall.
struct WallSegment {
  Point2 a;
  Point2 b;
};

inline Point2 transform(const Pose2& a_T_b, double x, double y) {
  const Pose2 p = compose(a_T_b, {x, y, 0.0});
  return {p.x, p.y};
}

/// The point at a share of the way from a to b.
inline Point2 between_points(Point2 a, Point2 b, double share) {
  return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
}

inline double distance(Point2 a, Point2 b) { return std::sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y)); }

inline double distance(const WallSegment& wall, Point2 p) {
  const double dx = wall.b.x - wall.a.x;
  const double dy = wall.b.y - wall.a.y;
  const double length2 = dx * dx + dy * dy;
  const double along = length2 > 0.0 ? ((p.x - wall.a.x) * dx + (p.y - wall.a.y) * dy) / length2 : 0.0;
  return distance(between_points(wall.a, wall.b, std::clamp(along, 0.0, 1.0)), p);
}

inline double between_limits(Random& random, double low, double high) { return low + (high - low) * random.uniform(); }

}  // namespace mellin::host
