#include "spectral/peaks.hpp"

#include <algorithm>

#include "mellin/core/math.hpp"
#include "mellin/spectral/fft2.hpp"

namespace mellin {

namespace {

/// Eq. 3; values under 0 are taken for 0. The middle is over 0.
PeakOffset centre_of_mass(const PeakWindow& window, int rows, int columns) {
  float mass = 0.0F;
  float moment_x = 0.0F;
  float moment_y = 0.0F;
  for (int dy = -rows; dy <= rows; ++dy) {
    for (int dx = -columns; dx <= columns; ++dx) {
      const float value = std::max(window.at(dx, dy), 0.0F);
      mass += value;
      moment_x += value * static_cast<float>(dx);
      moment_y += value * static_cast<float>(dy);
    }
  }
  return {static_cast<double>(moment_x / mass), static_cast<double>(moment_y / mass)};
}

bool can_fit_gaussian(float before, float middle, float behind) {
  return before > 0.0F && behind > 0.0F && middle > 0.0F && middle >= before && middle >= behind &&
         (middle > before || middle > behind);
}

/// A Gaussian's logarithm is a parabola: its vertex, from the middle, within half a pixel of it.
double gaussian_vertex(float before, float middle, float behind) {
  const double left = log(static_cast<double>(before));
  const double centre = log(static_cast<double>(middle));
  const double right = log(static_cast<double>(behind));
  return 0.5 * (left - right) / (left - 2.0 * centre + right);
}

}  // namespace

bool is_peak(Span<const float> line, std::size_t i) {
  constexpr std::size_t kNeighbours = 2;
  for (std::size_t k = 1; k <= kNeighbours; ++k) {
    const int offset = static_cast<int>(k);
    // Of equal neighbours the first is the peak.
    if (line[i] <= line[cyclic(i, -offset, line.size())] || line[i] < line[cyclic(i, offset, line.size())]) {
      return false;
    }
  }
  return true;
}

float highest(const float* values, std::size_t count) {
  // Lanes without order between them, so that the compiler may take them side by side. Sides are even.
  float lanes[2 * Fft2::kBlock] = {};
  constexpr std::size_t kLanes = 2 * Fft2::kBlock;
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      lanes[k] = values[i + k] > lanes[k] ? values[i + k] : lanes[k];
    }
  }
  float result = 0.0F;
  for (; i < count; ++i) {
    result = std::max(result, values[i]);
  }
  for (const float lane : lanes) {
    result = std::max(result, lane);
  }
  return result;
}

PeakOffset peak_offset(const PeakWindow& window, int rows, const MatcherConfig& config) {
  if (config.peak_fit == PeakFit::centre_of_mass) {
    const int radius = config.com_radius;
    return centre_of_mass(window, std::min(rows, radius), radius);
  }
  PeakOffset offset = centre_of_mass(window, std::min(rows, 1), 1);
  const float middle = window.at(0, 0);
  if (can_fit_gaussian(window.at(-1, 0), middle, window.at(1, 0))) {
    offset.x = gaussian_vertex(window.at(-1, 0), middle, window.at(1, 0));
  }
  if (rows > 0 && can_fit_gaussian(window.at(0, -1), middle, window.at(0, 1))) {
    offset.y = gaussian_vertex(window.at(0, -1), middle, window.at(0, 1));
  }
  return offset;
}

double fit_variance(const MatcherConfig& config, PeakKind kind) {
  const bool sharp = kind == PeakKind::whitened;
  if (config.peak_fit == PeakFit::gaussian) {
    return sharp ? 0.005 : 0.0036;
  }
  if (config.com_radius == 0) {
    return 1.0 / 12.0;
  }
  return sharp ? 0.01 : 0.05;
}

Curvature curvature(const PeakWindow& window, int rows) {
  const auto at = [&](int dx, int dy) { return static_cast<double>(window.at(dx, dy)); };
  Curvature c;
  c.xx = 2.0 * at(0, 0) - at(-1, 0) - at(1, 0);
  if (rows > 0) {
    c.yy = 2.0 * at(0, 0) - at(0, -1) - at(0, 1);
    c.xy = 0.25 * (at(1, -1) + at(-1, 1) - at(-1, -1) - at(1, 1));
  }
  return c;
}

namespace {

/// variance(eigenvalue) on the eigenvectors of `h`: no angles are needed for two rows and columns.
template <class Variance>
PeakSpread on_eigenvectors(const Curvature& h, const Variance& variance) {
  const double mean = 0.5 * (h.xx + h.yy);
  const double half = 0.5 * (h.xx - h.yy);
  const double radius = sqrt(half * half + h.xy * h.xy);
  const double low = variance(mean - radius);
  const double high = variance(mean + radius);
  const double slope = radius > 0.0 ? 0.5 * (high - low) / radius : 0.0;
  return {0.5 * (low + high) + slope * half, slope * h.xy, 0.5 * (low + high) - slope * half};
}

}  // namespace

PeakSpread spread_by_gradient(const Curvature& curvature, double gradient_noise, double most) {
  const double least = sqrt(gradient_noise) / most;
  return on_eigenvectors(curvature, [=](double h) { return h > least ? gradient_noise / (h * h) : most * most; });
}

PeakSpread spread_by_noise(const Curvature& curvature, double noise, double most) {
  const double least = noise / (most * most);
  return on_eigenvectors(curvature, [=](double h) { return h > least ? noise / h : most * most; });
}

}  // namespace mellin
