// The drive: the poses at which a robot takes its scans.
#pragma once

#include <vector>

#include "host/sim_floor.hpp"

namespace mellin::host {

struct TimedPose {
  double seconds = 0.0;
  Pose2 pose;
};

/// Collects the poses at which scans are taken.
class Drive {
 public:
  Drive(const SimOptions& options, const Pose2& start);

  const Pose2& pose() const { return poses_.back().pose; }
  const std::vector<TimedPose>& poses() const { return poses_; }

  /// Scans again at the next pose, unless it is the present one.
  void move_to(const Pose2& next);
  /// Turns on the spot by an angle.
  void turn_by(double angle);
  void turn_to(double theta);
  /// Turns to a point and drives straight to it.
  void go_to(Point2 to);
  /// Drives along a line from its first point, where it is, to its last; turns on the spot at sharp corners alone.
  void follow(const std::vector<Point2>& line);

 private:
  double spacing_m_;
  double turn_rad_;
  std::vector<TimedPose> poses_;
};

/// A session's drive: rounds of the ring with visits to rooms, or a tour of the floor's ways.
Drive drive_session(const SimOptions& options, const Floor& floor, int session);

/// The line of a tour over the floor's ways, of at least path_m: at each node it takes a way at random, seldom driven
/// ways first, and turns back at dead ends alone. Corners that are not sharp are rounded. It strays within the slack
/// of its ways, never twice alike.
std::vector<Point2> plan_tour(const Floor& floor, double path_m, Random& random);

/// Rounds of the ring floor, with visits to rooms.
Drive drive_ring(const SimOptions& options, const Floor& floor, int session);

}  // namespace mellin::host
