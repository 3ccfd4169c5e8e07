#include "mellin/spectral/rotation.hpp"

#include <algorithm>
#include <cmath>

#include "mellin/core/math.hpp"
#include "spectral/peaks.hpp"
#include "spectral/resample.hpp"

namespace mellin {

namespace {

/// Half a turn in equal steps, from -90 degrees on: the half plane that a spectrum stores.
void fill_directions(Span<Complex> directions) {
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const SinCos turn = sincos(kPi * static_cast<double>(i) / static_cast<double>(directions.size()));
    directions[i] = {static_cast<float>(turn.sin), static_cast<float>(-turn.cos)};
  }
}

float magnitude(Complex z) { return std::sqrt(z.re * z.re + z.im * z.im); }

/// a times the conjugate of b.
Complex cross(Complex a, Complex b) { return {a.re * b.re + a.im * b.im, a.im * b.re - a.re * b.im}; }

}  // namespace

Status RotationEstimator::init(const MatcherConfig& config, const Memory& memory, const Scratch& scratch) {
  const std::size_t side = config.side;
  stage_ = Stage::idle;
  const bool enough = memory.directions.size() == angles(config) && memory.correlation.size() == side &&
                      memory.rows.size() == (seeks_scale(config) ? angles(config) : 0) &&
                      scratch.magnitudes.size() == spectrum_size(config.side) &&
                      scratch.rows.size() >= Fft2::kBlock * side && scratch.line.size() >= side / 2 + 1 &&
                      scratch.surface.size() == spectrum_size(config.side);
  if (!enough) {
    return Status::insufficient_memory;
  }
  config_ = config;
  memory_ = memory;
  scratch_ = scratch;
  fill_directions(memory.directions);
  return Status::ok;
}

double RotationEstimator::note_column(const Complex* column, std::size_t kx) {
  const std::size_t side = config_.side;
  float* const magnitudes = scratch_.magnitudes.data() + kx * side;
  double sum = 0.0;
  for (std::size_t i = 0; i < side; ++i) {
    magnitudes[i] = magnitude(column[i]);
    sum += static_cast<double>(magnitudes[i]);
  }
  if (config_.high_pass == HighPass::radius) {
    const auto fx = static_cast<float>(kx);
    for (std::size_t i = 0; i < side; ++i) {
      const auto fy = static_cast<float>(std::min(i, side - i));
      magnitudes[i] *= std::sqrt(fx * fx + fy * fy);
    }
  } else if (config_.high_pass == HighPass::reddy) {
    weigh_by_reddy(kx, magnitudes);
  }
  return sum;
}

void RotationEstimator::weigh_by_reddy(std::size_t kx, float* magnitudes) {
  const std::size_t side = config_.side;
  // The correlation is not in use while features are made: the cosines along one axis, of positive frequencies as of
  // negative ones.
  float* const cosines = memory_.correlation.data();
  if (kx == 0) {
    for (std::size_t i = 0; i < side; ++i) {
      const double frequency = static_cast<double>(std::min(i, side - i)) / static_cast<double>(side);
      cosines[i] = static_cast<float>(sincos(kPi * frequency).cos);
    }
  }
  for (std::size_t i = 0; i < side; ++i) {
    const float x = cosines[kx] * cosines[i];
    magnitudes[i] *= (1.0F - x) * (2.0F - x);
  }
}

void RotationEstimator::begin_describe(Span<Complex> polar) {
  out_ = polar;
  sum_ = 0.0;
  status_ = Status::ok;
  stage_ = Stage::sample;
  line_ = 0;
}

void RotationEstimator::begin_estimate(Span<const Complex> a, Span<const Complex> b, float least) {
  a_ = a;
  b_ = b;
  least_ = least;
  peaks_.clear();
  stage_ = Stage::correlate;
  line_ = 0;
}

bool RotationEstimator::step(Fft2& fft, std::size_t lines) {
  if (stage_ == Stage::idle) {
    return true;
  }
  const std::size_t all = lines_of(stage_);
  const std::size_t count = lines == 0 ? all - line_ : std::min(all - line_, lines);
  run(fft, line_, count);
  line_ += count;
  if (line_ == all) {
    stage_ = after(stage_);
    line_ = 0;
  }
  return stage_ == Stage::idle;
}

