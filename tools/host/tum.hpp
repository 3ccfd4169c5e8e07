// Trajectories in the TUM format: `timestamp x y 0 0 0 qz qw` a line.
#pragma once

#include <string>
#include <vector>

#include "mellin/core/se2.hpp"

namespace mellin::host {

struct StampedPose {
  std::string stamp;     ///< the time as its source wrote it, so that it survives a round trip digit by digit
  double seconds = 0.0;  ///< the same as a number
  Pose2 pose;
};

/// Reads a file; throws std::runtime_error naming file and line where a line is not eight finite numbers. Empty lines
/// and those that start with # are passed over.
std::vector<StampedPose> read_tum(const std::string& path);

/// Writes a file; throws std::runtime_error where it cannot.
void write_tum(const std::string& path, const std::vector<StampedPose>& poses);

}  // namespace mellin::host
