#include "host/pairing.hpp"

#include <algorithm>
#include <cmath>

namespace mellin::host {

std::vector<StampedPose> by_time(std::vector<StampedPose> poses) {
  std::stable_sort(poses.begin(), poses.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.seconds < b.seconds; });
  return poses;
}

std::size_t first_not_before(const std::vector<StampedPose>& sorted, double seconds) {
  const auto found = std::lower_bound(sorted.begin(), sorted.end(), seconds,
                                      [](const StampedPose& pose, double s) { return pose.seconds < s; });
  return static_cast<std::size_t>(found - sorted.begin());
}

const StampedPose* pose_at(const std::vector<StampedPose>& sorted, double seconds) {
  if (sorted.empty()) {
    return nullptr;
  }
  const std::size_t after = std::min(first_not_before(sorted, seconds), sorted.size() - 1);
  const std::size_t before = after == 0 ? 0 : after - 1;
  const double to_after = std::fabs(sorted[after].seconds - seconds);
  const double to_before = std::fabs(sorted[before].seconds - seconds);
  const std::size_t nearest = to_after <= to_before ? after : before;
  return std::min(to_after, to_before) < kPairingTolerance_s ? &sorted[nearest] : nullptr;
}

PosePairs pair_by_stamp(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth) {
  const std::vector<StampedPose> sorted = by_time(estimate);
  PosePairs pairs;
  for (const StampedPose& true_pose : truth) {
    const StampedPose* const found = pose_at(sorted, true_pose.seconds);
    if (found != nullptr) {
      pairs.estimate.push_back(found->pose);
      pairs.truth.push_back(true_pose.pose);
    }
  }
  return pairs;
}

Pose2 align(const PosePairs& pairs) {
  const auto n = static_cast<double>(pairs.truth.size());
  Pose2 mean_e;
  Pose2 mean_t;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    mean_e.x += pairs.estimate[i].x / n;
    mean_e.y += pairs.estimate[i].y / n;
    mean_t.x += pairs.truth[i].x / n;
    mean_t.y += pairs.truth[i].y / n;
  }
  double cross = 0.0;
  double dot = 0.0;
  for (std::size_t i = 0; i < pairs.truth.size(); ++i) {
    const double ex = pairs.estimate[i].x - mean_e.x;
    const double ey = pairs.estimate[i].y - mean_e.y;
    const double tx = pairs.truth[i].x - mean_t.x;
    const double ty = pairs.truth[i].y - mean_t.y;
    cross += ex * ty - ey * tx;
    dot += ex * tx + ey * ty;
  }
  const double theta = mellin::atan2(cross, dot);
  const SinCos r = sincos(theta);
  return {mean_t.x - (r.cos * mean_e.x - r.sin * mean_e.y), mean_t.y - (r.sin * mean_e.x + r.cos * mean_e.y), theta};
}

}  // namespace mellin::host
