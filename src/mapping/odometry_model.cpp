#include "mellin/mapping/odometry_model.hpp"

namespace mellin {
namespace {

/// Squared errors, in units of their expectation, from which on an observation is taken for an outlier: 3 sigma.
constexpr double kOutlier = 9.0;
/// Observations that the configured noise counts for.
constexpr double kNoisePrior = 20.0;
/// The estimate stays within so many deviations of the prior.
constexpr double kMostSigmas = 3.0;

double wide(float value) { return static_cast<double>(value); }

double square(double value) { return value * value; }

double magnitude(double value) { return value < 0.0 ? -value : value; }

double clamped(double value, double low, double high) { return value < low ? low : value > high ? high : value; }

Pose2 product(const Sym3& m, const Pose2& v) {
  return {m.xx * v.x + m.xy * v.y + m.xt * v.theta, m.xy * v.x + m.yy * v.y + m.yt * v.theta,
          m.xt * v.x + m.yt * v.y + m.tt * v.theta};
}

double dot(const Pose2& a, const Pose2& b) { return a.x * b.x + a.y * b.y + a.theta * b.theta; }

double signed_distance(const Pose2& motion) { return motion.x < 0.0 ? -translation(motion) : translation(motion); }

/// (W^-1 + A^-1)^-1 = W - W (W + A)^-1 W with a diagonal W, whether A can be inverted or not.
Sym3 in_series(const Sym3& w, const Sym3& a) {
  Sym3 s;
  if (!invert(w + a, s)) {
    return {};
  }
  return {w.xx - w.xx * s.xx * w.xx, -w.xx * s.xy * w.yy, -w.xx * s.xt * w.tt,
          w.yy - w.yy * s.yy * w.yy, -w.yy * s.yt * w.tt, w.tt - w.tt * s.tt * w.tt};
}

Sym3 prior_covariance(const OdometryModelConfig& config) {
  return diagonal(square(wide(config.scale_sigma)), square(wide(config.angle_per_m_sigma)),
                  square(wide(config.angle_per_rad_sigma)));
}

}  // namespace

void OdometryModel::reset() {
  way_ = Way{};
  bias_ = OdometryBias{};
  evidence_ = Sym3{};
  pull_ = Pose2{};
  spread_ = prior_covariance(config_);
  distance_ = NoiseMean{};
  angle_ = NoiseMean{};
}

double OdometryModel::memory() const { return 1.0 - 1.0 / static_cast<double>(config_.memory_scans); }

Pose2 OdometryModel::corrected(const Pose2& motion) const {
  if (!config_.learn_bias) {
    return motion;
  }
  const double turned = bias_.angle_per_m * signed_distance(motion) + bias_.angle_per_rad * motion.theta;
  // The missing turn is spread over the way: half of it at its middle.
  const SinCos half = sincos(0.5 * turned);
  const double stretch = 1.0 + bias_.scale;
  return {stretch * (half.cos * motion.x - half.sin * motion.y), stretch * (half.sin * motion.x + half.cos * motion.y),
          wrap_angle(motion.theta + turned)};
}

Sym3 OdometryModel::noise_covariance(double distance, double turn) const {
  const double d = magnitude(distance);
  const double a = magnitude(turn);
  const double along =
      wide(noise_.distance_base_m) + wide(noise_.distance_per_m) * d + wide(noise_.distance_per_rad) * a;
  const double heading = wide(noise_.angle_base_rad) + wide(noise_.angle_per_m) * d + wide(noise_.angle_per_rad) * a;
  return diagonal(along * along, along * along, heading * heading);
}

Sym3 OdometryModel::covariance(const Pose2& motion) const {
  const double d = translation(motion);
  const double a = magnitude(motion.theta);
  const Sym3 n = noise_covariance(d, a);
  if (!config_.learn_noise) {
    return n;
  }
  const double scale_variance = square(d) * spread_.xx;
  const double heading_variance = square(d) * spread_.yy + 2.0 * d * a * magnitude(spread_.yt) + square(a) * spread_.tt;
  const double across_variance = 0.25 * square(d) * heading_variance;
  const double along = square(distance_.factor) * n.xx;
  const double heading = square(angle_.factor) * n.tt;
  return config_.learn_bias ? diagonal(along + scale_variance, along + across_variance, heading + heading_variance)
                            : diagonal(along, along, heading);
}

void OdometryModel::advance(const Pose2& motion) {
  way_.corrected = compose(way_.corrected, corrected(motion));
  way_.distance += signed_distance(motion);
  way_.turn += motion.theta;
}

/// To first order, in the frame at the end of the way as predicted.
OdometryModel::Observation OdometryModel::observe(const Pose2& matched) const {
  const Pose2& way = way_.corrected;
  const SinCos turn = sincos(way.theta);
  const Pose2 t{turn.cos * way.x + turn.sin * way.y, turn.cos * way.y - turn.sin * way.x, 0.0};
  const double raw = config_.learn_bias ? 1.0 / (1.0 + bias_.scale) : 1.0;
  const auto turning = [&](double by) { return Pose2{-0.5 * by * t.y, 0.5 * by * t.x, by}; };
  return {between(way, matched), {raw * t.x, raw * t.y, 0.0}, turning(way_.distance), turning(way_.turn)};
}

void OdometryModel::learn(const Pose2& matched, const Sym3& scan_information) {
  const Observation seen = observe(matched);
  const Sym3 configured = noise_covariance(way_.distance, way_.turn);
  const double distance_variance = square(distance_.factor) * configured.xx;
  const double angle_variance = square(angle_.factor) * configured.tt;
  const Sym3 odometry = diagonal(1.0 / distance_variance, 1.0 / distance_variance, 1.0 / angle_variance);
  const Sym3 weights = in_series(odometry, scan_information);
  way_ = Way{};
  if (!(weights.xx >= 0.0) || !(weights.yy >= 0.0) || !(weights.tt >= 0.0)) {
    return;
  }
  learn_bias(seen, weights);
  // How much of the odometry's error the scans show, per direction.
  const double along = weights.xx * distance_variance;
  const double across = weights.yy * distance_variance;
  const double heading = weights.tt * angle_variance;
  const auto learn_direction = [](NoiseMean& mean, double error, double share, double learnt, double expected) {
    if (share > 0.5) {  // below, most of the error was pulled back to the odometry by the match itself
      const double scan_variance = learnt / share - learnt;
      const double squared = clamped(error * error, 0.0, kOutlier * (learnt + scan_variance));
      mean.sum += share * share * (squared - scan_variance) / expected;
      mean.weight += share * share;
    }
  };
  distance_.fade(memory());
  angle_.fade(memory());
  learn_direction(distance_, seen.error.x, along, distance_variance, configured.xx);
  learn_direction(distance_, seen.error.y, across, distance_variance, configured.yy);
  learn_direction(angle_, seen.error.theta, heading, angle_variance, configured.tt);
  settle(distance_);
  settle(angle_);
}

void OdometryModel::settle(NoiseMean& mean) const {
  const double squared = (kNoisePrior + mean.sum) / (kNoisePrior + mean.weight);
  mean.factor = clamped(squared > 0.0 ? sqrt(squared) : 0.0, wide(config_.least_noise), wide(config_.most_noise));
}

void OdometryModel::learn_bias(const Observation& seen, const Sym3& weights) {
  const double chi2 = quadratic_form(weights, seen.error);
  const Sym3 trusted = scale(weights, chi2 > kOutlier ? kOutlier / chi2 : 1.0);
  // The whole error of the raw odometry: what it was corrected by, too.
  const OdometryBias applied = config_.learn_bias ? bias_ : OdometryBias{};
  const auto whole_of = [&](double error, double by_scale, double by_distance, double by_turn) {
    return error + applied.scale * by_scale + applied.angle_per_m * by_distance + applied.angle_per_rad * by_turn;
  };
  const Pose2 whole{whole_of(seen.error.x, seen.by_scale.x, seen.by_distance.x, seen.by_turn.x),
                    whole_of(seen.error.y, seen.by_scale.y, seen.by_distance.y, seen.by_turn.y),
                    whole_of(seen.error.theta, seen.by_scale.theta, seen.by_distance.theta, seen.by_turn.theta)};
  const Pose2 s = product(trusted, seen.by_scale);
  const Pose2 d = product(trusted, seen.by_distance);
  const Pose2 a = product(trusted, seen.by_turn);
  const double keep = memory();
  evidence_ = scale(evidence_, keep) + Sym3{dot(s, seen.by_scale),    dot(s, seen.by_distance), dot(s, seen.by_turn),
                                            dot(d, seen.by_distance), dot(d, seen.by_turn),     dot(a, seen.by_turn)};
  pull_ = {keep * pull_.x + dot(s, whole), keep * pull_.y + dot(d, whole), keep * pull_.theta + dot(a, whole)};
  const Sym3 prior = prior_covariance(config_);
  if (!invert(evidence_ + diagonal(1.0 / prior.xx, 1.0 / prior.yy, 1.0 / prior.tt), spread_)) {
    return;
  }
  const Pose2 b = product(spread_, pull_);
  const auto within = [](double value, float sigma) {
    return clamped(value, -kMostSigmas * wide(sigma), kMostSigmas * wide(sigma));
  };
  bias_ = {within(b.x, config_.scale_sigma), within(b.y, config_.angle_per_m_sigma),
           within(b.theta, config_.angle_per_rad_sigma)};
}

}  // namespace mellin