std::size_t RotationEstimator::lines_of(Stage stage) const {
  const std::size_t side = config_.side;
  switch (stage) {
    case Stage::sample:
      return by_rings() ? side / 2 : side;
    case Stage::transform:
      return side / 2 + 1;
    case Stage::scale:
    case Stage::correlate:
      return by_rings() ? side / 2 : side / 2 + 1;
    case Stage::search:
      return side;
    case Stage::find:
    case Stage::idle:
      break;
  }
  return 1;
}

void RotationEstimator::run(Fft2& fft, std::size_t first, std::size_t count) {
  switch (stage_) {
    case Stage::sample:
      return by_rings() ? sample_rings(fft, first, count) : sample_polar(fft, first, count);
    case Stage::transform:
      return transform_polar(fft, first, count);
    case Stage::scale:
      return by_rings() ? scale_rings(first, count) : whiten_polar(first, count);
    case Stage::correlate:
      if (by_rings()) {
        return correlate_rings(first, count);
      }
      return seeks_scale(config_) ? correlate_scales(fft, first, count) : correlate_polar(first, count);
    case Stage::search:
      return search_scales(fft, first, count);
    case Stage::find:
      return find_peaks(fft);
    case Stage::idle:
      return;
  }
}

RotationEstimator::Stage RotationEstimator::after(Stage stage) {
  switch (stage) {
    case Stage::sample:
      if (!by_rings()) {
        return Stage::transform;
      }
      [[fallthrough]];
    case Stage::transform:
      if (!(sum_ > 0.0)) {
        status_ = Status::degenerate;
        return Stage::idle;
      }
      return Stage::scale;
    case Stage::correlate:
      return seeks_scale(config_) ? Stage::search : Stage::find;
    case Stage::search:
      return Stage::find;
    case Stage::scale:
    case Stage::find:
    case Stage::idle:
      break;
  }
  return Stage::idle;
}

/// Of row `row` of the polar picture, frequency bins. Rings are a bin apart, and linear radii half of one, from the
/// lowest frequency to that of the pixels; logarithmic radii (side / 2) ^ (row / side).
float RotationEstimator::radius(std::size_t row) const {
  const auto side = static_cast<double>(config_.side);
  if (is_log_polar(config_)) {
    return static_cast<float>(exp(log(0.5 * side) * static_cast<double>(row) / side));
  }
  return by_rings() ? static_cast<float>(row + 1) : 0.5F * static_cast<float>(row + 1);
}

/// Without its mean a ring correlates as a coefficient does, and rings without angular structure have no say.
void RotationEstimator::sample_rings(const Fft2& fft, std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t width = side / 2 + 1;
  float* const ring = scratch_.rows.data();
  for (std::size_t i = first; i < first + count; ++i) {
    sample_ring(scratch_.magnitudes, side, radius(i), memory_.directions, ring);
    double sum = 0.0;
    for (std::size_t k = 0; k < side; ++k) {
      sum += static_cast<double>(ring[k]);
    }
    const auto mean = static_cast<float>(sum / static_cast<double>(side));
    for (std::size_t k = 0; k < side; ++k) {
      ring[k] -= mean;
    }
    Complex* const spectrum = out_.data() + i * width;
    fft.forward_line(ring, spectrum);
    // Coefficients between the first and the last stand for two of the whole spectrum.
    double energy = 0.0;
    for (std::size_t k = 0; k < width; ++k) {
      const Complex z = spectrum[k];
      const double weight = k == 0 || k == side / 2 ? 1.0 : 2.0;
      energy += weight * static_cast<double>(z.re * z.re + z.im * z.im);
    }
    sum_ += energy;
  }
}

void RotationEstimator::scale_rings(std::size_t first, std::size_t count) {
  const std::size_t width = config_.side / 2U + 1U;
  const auto scale = static_cast<float>(1.0 / sqrt(sum_));
  for (std::size_t i = first * width; i < (first + count) * width; ++i) {
    out_[i].re *= scale;
    out_[i].im *= scale;
  }
}

