// Peaks of cyclic correlations: where they are, between the pixels, too, and how high.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/span.hpp"
#include "mellin/spectral/matcher_config.hpp"

namespace mellin {

/// Index i + offset in a cyclic line of `size`; |offset| <= size.
inline std::size_t cyclic(std::size_t i, int offset, std::size_t size) {
  return (i + size + static_cast<std::size_t>(static_cast<std::ptrdiff_t>(offset))) % size;
}

/// Whether line[i] is the highest among two neighbours on either side, so that one hump gives one peak.
bool is_peak(Span<const float> line, std::size_t i);

/// The highest of `count` values, or 0 where none is over it.
float highest(const float* values, std::size_t count);

/// The correlation round a peak: a square, or one row of it.
class PeakWindow {
 public:
  static constexpr int kMaxRadius = 3;

  /// What is read for a fit of `config`: enough for its curvature, too.
  static int radius_for(const MatcherConfig& config) {
    return config.peak_fit == PeakFit::gaussian || config.com_radius == 0 ? 1 : config.com_radius;
  }

  /// Row dy of the window from a cyclic row of the correlation, column `column` in the middle.
  void set_row(int dy, Span<const float> row, std::size_t column, int radius) {
    for (int dx = -radius; dx <= radius; ++dx) {
      at(dx, dy) = row[cyclic(column, dx, row.size())];
    }
  }
  float& at(int dx, int dy) { return values_[index(dx, dy)]; }
  float at(int dx, int dy) const { return values_[index(dx, dy)]; }

 private:
  static constexpr std::size_t kWidth = 2 * kMaxRadius + 1;
  static constexpr std::size_t index(int dx, int dy) {
    return static_cast<std::size_t>(dy + kMaxRadius) * kWidth + static_cast<std::size_t>(dx + kMaxRadius);
  }
  float values_[kWidth * kWidth] = {};
};

/// From the highest pixel to the peak, pixels.
struct PeakOffset {
  double x = 0.0;
  double y = 0.0;
};

/// By config.peak_fit and com_radius. `rows`: radius of the window along y, 0 for a single row.
PeakOffset peak_offset(const PeakWindow& window, int rows, const MatcherConfig& config);

/// What a correlation was made of: whitened spectra have sharp peaks, correlation coefficients broad ones.
enum class PeakKind : std::uint8_t { whitened, coefficient };

/// Variance of a fitted position without any noise, pixels squared, from pictures being pixels and from what the fit
/// leans to. That of the highest pixel is uniform, the others are as measured on drawn offices (tests/
/// matcher_covariance_test.cpp holds the sum).
double fit_variance(const MatcherConfig& config, PeakKind kind);

/// Second differences of the correlation at its highest pixel, turned positive for a peak, per pixel squared.
struct Curvature {
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
};
Curvature curvature(const PeakWindow& window, int rows);

/// Covariance of a peak's position, pixels squared.
struct PeakSpread {
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
};
/// A peak is where the gradient is 0. Noise whose gradient has the variance `gradient_noise` along each axis moves it
/// by H^-1 times that gradient, H the curvature: covariance gradient_noise H^-2. Along a direction without curvature
/// the deviation is `most`, and it is never more.
PeakSpread spread_by_gradient(const Curvature& curvature, double gradient_noise, double most);
/// For a correlation coefficient, whose noise has the spectrum of the signal: covariance noise H^-1.
PeakSpread spread_by_noise(const Curvature& curvature, double noise, double most);

}  // namespace mellin
