// The figures of merit of the evaluation (paper, Section V): precision and recall of decisions, errors of registration,
// each against the threshold on the score.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace mellin::host {

/// A pair and what was decided about it. Detection: wanted and right where the pair overlaps. Joint with registration:
/// wanted where it overlaps, right where the pose is.
struct Decision {
  double score = 0.0;   ///< the decision is yes from a threshold on
  bool wanted = false;  ///< yes is asked for
  bool right = false;   ///< yes is no mistake
  double weight = 1.0;  ///< how many pairs it stands for, where they were sampled
};

struct PrecisionRecall {
  double threshold = 0.0;
  double precision = 0.0;  ///< right ones among those accepted
  double recall = 0.0;     ///< right and wanted ones that are accepted, among the wanted ones
};

/// A point for each distinct score, by falling threshold. Empty where nothing is wanted.
std::vector<PrecisionRecall> precision_recall(std::vector<Decision> decisions);

/// Area under the curve as the mean of the precision over the steps of recall, without interpolation.
double average_precision(const std::vector<PrecisionRecall>& curve);
/// Largest recall at which the precision is at least so much; 0 where there is none.
double recall_at_precision(const std::vector<PrecisionRecall>& curve, double precision);
/// Largest harmonic mean of precision and recall.
double best_f1(const std::vector<PrecisionRecall>& curve);

/// A pair and how far its found pose is from the true one.
struct PoseDecision {
  double score = 0.0;
  bool wanted = false;  ///< the pair overlaps enough to be asked for
  double metres = 0.0;
  double degrees = 0.0;
  double weight = 1.0;
};

/// A pose within both is right.
struct PoseLimits {
  double metres = 0.5;
  double degrees = 4.0;
  bool hold(const PoseDecision& pose) const { return pose.metres <= metres && pose.degrees <= degrees; }
};

/// Of the pairs accepted from a threshold on.
struct PoseErrors {
  double threshold = 0.0;
  double recall = 0.0;  ///< wanted pairs that are accepted, among the wanted ones
  double median_m = 0.0;
  double max_m = 0.0;
  double median_deg = 0.0;
  double max_deg = 0.0;
};

/// Figs. 6 and 7: a point for each distinct score, by falling threshold. Empty where nothing is wanted.
std::vector<PoseErrors> pose_errors(std::vector<PoseDecision> decisions);

/// Section V-B's rule: the lowest score as threshold from which on no accepted pair is beyond the limits. None where
/// the best score is wrong already.
std::optional<double> acceptance_threshold(const std::vector<PoseDecision>& decisions, const PoseLimits& limits = {});

/// What a threshold does.
struct Held {
  std::size_t accepted = 0;
  std::size_t wrong = 0;  ///< accepted and beyond the limits
  PoseErrors errors;
};
Held hold_threshold(const std::vector<PoseDecision>& decisions, double threshold, const PoseLimits& limits = {});

/// The value below which a share of the weight lies: lower weighted quantile. Requires a value.
struct Weighted {
  double value = 0.0;
  double weight = 1.0;
};
double quantile(std::vector<Weighted> values, double share);

/// y = intercept + slope x by least squares. Requires two different x.
struct Line {
  double intercept = 0.0;
  double slope = 0.0;
};
Line fit_line(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace mellin::host
