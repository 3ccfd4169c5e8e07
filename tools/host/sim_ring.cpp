#include "host/sim_ring.hpp"

#include <cmath>

namespace mellin::host::ring {

double side_start(int side) {
  double way = 0.0;
  for (int i = 0; i < side; ++i) {
    way += side_length(i) + kBend_m;
  }
  return way;
}

Pose2 centre_line(double way) {
  double rest = way - kLength_m * std::floor(way / kLength_m);
  Pose2 pose{-kLong_m / 2.0, -(kShort_m / 2.0 + kBendRadius_m), 0.0};
  for (int side = 0; side < kSides; ++side) {
    if (rest <= side_length(side)) {
      return compose(pose, {rest, 0.0, 0.0});
    }
    rest -= side_length(side);
    pose = compose(pose, {side_length(side), 0.0, 0.0});
    const double angle = (rest < kBend_m ? rest : kBend_m) / kBendRadius_m;
    const SinCos r = sincos(angle);
    pose = compose(pose, {kBendRadius_m * r.sin, kBendRadius_m * (1.0 - r.cos), angle});
    if (rest <= kBend_m) {
      return pose;
    }
    rest -= kBend_m;
  }
  return pose;
}

}  // namespace mellin::host::ring
