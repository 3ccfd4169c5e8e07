#include "host/logistic.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mellin::host {
namespace {

using Vector = std::vector<double>;

/// Solves A x = b for a symmetric positive definite A (row-major) by Cholesky's factors.
Vector solve(Vector a, Vector b) {
  const std::size_t n = b.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i * n + j];
      for (std::size_t k = 0; k < j; ++k) {
        sum -= a[i * n + k] * a[j * n + k];
      }
      a[i * n + j] = i == j ? std::sqrt(std::max(sum, 1e-12)) : sum / a[j * n + j];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      b[i] -= a[i * n + k] * b[k];
    }
    b[i] /= a[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) {
      b[i] -= a[k * n + i] * b[k];
    }
    b[i] /= a[i * n + i];
  }
  return b;
}

double dot(const Vector& a, const Vector& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += a[i] * b[i];
  }
  return sum;
}

void check(const std::vector<Judged>& samples, std::size_t count) {
  const auto right = std::count_if(samples.begin(), samples.end(), [](const Judged& s) { return s.right; });
  if (right == 0 || static_cast<std::size_t>(right) == samples.size()) {
    throw std::invalid_argument("a regression needs right and wrong samples, found " + std::to_string(right) +
                                " right of " + std::to_string(samples.size()));
  }
  for (const Judged& sample : samples) {
    if (sample.terms.size() != count) {
      throw std::invalid_argument("expected " + std::to_string(count) + " terms a sample, found " +
                                  std::to_string(sample.terms.size()));
    }
  }
}

Vector variances(const std::vector<Judged>& samples, std::size_t count) {
  Vector mean(count);
  Vector square(count);
  for (const Judged& sample : samples) {
    for (std::size_t i = 0; i < count; ++i) {
      mean[i] += sample.terms[i] / static_cast<double>(samples.size());
      square[i] += sample.terms[i] * sample.terms[i] / static_cast<double>(samples.size());
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    square[i] -= mean[i] * mean[i];
  }
  return square;
}

/// Negative log-likelihood per sample, with the ridge.
double cost_of(const std::vector<Judged>& samples, const Vector& weights, const Vector& penalty) {
  double cost = 0.0;
  for (const Judged& sample : samples) {
    const double z = (sample.right ? 1.0 : -1.0) * dot(weights, sample.terms);
    cost += (z > 0.0 ? std::log1p(std::exp(-z)) : -z + std::log1p(std::exp(z))) / static_cast<double>(samples.size());
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    cost += 0.5 * penalty[i] * weights[i] * weights[i];
  }
  return cost;
}

}  // namespace

std::vector<double> fit_logistic(const std::vector<Judged>& samples, const std::vector<double>& least, double ridge) {
  const std::size_t n = least.size();
  check(samples, n);
  Vector penalty = variances(samples, n);
  for (double& p : penalty) {
    p *= ridge;
  }
  penalty[0] = 0.0;
  Vector weights(n);
  std::vector<bool> held(n, false);  // at its least value
  for (int iteration = 0; iteration < 100; ++iteration) {
    Vector gradient(n);
    Vector hessian(n * n);
    for (const Judged& sample : samples) {
      const double p = 1.0 / (1.0 + std::exp(-dot(weights, sample.terms)));
      const double share = 1.0 / static_cast<double>(samples.size());
      for (std::size_t i = 0; i < n; ++i) {
        gradient[i] += share * (p - (sample.right ? 1.0 : 0.0)) * sample.terms[i];
        for (std::size_t j = 0; j < n; ++j) {
          hessian[i * n + j] += share * p * (1.0 - p) * sample.terms[i] * sample.terms[j];
        }
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      gradient[i] += penalty[i] * weights[i];
      hessian[i * n + i] += penalty[i] + 1e-9;
      held[i] = weights[i] <= least[i] && gradient[i] > 0.0;
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (held[i]) {
        gradient[i] = 0.0;
        for (std::size_t j = 0; j < n; ++j) {
          hessian[i * n + j] = hessian[j * n + i] = i == j ? 1.0 : 0.0;
        }
      }
    }
    const Vector step = solve(hessian, gradient);
    const double before = cost_of(samples, weights, penalty);
    Vector next = weights;
    for (int halvings = 0; halvings < 20; ++halvings) {
      const double scale = std::ldexp(1.0, -halvings);
      for (std::size_t i = 0; i < n; ++i) {
        next[i] = std::max(weights[i] - scale * step[i], least[i]);
      }
      if (cost_of(samples, next, penalty) <= before) {
        break;
      }
    }
    double moved = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      moved = std::max(moved, std::fabs(next[i] - weights[i]));
    }
    weights = next;
    if (moved < 1e-7) {
      break;
    }
  }
  return weights;
}

std::vector<ReliabilityBin> reliability(const std::vector<Stated>& stated, std::size_t bins) {
  std::vector<ReliabilityBin> out(bins);
  for (std::size_t i = 0; i < bins; ++i) {
    out[i].from = static_cast<double>(i) / static_cast<double>(bins);
    out[i].to = static_cast<double>(i + 1) / static_cast<double>(bins);
  }
  for (const Stated& s : stated) {
    const auto at = static_cast<std::size_t>(std::clamp(s.probability, 0.0, 1.0) * static_cast<double>(bins));
    ReliabilityBin& bin = out[std::min(at, bins - 1)];
    bin.count += 1;
    bin.stated += s.probability;
    bin.observed += s.right ? 1.0 : 0.0;
  }
  for (ReliabilityBin& bin : out) {
    const double count = static_cast<double>(std::max<std::size_t>(bin.count, 1));
    bin.stated /= count;
    bin.observed /= count;
  }
  return out;
}

double calibration_error(const std::vector<ReliabilityBin>& bins) {
  double sum = 0.0;
  double count = 0.0;
  for (const ReliabilityBin& bin : bins) {
    sum += static_cast<double>(bin.count) * std::fabs(bin.stated - bin.observed);
    count += static_cast<double>(bin.count);
  }
  return count > 0.0 ? sum / count : 0.0;
}

double brier_score(const std::vector<Stated>& stated) {
  double sum = 0.0;
  for (const Stated& s : stated) {
    const double off = s.probability - (s.right ? 1.0 : 0.0);
    sum += off * off;
  }
  return stated.empty() ? 0.0 : sum / static_cast<double>(stated.size());
}

}  // namespace mellin::host