/// The correlations of all rings at once: their cross spectra are summed before the one inverse transform.
void RotationEstimator::correlate_rings(std::size_t first, std::size_t count) {
  const std::size_t width = config_.side / 2U + 1U;
  Complex* const sum = scratch_.line.data();
  if (first == 0) {
    std::fill(sum, sum + width, Complex{});
  }
  for (std::size_t i = first; i < first + count; ++i) {
    const Complex* const a = a_.data() + i * width;
    const Complex* const b = b_.data() + i * width;
    for (std::size_t k = 0; k < width; ++k) {
      const Complex z = cross(a[k], b[k]);
      sum[k].re += z.re;
      sum[k].im += z.im;
    }
  }
}

/// Rows of the polar picture into row spectra. Angles beyond 180 degrees repeat those before.
void RotationEstimator::sample_polar(Fft2& fft, std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  for (std::size_t r = first; r < first + count; r += Fft2::kBlock) {
    const std::size_t rows = std::min(Fft2::kBlock, first + count - r);
    for (std::size_t i = 0; i < rows; ++i) {
      float* const row = scratch_.rows.data() + i * side;
      sample_ring(scratch_.magnitudes, side, radius(r + i), memory_.directions, row);
      std::copy(row, row + (side - angles(config_)), row + angles(config_));
    }
    fft.forward_rows(scratch_.rows.data(), r, rows, out_);
  }
}

void RotationEstimator::transform_polar(Fft2& fft, std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  fft.forward_columns(out_, first, count);
  for (std::size_t i = first * side; i < (first + count) * side; ++i) {
    sum_ += static_cast<double>(magnitude(out_[i]));
  }
}

/// The phases, scaled so that equal pictures have a peak of 1. With angles over the full circle, every other angular
/// frequency is nothing but rounding, and the floor leaves nothing of it.
void RotationEstimator::whiten_polar(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const double mean = sum_ / static_cast<double>(spectrum_size(config_.side));
  const auto floor = static_cast<float>(static_cast<double>(config_.whitening_floor) * mean);
  const auto scale = static_cast<float>(1.0 / sqrt(static_cast<double>(side * angles(config_))));
  for (std::size_t i = first * side; i < (first + count) * side; ++i) {
    const float weight = scale / (magnitude(out_[i]) + floor);
    out_[i] = {weight * out_[i].re, weight * out_[i].im};
  }
}

/// The row of the correlation surface without a shift along the radius.
void RotationEstimator::correlate_polar(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  for (std::size_t kx = first; kx < first + count; ++kx) {
    Complex sum;
    for (std::size_t i = kx * side; i < (kx + 1) * side; ++i) {
      const Complex z = cross(a_[i], b_[i]);
      sum.re += z.re;
      sum.im += z.im;
    }
    scratch_.line[kx] = sum;
  }
}

void RotationEstimator::correlate_scales(Fft2& fft, std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t last = side / 2;
  const auto cross_column = [&](std::size_t kx) {
    for (std::size_t i = kx * side; i < (kx + 1) * side; ++i) {
      scratch_.surface[i] = cross(a_[i], b_[i]);
    }
  };
  for (std::size_t kx = first; kx < std::min(first + count, last); ++kx) {
    cross_column(kx);
  }
  if (first == 0) {
    cross_column(last);  // goes back with column 0
  }
  fft.inverse_columns(scratch_.surface, first, count);
}

/// For each angle the best of all scales.
void RotationEstimator::search_scales(Fft2& fft, std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  for (std::size_t r = first; r < first + count; r += Fft2::kBlock) {
    const std::size_t rows = std::min(Fft2::kBlock, first + count - r);
    fft.inverse_rows(scratch_.surface, r, rows, scratch_.rows.data());
    for (std::size_t i = 0; i < rows; ++i) {
      const float* const row = scratch_.rows.data() + i * side;
      for (std::size_t k = 0; k < angles(config_); ++k) {
        if (r + i == 0 || row[k] > memory_.correlation[k]) {
          memory_.correlation[k] = row[k];
          memory_.rows[k] = static_cast<std::uint16_t>(r + i);
        }
      }
    }
  }
}

