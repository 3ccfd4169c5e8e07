// The laser: exact distances, noise, beams that come back empty or end early, glass, people, missing beams.
#pragma once

#include <vector>

#include "host/sim_drive.hpp"
#include "host/sim_ray.hpp"

namespace mellin::host {

inline constexpr double kPersonRadius_m = 0.22;

/// Where the people are that walk round a robot at this time, with their centres at least so far from it that it does
/// not touch them. Each crosses before the robot on a straight line for some seconds; then another one does.
std::vector<Point2> people_near(const SimOptions& options, int session, const TimedPose& robot);

class Laser {
 public:
  Laser(const SimOptions& options, int session, const RayGrid& walls);

  /// Ranges in m, rounded to centimetres; no_return_value() where nothing was hit.
  std::vector<float> scan(const TimedPose& robot);

  /// Whether a piece of wall is of glass.
  bool is_glass(std::uint32_t segment) const { return !glass_.empty() && glass_[segment]; }

 private:
  double cast(Point2 from, double angle_rad);
  void drop_third(std::vector<float>& ranges);

  const SimOptions& options_;
  int session_;
  const RayGrid& walls_;
  Random noise_;
  Random panes_;
  Random missing_;
  std::vector<bool> glass_;
};

/// What a log says where a beam hit nothing: a little beyond the reach, as real sensors do, in whole centimetres.
double no_return_value(const SimOptions& options);

/// Angle between neighbouring beams, the first of which points at -90 degrees.
double beam_increment(int beams);

}  // namespace mellin::host
