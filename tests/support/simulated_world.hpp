// Geometry of simulated floors, worked out anew and not with the simulator's own functions.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/simulator.hpp"
#include "host/tum.hpp"

namespace mellin::test {

using namespace mellin::host;

inline double distance_to(const WallSegment& wall, Point2 p) {
  const double dx = wall.b.x - wall.a.x;
  const double dy = wall.b.y - wall.a.y;
  const double length2 = dx * dx + dy * dy;
  const double along = length2 > 0.0 ? ((p.x - wall.a.x) * dx + (p.y - wall.a.y) * dy) / length2 : 0.0;
  const double share = std::clamp(along, 0.0, 1.0);
  return std::hypot(p.x - wall.a.x - share * dx, p.y - wall.a.y - share * dy);
}

inline double clearance(const std::vector<WallSegment>& walls, Point2 p) {
  double least = 1e9;
  for (const WallSegment& wall : walls) {
    least = std::min(least, distance_to(wall, p));
  }
  return least;
}

/// Whether the open segments cross (orientation test).
inline bool cross(Point2 a, Point2 b, Point2 c, Point2 d) {
  const auto side = [](Point2 p, Point2 q, Point2 r) {
    return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x) > 0.0;
  };
  return side(a, b, c) != side(a, b, d) && side(c, d, a) != side(c, d, b);
}

inline std::vector<StampedPose> truth_of(const SimSession& session) {
  std::vector<StampedPose> poses;
  for (const SimScan& scan : session.scans) {
    poses.push_back({"", scan.seconds, scan.world_T_base});
  }
  return poses;
}

inline std::vector<StampedPose> odometry_of(const SimSession& session) {
  std::vector<StampedPose> poses;
  for (const SimScan& scan : session.scans) {
    poses.push_back({"", scan.seconds, scan.odometry_T_base});
  }
  return poses;
}

/// The ring, by default, with an exact laser and exact odometry.
inline SimOptions exact(SimKind kind = SimKind::ring) {
  SimOptions options = options_for(kind);
  options.range_noise_m = 0.0;
  options.no_return_share = 0.0;
  options.outlier_share = 0.0;
  options.scale_error = 0.0;
  options.turn_error_rad_per_m = 0.0;
  options.way_noise = 0.0;
  options.turn_noise_rad = 0.0;
  return options;
}

}  // namespace mellin::test
