// Which poses of two trajectories belong together, and how the one trajectory is laid on the other.
#pragma once

#include <cstddef>
#include <vector>

#include "host/tum.hpp"

namespace mellin::host {

/// Poses pair where their stamps differ by less than this, s.
inline constexpr double kPairingTolerance_s = 1.5e-3;

/// The same poses in order of time; those of one stamp stay in their order.
std::vector<StampedPose> by_time(std::vector<StampedPose> poses);

/// Index of the first pose of a sorted trajectory that is not earlier; its size where all are.
std::size_t first_not_before(const std::vector<StampedPose>& sorted, double seconds);

/// The pose of a sorted trajectory that pairs with a stamp, the nearest one; nullptr where there is none.
const StampedPose* pose_at(const std::vector<StampedPose>& sorted, double seconds);

/// Poses of the same moments: estimate[i] belongs to truth[i].
struct PosePairs {
  std::vector<Pose2> estimate;
  std::vector<Pose2> truth;
};

/// The poses of the truth, in its order, that have a pose of the estimate, which may be in any order of time.
PosePairs pair_by_stamp(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth);

/// truth_T_estimate: the rigid motion that lays the estimate's positions best on the truth's (Umeyama 1991, without
/// scale). There is at least one pair.
Pose2 align(const PosePairs& pairs);

}  // namespace mellin::host
