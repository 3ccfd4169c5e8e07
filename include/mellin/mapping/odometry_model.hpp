// What is wrong with a robot's odometry, learnt from the scans while mapping: its bias (a wheel of another size than
// configured, a base of another width), which turns up in the map wherever a scan does not determine the pose (along a
// plain corridor), and its noise.
//
// Between two taken scans the odometry says one motion and the scans another. Each such pair is an observation of the
// bias b = (scale, heading per metre, heading per radian): the error of the odometry is J b plus noise of covariance N,
// and the scans tell of it with information A. Recursive least squares (Ljung 1999, Section 11.2) with exponential
// forgetting and a zero-mean prior that is not forgotten: each observation weighs by Omega = (N + A^-1)^-1, which is
// zero along whatever A does not determine, so nothing is learnt there. What remains after b, per direction, scales the
// configured noise.
#pragma once

#include <cstdint>

#include "mellin/core/se2.hpp"

namespace mellin {

/// Odometry error of one step, as standard deviations: distance driven d [m], turn a [rad].
struct MotionNoise {
  float distance_base_m = 0.02F;   ///< along and across, always
  float distance_per_m = 0.10F;    ///< along and across, times d
  float distance_per_rad = 0.05F;  ///< along and across, times a
  float angle_base_rad = 0.01F;    ///< heading, always
  float angle_per_m = 0.05F;       ///< heading, times d
  float angle_per_rad = 0.15F;     ///< heading, times a
};

struct OdometryModelConfig {
  bool learn_bias = true;  ///< correct the odometry by what is known of its bias
  /// Scale MotionNoise by what is left of the odometry's error. Off: the configured noise is wide on purpose, so that a
  /// slip is found again, and with a narrower one the maps got no better.
  bool learn_noise = false;
  /// Deviations of the bias before anything is known. The estimate stays within three of them.
  float scale_sigma = 0.1F;          ///< share of the way
  float angle_per_m_sigma = 0.05F;   ///< rad of heading a metre driven; backwards it counts the other way
  float angle_per_rad_sigma = 0.1F;  ///< share of the turn
  /// Taken scans over which an observation fades to 1/e: wheels wear, floors change.
  std::uint16_t memory_scans = 400;
  float least_noise = 0.5F;  ///< the learnt noise is at least so many times the configured one …
  float most_noise = 3.0F;   ///< … and at most so many times
};

/// The systematic error of odometry: share of the way that is missing, rad of heading missing a metre driven forwards,
/// share of the turn that is missing.
struct OdometryBias {
  double scale = 0.0;
  double angle_per_m = 0.0;
  double angle_per_rad = 0.0;
};

/// Fixed small state, no memory of its own. Same observations, same bits.
class OdometryModel {
 public:
  OdometryModel() = default;
  OdometryModel(const OdometryModelConfig& config, const MotionNoise& noise) : config_(config), noise_(noise) {}

  /// Forgets what was learnt: another robot, or a new session.
  void reset();

  /// The motion of the base that a motion by odometry stands for; the same bits where no bias is to be learnt.
  Pose2 corrected(const Pose2& motion) const;

  /// Covariance of the error of corrected(motion), in the frame at its end: the noise as it is known, and what the
  /// bias's own uncertainty leaves. Diagonal, all of it over 0.
  Sym3 covariance(const Pose2& motion) const;

  /// A step of the odometry on the way since the last learn() or skip(), any part of the way.
  void advance(const Pose2& motion);
  /// The way since then led to `matched` by the scans (pose of its end in the frame of its beginning), with
  /// `scan_information` of what they alone say of it, in the frame at its end (m, m, rad). Starts the next way.
  /// Outliers (a wheel that slipped, a robot that was pushed) count the less the farther they lie off.
  void learn(const Pose2& matched, const Sym3& scan_information);
  /// Starts the next way without having learnt of this one.
  void skip() { way_ = Way{}; }

  const OdometryBias& bias() const { return bias_; }
  /// Covariance of bias(), with (scale, angle_per_m, angle_per_rad) in the places of (x, y, theta).
  Sym3 bias_covariance() const { return spread_; }
  /// The learnt noise as a multiple of the configured one, along and across and in heading.
  double distance_noise() const { return distance_.factor; }
  double angle_noise() const { return angle_.factor; }

 private:
  struct Way {
    Pose2 corrected;
    double distance = 0.0;  ///< signed: backwards counts negative
    double turn = 0.0;
  };
  /// Running mean of squared errors over those that the configured noise expects.
  struct NoiseMean {
    double sum = 0.0;
    double weight = 0.0;
    double factor = 1.0;

    void fade(double keep) {
      sum *= keep;
      weight *= keep;
    }
  };
  /// An observation of one way: error of its end, and how that depends on the three parameters.
  struct Observation {
    Pose2 error;
    Pose2 by_scale;
    Pose2 by_distance;
    Pose2 by_turn;
  };

  double memory() const;
  Observation observe(const Pose2& matched) const;
  Sym3 noise_covariance(double distance, double turn) const;
  void learn_bias(const Observation& seen, const Sym3& weights);
  void settle(NoiseMean& mean) const;

  OdometryModelConfig config_;
  MotionNoise noise_;
  Way way_;
  OdometryBias bias_;
  Sym3 spread_;    ///< of the bias
  Sym3 evidence_;  ///< what was observed: sum of J^T Omega J, faded
  Pose2 pull_;     ///< sum of J^T Omega (error + J b), faded
  NoiseMean distance_;
  NoiseMean angle_;
};

}  // namespace mellin
