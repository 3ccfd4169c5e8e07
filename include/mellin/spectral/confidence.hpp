// How likely a registered pose is right, from all the evidence for it: agreement of what both observed, how well the
// obstacles lie on each other, the correlation peak, the overlap, and by how much it is better than the next distinct
// hypothesis. Not in the paper, which puts one threshold on the peak (IV-B3).
//
// A logistic regression. `mellin eval confidence` fits its weights on logs with ground truth and draws the reliability
// diagram on others; the defaults are what it printed for the logs named at ConfidenceModel.
#pragma once

#include <cstddef>

namespace mellin {

/// What speaks for a pose, and for the best rival: a hypothesis about the same pair that puts b elsewhere.
struct PoseEvidence {
  float agreement = 0.0F;       ///< Agreement::score under the pose, 0 … 1
  float inlier_share = 0.0F;    ///< AlignmentResult::inlier_share, 0 … 1
  float overlap = 0.0F;         ///< Agreement::overlap, 0 … 1
  float peak = 0.0F;            ///< of the matched filter, 0 … 1
  float rival_strength = 0.0F;  ///< agreement times inlier_share of the strongest rival; 0 where there is none
  float rival_peak = 0.0F;      ///< highest peak of the rivals
};

/// Weights of what is made of the evidence; none but the first is negative, so that evidence never speaks against.
struct ConfidenceModel {
  static constexpr std::size_t kWeights = 7;
  /// What `mellin eval confidence intel.log.gz aces.log.gz offices2.log fr079.log.gz offices1.log --fit 3 --pairs 300
  /// -o DIR` prints, offices1 and 2 being `mellin sim --kind offices` of the seeds 1 and 2: fitted on submaps of 20, 40
  /// and 80 scans of the first three, judged on the others. The peak tells nothing that its ratio to the
  /// rival's does not.
  float weights[kWeights] = {-8.133F, 0.5F, 1.481F, 0.0F, 4.0F, 12.399F, 1.454F};
};

/// The terms that the weights belong to: 1, ln(a / (1 - a)) of the agreement and of the inlier share (both cut to 0.01
/// … 0.99), ln(peak) (cut at 0.01), the root of the overlap, strength minus that of the rival (cut to -0.3 … 0.3), ln
/// of the peak over the rival's (cut to -1 … 1.5).
void confidence_terms(const PoseEvidence& evidence, float (&terms)[ConfidenceModel::kWeights]);

/// Probability, 0 … 1, that the pose is within 0.5 m and 4 degrees. Numbers that are not finite count as no evidence.
float confidence(const PoseEvidence& evidence, const ConfidenceModel& model = {});

/// p / (1 - p), finite: p is taken for at most 1 - 1e-6.
float odds(float probability);

/// What is left of a hypothesis' probability beside rivals of which at most one can be right: o / (1 + o + the rivals'
/// odds together), o its own. The regression sees each rival's evidence but not that there may be several equal ones:
/// of n that are sure alone, as in a round or a square room, each is left 1 / n at most.
float beside_rivals(float probability, float rival_odds);

}  // namespace mellin
