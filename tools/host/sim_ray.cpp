#include "host/simulator.hpp"
#include "mellin/core/math.hpp"

namespace mellin::host {

double cast_ray(const std::vector<WallSegment>& segments, Point2 from, double angle_rad, double reach_m) {
  const SinCos ray = sincos(angle_rad);
  double nearest = reach_m;
  for (const WallSegment& wall : segments) {
    // In the frame of the ray (x along it) the wall is hit where its ends lie on both sides of the x axis.
    const double ax = wall.a.x - from.x;
    const double ay = wall.a.y - from.y;
    const double bx = wall.b.x - from.x;
    const double by = wall.b.y - from.y;
    const double left_a = ray.cos * ay - ray.sin * ax;
    const double left_b = ray.cos * by - ray.sin * bx;
    if ((left_a > 0.0) == (left_b > 0.0)) {
      continue;
    }
    const double share = left_a / (left_a - left_b);
    const double distance = ray.cos * (ax + share * (bx - ax)) + ray.sin * (ay + share * (by - ay));
    if (distance > 0.0 && distance < nearest) {
      nearest = distance;
    }
  }
  return nearest;
}

}  // namespace mellin::host
