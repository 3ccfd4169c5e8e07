// Logistic regression: the weights under which the logistic function of weighted terms is the probability of yes, and
// how well such probabilities hold.
#pragma once

#include <cstddef>
#include <vector>

namespace mellin::host {

/// Something that was judged: terms of its evidence, the first of them 1, and whether it was right.
struct Judged {
  std::vector<double> terms;
  bool right = false;
};

/// Maximum likelihood by Newton's method. `least[i]` is what weight i may not fall below: a term that can only speak
/// for yes keeps a weight that is not negative. `ridge` pulls all weights but the first to 0, per sample and by each
/// term's variance. Throws std::invalid_argument without samples of both kinds, or where the terms differ in number.
std::vector<double> fit_logistic(const std::vector<Judged>& samples, const std::vector<double>& least,
                                 double ridge = 1e-3);

/// A stated probability and what came of it.
struct Stated {
  double probability = 0.0;
  bool right = false;
};

struct ReliabilityBin {
  double from = 0.0;
  double to = 0.0;
  std::size_t count = 0;
  double stated = 0.0;    ///< mean probability
  double observed = 0.0;  ///< share of right ones
};

/// Bins of equal width over 0 … 1; empty bins stay.
std::vector<ReliabilityBin> reliability(const std::vector<Stated>& stated, std::size_t bins);
/// Mean distance of stated and observed, weighted by the bins' counts.
double calibration_error(const std::vector<ReliabilityBin>& bins);
/// Mean of (probability - outcome)^2 (Brier 1950).
double brier_score(const std::vector<Stated>& stated);

}  // namespace mellin::host
