#include "mellin/spectral/rotation.hpp"

#include <algorithm>
#include <cmath>

#include "mellin/core/math.hpp"
#include "spectral/peaks.hpp"
#include "spectral/resample.hpp"

namespace mellin {

namespace {

/// Half a turn in `side` steps, from -90 degrees on: the half plane that a spectrum stores.
void fill_directions(Span<Complex> directions) {
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const SinCos turn = sincos(kPi * static_cast<double>(i) / static_cast<double>(directions.size()));
    directions[i] = {static_cast<float>(turn.sin), static_cast<float>(-turn.cos)};
  }
}

}  // namespace

Status RotationEstimator::init(const MatcherConfig& config, const Memory& memory, const Scratch& scratch) {
  const std::size_t side = config.side;
  stage_ = Stage::idle;
  if (memory.directions.size() != side || memory.correlation.size() != side ||
      scratch.magnitudes.size() != spectrum_size(config.side) || scratch.row.size() < side ||
      scratch.line.size() < side / 2 + 1) {
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
  float* const weighted = scratch_.magnitudes.data() + kx * side;
  double sum = 0.0;
  for (std::size_t i = 0; i < side; ++i) {
    weighted[i] = std::sqrt(column[i].re * column[i].re + column[i].im * column[i].im);
    sum += static_cast<double>(weighted[i]);
  }
  if (config_.high_pass) {
    const auto fx = static_cast<float>(kx);
    for (std::size_t i = 0; i < side; ++i) {
      const auto fy = static_cast<float>(std::min(i, side - i));
      weighted[i] *= std::sqrt(fx * fx + fy * fy);
    }
  }
  return sum;
}

void RotationEstimator::begin_describe(Span<Complex> polar) {
  out_ = polar;
  energy_ = 0.0;
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

bool RotationEstimator::step(const Fft2& fft, std::size_t lines) {
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

std::size_t RotationEstimator::lines_of(Stage stage) const { return stage == Stage::find ? 1 : config_.side / 2U; }

void RotationEstimator::run(const Fft2& fft, std::size_t first, std::size_t count) {
  switch (stage_) {
    case Stage::sample:
      return sample_rings(fft, first, count);
    case Stage::scale:
      return scale_rings(first, count);
    case Stage::correlate:
      return correlate_rings(first, count);
    case Stage::find:
      return find_peaks(fft);
    case Stage::idle:
      return;
  }
}

RotationEstimator::Stage RotationEstimator::after(Stage stage) {
  switch (stage) {
    case Stage::sample:
      if (!(energy_ > 0.0)) {
        status_ = Status::degenerate;
        return Stage::idle;
      }
      return Stage::scale;
    case Stage::correlate:
      return Stage::find;
    case Stage::scale:
    case Stage::find:
    case Stage::idle:
      break;
  }
  return Stage::idle;
}

/// Ring i has the radius i + 1: from the lowest frequency to that of the pixels. Without its mean it correlates as a
/// coefficient does, and rings without angular structure have no say.
void RotationEstimator::sample_rings(const Fft2& fft, std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t width = side / 2 + 1;
  float* const ring = scratch_.row.data();
  for (std::size_t i = first; i < first + count; ++i) {
    sample_ring(scratch_.magnitudes, side, static_cast<float>(i + 1), memory_.directions, ring);
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
    energy_ += energy;
  }
}

void RotationEstimator::scale_rings(std::size_t first, std::size_t count) {
  const std::size_t width = config_.side / 2U + 1U;
  const auto scale = static_cast<float>(1.0 / sqrt(energy_));
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
      sum[k].re += a[k].re * b[k].re + a[k].im * b[k].im;
      sum[k].im += a[k].im * b[k].re - a[k].re * b[k].im;
    }
  }
}

/// All high peaks, not only the highest (IV-B3).
void RotationEstimator::find_peaks(const Fft2& fft) {
  const std::size_t side = config_.side;
  const Span<float> correlation = memory_.correlation;
  fft.inverse_line(scratch_.line.data(), correlation.data());
  const float least = std::max(config_.peak_share * highest(correlation.data(), side), least_);
  for (std::size_t i = 0; i < side; ++i) {
    const float strength = correlation[i];
    if (!(strength > 0.0F) || strength < least || !is_peak(correlation, i)) {
      continue;
    }
    std::size_t at = 0;
    while (at < peaks_.size() && peaks_[at].strength >= strength) {
      ++at;
    }
    peaks_.insert(at, {peak_position(i) * kPi / static_cast<double>(side), strength});
  }
}

/// Of the peak at bin i, refined by the centre of mass (Eq. 3).
double RotationEstimator::peak_position(std::size_t i) const {
  const int radius = config_.com_radius;
  float mass = 0.0F;
  float moment = 0.0F;
  for (int d = -radius; d <= radius; ++d) {
    const float value = std::max(memory_.correlation[cyclic(i, d, config_.side)], 0.0F);
    mass += value;
    moment += value * static_cast<float>(d);
  }
  return static_cast<double>(i) + static_cast<double>(moment / mass);
}

}  // namespace mellin
