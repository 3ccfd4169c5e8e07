// The passes that match the features of two pictures.
#include <algorithm>
#include <cmath>

#include "mellin/spectral/matcher.hpp"
#include "spectral/kernels.hpp"
#include "spectral/resample.hpp"

namespace mellin {

namespace {

/// Rotation peaks are the highest among two neighbours on either side, so that one hump gives one peak.
constexpr std::size_t kPeakNeighbours = 2;

/// Index i + offset in a cyclic line of `size`; |offset| <= size.
std::size_t cyclic(std::size_t i, int offset, std::size_t size) {
  return (i + size + static_cast<std::size_t>(static_cast<std::ptrdiff_t>(offset))) % size;
}

bool is_peak(Span<const float> line, std::size_t i) {
  for (std::size_t k = 1; k <= kPeakNeighbours; ++k) {
    const int offset = static_cast<int>(k);
    // Of equal neighbours the first is the peak.
    if (line[i] <= line[cyclic(i, -offset, line.size())] || line[i] < line[cyclic(i, offset, line.size())]) {
      return false;
    }
  }
  return true;
}

/// A shift in [-side, side] of a periodic picture, as the one nearest to none: [-side / 2, side / 2).
double nearest_shift(double shift, std::size_t side) {
  const auto period = static_cast<double>(side);
  return shift >= 0.5 * period ? shift - period : (shift < -0.5 * period ? shift + period : shift);
}

}  // namespace

/// The correlations of all rings at once: their cross spectra are summed before the one inverse transform.
void Matcher::correlate_rings(std::size_t first, std::size_t count) {
  const std::size_t width = config_.side / 2U + 1U;
  Complex* const sum = cross_spectrum().data();
  for (std::size_t i = first; i < first + count; ++i) {
    const Complex* const a = a_.rings.data() + i * width;
    const Complex* const b = b_.rings.data() + i * width;
    for (std::size_t k = 0; k < width; ++k) {
      sum[k].re += a[k].re * b[k].re + a[k].im * b[k].im;
      sum[k].im += a[k].im * b[k].re - a[k].re * b[k].im;
    }
  }
}

/// All high peaks, not only the highest (IV-B3), their angles refined by the centre of mass (Eq. 3).
void Matcher::find_rotations() {
  rotations_.clear();
  const std::size_t side = config_.side;
  const Span<float> correlation = memory_.correlation;
  fft_.inverse_line(cross_spectrum().data(), correlation.data());
  const float least =
      std::max(config_.peak_share * fft_.kernels().highest(correlation.data(), side), options_.min_rotation_peak);
  const std::size_t most =
      options_.max_peaks == 0 ? config_.max_peaks : std::min(options_.max_peaks, config_.max_peaks);
  const int radius = config_.com_radius;
  for (std::size_t i = 0; i < side; ++i) {
    const float strength = correlation[i];
    if (!(strength > 0.0F) || strength < least || !is_peak(correlation, i)) {
      continue;
    }
    float mass = 0.0F;
    float moment = 0.0F;
    for (int d = -radius; d <= radius; ++d) {
      const float value = std::max(correlation[cyclic(i, d, side)], 0.0F);
      mass += value;
      moment += value * static_cast<float>(d);
    }
    const double bin = static_cast<double>(i) + static_cast<double>(moment / mass);
    std::size_t at = 0;
    while (at < rotations_.size() && rotations_[at].strength >= strength) {
      ++at;
    }
    rotations_.insert(at, {bin * kPi / static_cast<double>(side), strength});
  }
  rotation_count_ = std::min(rotations_.size(), most);
}

void Matcher::transform_turned_rows(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const SinCos turn = sincos(rotations_[rotation_].angle_rad);
  const SinCosF turn_f{static_cast<float>(turn.sin), static_cast<float>(turn.cos)};
  const ImageView image{b_.image, config_.side};
  for (std::size_t r = first; r < first + count; r += Fft2::kBlock) {
    const std::size_t rows = std::min(Fft2::kBlock, first + count - r);
    for (std::size_t i = 0; i < rows; ++i) {
      turned_row(image, turn_f, r + i, fft_.kernels(), memory_.rows.data() + i * side);
    }
    fft_.forward_rows(memory_.rows.data(), r, rows, memory_.first);
  }
}

/// The phases of the turned picture, in place.
void Matcher::whiten_turned_columns(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const Span<Complex> turned = memory_.first;
  for (std::size_t kx = first; kx < first + count; kx += kFftLanes) {
    const std::size_t columns = std::min(kFftLanes, first + count - kx);
    fft_.forward_columns(turned, kx, columns);
    fft_.kernels().whiten(turned.data() + kx * side, columns * side, b_.floor);
  }
}

/// A few columns at a time through the fast memory: multiplied with the filter of a, and back. The picture turned by a
/// further 180 degrees has the conjugate spectrum (but for a shift, see locate_peak()), so both candidates come from
/// one.
void Matcher::filter_turned_columns(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t last = side / 2;
  const Complex* const turned = memory_.first.data();
  const Complex* const filter = a_.filter.data();
  Complex* const straight = memory_.lines.data();
  Complex* const straight_last = straight + kFftLanes * side;
  Complex* const half_turned = straight_last + side;
  Complex* const half_turned_last = half_turned + kFftLanes * side;
  const Kernels& kernels = fft_.kernels();
  for (std::size_t kx = first; kx < first + count; kx += kFftLanes) {
    const std::size_t columns = std::min(kFftLanes, first + count - kx);
    const std::size_t at = kx * side;
    kernels.cross(filter + at, turned + at, columns * side, straight, half_turned);
    if (kx == 0) {
      kernels.cross(filter + last * side, turned + last * side, side, straight_last, half_turned_last);
    }
    fft_.inverse_lines(straight, kx == 0 ? straight_last : nullptr, columns, memory_.first.data() + at);
    fft_.inverse_lines(half_turned, kx == 0 ? half_turned_last : nullptr, columns, memory_.second.data() + at);
  }
}

/// The correlation surface is looked at as it comes, a block of rows at a time, and never stored.
void Matcher::search_surface_rows(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  for (std::size_t r = first; r < first + count; r += Fft2::kBlock) {
    const std::size_t rows = std::min(Fft2::kBlock, first + count - r);
    fft_.inverse_rows(surface(), r, rows, memory_.rows.data());
    for (std::size_t i = 0; i < rows; ++i) {
      const float* const row = memory_.rows.data() + i * side;
      const float top = fft_.kernels().highest(row, side);
      if (top > best_) {
        best_ = top;
        best_row_ = r + i;
        best_column_ = static_cast<std::size_t>(std::find(row, row + side, top) - row);
      }
    }
  }
}

/// Centre of mass round the highest value (Eq. 3) and the pose that it means.
void Matcher::locate_peak() {
  if (!(best_ > 0.0F)) {
    return;
  }
  const std::size_t side = config_.side;
  const int radius = config_.com_radius;
  float mass = 0.0F;
  float moment_x = 0.0F;
  float moment_y = 0.0F;
  for (int dy = -radius; dy <= radius; ++dy) {
    float* const row = memory_.rows.data();
    fft_.inverse_rows(surface(), cyclic(best_row_, dy, side), 1, row);
    for (int dx = -radius; dx <= radius; ++dx) {
      const float value = std::max(row[cyclic(best_column_, dx, side)], 0.0F);
      mass += value;
      moment_x += value * static_cast<float>(dx);
      moment_y += value * static_cast<float>(dy);
    }
  }
  // Turning pixel centres 0 … side - 1 by 180 degrees about their middle maps i to side - 1 - i, whereas the conjugate
  // spectrum stands for -i: a shift of side - 1 is to be taken off.
  const double mirrored = half_turn_ ? static_cast<double>(side - 1) : 0.0;
  const double x = static_cast<double>(best_column_) + static_cast<double>(moment_x / mass) - mirrored;
  const double y = static_cast<double>(best_row_) + static_cast<double>(moment_y / mass) - mirrored;
  const auto pixel_m = static_cast<double>(config_.pixel_m);
  const RotationPeak& rotation = rotations_[rotation_];
  Hypothesis hypothesis;
  hypothesis.a_T_b = {nearest_shift(x, side) * pixel_m, nearest_shift(y, side) * pixel_m,
                      wrap_angle(rotation.angle_rad + (half_turn_ ? kPi : 0.0))};
  hypothesis.peak = best_;
  hypothesis.rotation_peak = rotation.strength;
  add_hypothesis(hypothesis);
}

/// Keeps the list sorted; of two that say the same (within a pixel and an angular bin) the better one stays.
void Matcher::add_hypothesis(const Hypothesis& hypothesis) {
  const auto pixel_m = static_cast<double>(config_.pixel_m);
  const double bin = kPi / static_cast<double>(config_.side);
  for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
    const Pose2& other = hypotheses_[i].a_T_b;
    const bool same_place =
        std::fabs(other.x - hypothesis.a_T_b.x) < pixel_m && std::fabs(other.y - hypothesis.a_T_b.y) < pixel_m;
    if (same_place && std::fabs(wrap_angle(other.theta - hypothesis.a_T_b.theta)) < bin) {
      if (hypotheses_[i].peak >= hypothesis.peak) {
        return;
      }
      HypothesisList others;
      for (std::size_t k = 0; k < hypotheses_.size(); ++k) {
        if (k != i) {
          others.insert(others.size(), hypotheses_[k]);
        }
      }
      hypotheses_ = others;
      break;
    }
  }
  std::size_t at = 0;
  while (at < hypotheses_.size() && hypotheses_[at].peak >= hypothesis.peak) {
    ++at;
  }
  hypotheses_.insert(at, hypothesis);
}

}  // namespace mellin