/// All high peaks, not only the highest (IV-B3).
void RotationEstimator::find_peaks(Fft2& fft) {
  if (!seeks_scale(config_)) {
    fft.inverse_line(scratch_.line.data(), memory_.correlation.data());
  }
  const Span<const float> correlation = memory_.correlation.first(angles(config_));
  const float least = std::max(config_.peak_share * highest(correlation.data(), correlation.size()), least_);
  FixedList<std::size_t, kMaxRotationPeaks> found;
  for (std::size_t i = 0; i < correlation.size(); ++i) {
    const float strength = correlation[i];
    if (!(strength > 0.0F) || strength < least || !is_peak(correlation, i)) {
      continue;
    }
    std::size_t at = 0;
    while (at < found.size() && correlation[found[at]] >= strength) {
      ++at;
    }
    found.insert(at, i);
  }
  for (const std::size_t angle : found) {
    peaks_.insert(peaks_.size(), refined(fft, angle));
  }
}

/// The peak at an angle, between angles and scales.
RotationPeak RotationEstimator::refined(Fft2& fft, std::size_t angle) const {
  const Span<const float> correlation = memory_.correlation.first(angles(config_));
  const int radius = PeakWindow::radius_for(config_);
  const double step_rad = kPi / static_cast<double>(correlation.size());
  PeakWindow window;
  RotationPeak peak;
  peak.strength = correlation[angle];
  if (!seeks_scale(config_)) {
    window.set_row(0, correlation, angle, radius);
    peak.angle_rad = (static_cast<double>(angle) + peak_offset(window, 0, config_).x) * step_rad;
    peak.variance = static_cast<float>(variance(window, 0) * step_rad * step_rad);
    return peak;
  }
  const std::size_t side = config_.side;
  const std::size_t top = memory_.rows[angle];
  for (int dy = -radius; dy <= radius; ++dy) {
    fft.inverse_rows(scratch_.surface, cyclic(top, dy, side), 1, scratch_.rows.data());
    window.set_row(dy, scratch_.rows.first(side), angle, radius);
  }
  const PeakOffset offset = peak_offset(window, radius, config_);
  // A shift of d rows towards higher frequencies means a picture smaller by (side / 2) ^ (d / side).
  const double rows = top < side / 2 ? static_cast<double>(top) : static_cast<double>(top) - static_cast<double>(side);
  peak.scale =
      static_cast<float>(exp(-log(0.5 * static_cast<double>(side)) * (rows + offset.y) / static_cast<double>(side)));
  peak.angle_rad = (static_cast<double>(angle) + offset.x) * step_rad;
  peak.variance = static_cast<float>(variance(window, radius) * step_rad * step_rad);
  return peak;
}

/// Of a peak's place along the angle, steps squared: what is not explained by the other picture is taken for noise.
/// Pictures differ by walls, and a wall is a ray through all rings: its noise is independent from angle to angle but
/// hardly from ring to ring, so that a few rings' worth of magnitudes count (tests/matcher_covariance_test.cpp).
double RotationEstimator::variance(const PeakWindow& window, int rows) const {
  constexpr double kIndependentRings = 6.0;
  constexpr double kIndependentRows = 10.0;
  const auto side = static_cast<double>(config_.side);
  const double most = 0.25 * side;
  const Curvature h = curvature(window, rows);
  if (by_rings()) {
    const double r = std::min(static_cast<double>(window.at(0, 0)), 1.0);
    const double noise = (1.0 - r * r) / (r * kIndependentRings * side);
    return spread_by_noise({h.xx, 0.0, h.xx}, noise, most).xx + fit_variance(config_, PeakKind::coefficient);
  }
  // Random phases of equal weight, up to half a cycle a step.
  const double gradient_noise = kPi * kPi / 3.0 / (kIndependentRows * side);
  const Curvature along = rows > 0 ? h : Curvature{h.xx, 0.0, h.xx};
  return spread_by_gradient(along, gradient_noise, most).xx + fit_variance(config_, PeakKind::whitened);
}

}  // namespace mellin
