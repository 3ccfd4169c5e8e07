#include "mellin/spectral/confidence.hpp"

#include <algorithm>
#include <cmath>

#include "mellin/core/math.hpp"

namespace mellin {
namespace {

/// Numbers that are not finite become `lowest`.
double clamped(float value, double lowest, double highest) {
  return std::isfinite(value) ? std::clamp(static_cast<double>(value), lowest, highest) : lowest;
}

float log_odds(float share) {
  const double p = clamped(share, 0.01, 0.99);
  return static_cast<float>(log(p / (1.0 - p)));
}

}  // namespace

void confidence_terms(const PoseEvidence& e, float (&terms)[ConfidenceModel::kWeights]) {
  const double peak = clamped(e.peak, 0.01, 1.0);
  // A rival that is not known to be weak is taken for strong.
  const double rival_strength = std::isfinite(e.rival_strength) ? static_cast<double>(e.rival_strength) : 1.0;
  const double rival_peak = std::isfinite(e.rival_peak) ? std::max(static_cast<double>(e.rival_peak), 0.001) : 1.0;
  const double strength = clamped(e.agreement, 0.0, 1.0) * clamped(e.inlier_share, 0.0, 1.0);
  terms[0] = 1.0F;
  terms[1] = log_odds(e.agreement);
  terms[2] = log_odds(e.inlier_share);
  terms[3] = static_cast<float>(log(peak));
  terms[4] = static_cast<float>(sqrt(clamped(e.overlap, 0.0, 1.0)));
  terms[5] = static_cast<float>(std::clamp(strength - rival_strength, -0.3, 0.3));
  terms[6] = static_cast<float>(std::clamp(log(peak / rival_peak), -1.0, 1.5));
}

float confidence(const PoseEvidence& evidence, const ConfidenceModel& model) {
  float terms[ConfidenceModel::kWeights];
  confidence_terms(evidence, terms);
  double sum = 0.0;
  for (std::size_t i = 0; i < ConfidenceModel::kWeights; ++i) {
    sum += static_cast<double>(model.weights[i]) * static_cast<double>(terms[i]);
  }
  return static_cast<float>(1.0 / (1.0 + exp(std::clamp(-sum, -60.0, 60.0))));
}

float odds(float probability) {
  const float p = std::clamp(probability, 0.0F, 1.0F - 1e-6F);
  return p / (1.0F - p);
}

float beside_rivals(float probability, float rival_odds) {
  const float own = odds(probability);
  return own / (1.0F + own + rival_odds);
}

}  // namespace mellin
