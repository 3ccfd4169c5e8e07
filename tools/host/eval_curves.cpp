#include "host/eval_curves.hpp"

#include <algorithm>

namespace mellin::host {
namespace {

template <class T>
void sort_by_falling_score(std::vector<T>& decisions) {
  std::stable_sort(decisions.begin(), decisions.end(), [](const T& p, const T& q) { return p.score > q.score; });
}

/// Values in order with their weights, whose median is asked for as they come in.
class RunningMedian {
 public:
  void add(double value, double weight) {
    const auto at = std::upper_bound(values_.begin(), values_.end(), value,
                                     [](double v, const Weighted& other) { return v < other.value; });
    values_.insert(at, {value, weight});
    total_ += weight;
  }
  double median() const {
    double below = 0.0;
    for (const Weighted& v : values_) {
      below += v.weight;
      if (below >= 0.5 * total_) {
        return v.value;
      }
    }
    return 0.0;
  }

 private:
  std::vector<Weighted> values_;
  double total_ = 0.0;
};

template <class T>
double wanted_weight(const std::vector<T>& decisions) {
  double wanted = 0.0;
  for (const T& decision : decisions) {
    wanted += decision.wanted ? decision.weight : 0.0;
  }
  return wanted;
}

}  // namespace

std::vector<PrecisionRecall> precision_recall(std::vector<Decision> decisions) {
  sort_by_falling_score(decisions);
  const double wanted = wanted_weight(decisions);
  std::vector<PrecisionRecall> curve;
  double accepted = 0.0;
  double right = 0.0;
  double found = 0.0;
  for (std::size_t i = 0; wanted > 0.0 && i < decisions.size(); ++i) {
    const Decision& d = decisions[i];
    accepted += d.weight;
    right += d.right ? d.weight : 0.0;
    found += d.right && d.wanted ? d.weight : 0.0;
    if (i + 1 == decisions.size() || decisions[i + 1].score < d.score) {
      curve.push_back({d.score, right / accepted, found / wanted});
    }
  }
  return curve;
}

double average_precision(const std::vector<PrecisionRecall>& curve) {
  double area = 0.0;
  double before = 0.0;
  for (const PrecisionRecall& point : curve) {
    area += (point.recall - before) * point.precision;
    before = point.recall;
  }
  return area;
}

double recall_at_precision(const std::vector<PrecisionRecall>& curve, double precision) {
  double recall = 0.0;
  for (const PrecisionRecall& point : curve) {
    recall = point.precision >= precision ? std::max(recall, point.recall) : recall;
  }
  return recall;
}

double best_f1(const std::vector<PrecisionRecall>& curve) {
  double best = 0.0;
  for (const PrecisionRecall& point : curve) {
    const double sum = point.precision + point.recall;
    best = sum > 0.0 ? std::max(best, 2.0 * point.precision * point.recall / sum) : best;
  }
  return best;
}

std::vector<PoseErrors> pose_errors(std::vector<PoseDecision> decisions) {
  sort_by_falling_score(decisions);
  const double wanted = wanted_weight(decisions);
  std::vector<PoseErrors> curve;
  RunningMedian metres;
  RunningMedian degrees;
  PoseErrors at;
  double found = 0.0;
  for (std::size_t i = 0; wanted > 0.0 && i < decisions.size(); ++i) {
    const PoseDecision& d = decisions[i];
    metres.add(d.metres, d.weight);
    degrees.add(d.degrees, d.weight);
    found += d.wanted ? d.weight : 0.0;
    at.max_m = std::max(at.max_m, d.metres);
    at.max_deg = std::max(at.max_deg, d.degrees);
    if (i + 1 == decisions.size() || decisions[i + 1].score < d.score) {
      at.threshold = d.score;
      at.recall = found / wanted;
      at.median_m = metres.median();
      at.median_deg = degrees.median();
      curve.push_back(at);
    }
  }
  return curve;
}

std::optional<double> acceptance_threshold(const std::vector<PoseDecision>& decisions, const PoseLimits& limits) {
  std::optional<double> best_wrong;
  for (const PoseDecision& d : decisions) {
    if (!limits.hold(d) && (!best_wrong || d.score > *best_wrong)) {
      best_wrong = d.score;
    }
  }
  std::optional<double> threshold;
  for (const PoseDecision& d : decisions) {
    if ((!best_wrong || d.score > *best_wrong) && (!threshold || d.score < *threshold)) {
      threshold = d.score;
    }
  }
  return threshold;
}

Held hold_threshold(const std::vector<PoseDecision>& decisions, double threshold, const PoseLimits& limits) {
  Held held;
  held.errors.threshold = threshold;
  std::vector<PoseDecision> accepted;
  for (const PoseDecision& d : decisions) {
    if (d.score >= threshold) {
      accepted.push_back(d);
      held.wrong += limits.hold(d) ? 0U : 1U;
    }
  }
  held.accepted = accepted.size();
  const double wanted = wanted_weight(decisions);
  held.errors.recall = wanted > 0.0 ? wanted_weight(accepted) / wanted : 0.0;
  RunningMedian metres;
  RunningMedian degrees;
  for (const PoseDecision& d : accepted) {
    metres.add(d.metres, d.weight);
    degrees.add(d.degrees, d.weight);
    held.errors.max_m = std::max(held.errors.max_m, d.metres);
    held.errors.max_deg = std::max(held.errors.max_deg, d.degrees);
  }
  held.errors.median_m = metres.median();
  held.errors.median_deg = degrees.median();
  return held;
}

double quantile(std::vector<Weighted> values, double share) {
  std::sort(values.begin(), values.end(), [](const Weighted& p, const Weighted& q) { return p.value < q.value; });
  double total = 0.0;
  for (const Weighted& v : values) {
    total += v.weight;
  }
  double below = 0.0;
  for (const Weighted& v : values) {
    below += v.weight;
    if (below >= share * total) {
      return v.value;
    }
  }
  return values.back().value;
}

Line fit_line(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double sx = 0.0;
  double sy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sx += x[i] / n;
    sy += y[i] / n;
  }
  double xx = 0.0;
  double xy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - sx) * (x[i] - sx);
    xy += (x[i] - sx) * (y[i] - sy);
  }
  const double slope = xy / xx;
  return {sy - slope * sx, slope};
}

}  // namespace mellin::host
