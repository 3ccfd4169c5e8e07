// The passes that match the features of two pictures.
#include <algorithm>
#include <cmath>

#include "mellin/spectral/matcher.hpp"
#include "spectral/kernels.hpp"
#include "spectral/peaks.hpp"
#include "spectral/resample.hpp"

namespace mellin {

namespace {

/// A shift in [-side, side] of a periodic picture, as the one nearest to none: [-side / 2, side / 2).
double nearest_shift(double shift, std::size_t side) {
  const auto period = static_cast<double>(side);
  return shift >= 0.5 * period ? shift - period : (shift < -0.5 * period ? shift + period : shift);
}

}  // namespace

std::size_t Matcher::rotation_count() const {
  const std::size_t most =
      options_.max_peaks == 0 ? config_.max_peaks : std::min(options_.max_peaks, config_.max_peaks);
  return std::min(rotation_.peaks().size(), most);
}

std::size_t Matcher::untried_rotations() const {
  return std::min<std::size_t>(rotation_.peaks().size(), config_.max_peaks) - rotation_index_;
}

bool Matcher::begin_further() {
  if (untried_rotations() == 0) {
    return false;
  }
  options_.max_peaks = 0;
  hypotheses_.clear();
  stage_ = begin_rotation();
  line_ = 0;
  return true;
}

/// Multiple of the angular step nearest to the rotation under way; cyclic, since both it and the half turn beyond are
/// looked at.
std::uint32_t Matcher::turn_index() const {
  const auto steps = static_cast<std::uint32_t>(config_.side * config_.turns_per_bin);
  const double turns = rotation_.peaks()[rotation_index_].angle_rad / kPi;  // half turns
  const double fraction = turns - floor(turns);
  return static_cast<std::uint32_t>(fraction * static_cast<double>(steps) + 0.5) % steps;
}

double Matcher::turned_angle() const {
  if (config_.turns_per_bin == 0) {
    return rotation_.peaks()[rotation_index_].angle_rad;
  }
  return turn_index() * kPi / (static_cast<double>(config_.side) * config_.turns_per_bin);
}

/// Of the angle that is turned by about the peak's, rad^2: within half a step it is uniform.
float Matcher::turn_variance() const {
  if (config_.turns_per_bin == 0) {
    return 0.0F;
  }
  const double step_rad = kPi / (static_cast<double>(config_.side) * config_.turns_per_bin);
  return static_cast<float>(step_rad * step_rad / 12.0);
}

/// Where b's spectrum at this rotation is known, it need not be made.
Matcher::Stage Matcher::begin_rotation() {
  if (config_.masked) {
    return Stage::masked_turned_rows;
  }
  turned_ = memory_.first;
  const bool kept = b_.image.data() == query_ && rotation_.peaks()[rotation_index_].scale == 1.0F;
  if (!kept) {
    return Stage::turned_rows;
  }
  const std::size_t size = spectrum_size(config_.side);
  const std::size_t place = memory_.turn_place[turn_index()];
  if (place > 0) {
    turned_ = memory_.turns.subspan((place - 1) * size, size);
    return Stage::filter_columns;
  }
  if (turns_ < config_.kept_turns) {
    turned_ = memory_.turns.subspan(turns_ * size, size);
  }
  return Stage::turned_rows;
}

/// The spectrum under way is done; it lies behind those that are kept already if it is to be kept.
void Matcher::keep_turn() {
  if (turned_.data() != memory_.first.data()) {
    memory_.turn_place[turn_index()] = static_cast<std::uint16_t>(++turns_);
  }
}

SinCosF Matcher::turn_under_way() const {
  const SinCos turn = sincos(turned_angle());
  // A picture enlarged by s is read at coordinates smaller by s.
  const auto scale = static_cast<double>(rotation_.peaks()[rotation_index_].scale);
  return {static_cast<float>(turn.sin / scale), static_cast<float>(turn.cos / scale)};
}

void Matcher::transform_turned_rows(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const SinCosF turn = turn_under_way();
  const ImageView image{b_.image, config_.side};
  for (std::size_t r = first; r < first + count; r += Fft2::kBlock) {
    const std::size_t rows = std::min(Fft2::kBlock, first + count - r);
    for (std::size_t i = 0; i < rows; ++i) {
      turned_row(image, turn, r + i, fft_.kernels(), memory_.rows.data() + i * side);
    }
    fft_.forward_rows(memory_.rows.data(), r, rows, turned_);
  }
}

/// The phases of the turned picture, in place.
void Matcher::whiten_turned_columns(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  for (std::size_t kx = first; kx < first + count; kx += kFftLanes) {
    const std::size_t columns = std::min(kFftLanes, first + count - kx);
    fft_.forward_columns(turned_, kx, columns);
    fft_.kernels().whiten(turned_.data() + kx * side, columns * side, b_.floor);
  }
}

/// A few columns at a time through the fast memory: multiplied with the filter of a, and back. The picture turned by a
/// further 180 degrees has the conjugate spectrum (but for a shift, see locate_peak()), so both candidates come from
/// one.
void Matcher::filter_turned_columns(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t last = side / 2;
  const Complex* const turned = turned_.data();
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

void Matcher::begin_surface() {
  peak_ = {};
  peaks_.begin(config_.side, config_.translation_peaks);
}

/// The correlation surface is looked at as it comes, a block of rows at a time, and never stored.
void Matcher::search_surface_rows(std::size_t first, std::size_t count) {
  for (std::size_t r = first; r < first + count; r += Fft2::kBlock) {
    const std::size_t rows = std::min(Fft2::kBlock, first + count - r);
    if (config_.translation_peaks == 1) {
      fft_.inverse_rows_search(surface(), r, rows, peak_);
      continue;
    }
    fft_.inverse_rows(surface(), r, rows, memory_.rows.data());
    for (std::size_t i = 0; i < rows; ++i) {
      peaks_.add_row(r + i, memory_.rows.subspan(i * config_.side, config_.side));
    }
  }
  if (config_.translation_peaks == 1 && first + count == config_.side && peak_.value > 0.0F) {
    peaks_.add(peak_);
  }
}

/// Row `row` of the surface under way. Rows are asked for in ascending order, cyclically; `begins` says which is the
/// first. Where there are lanes a block of rows takes no longer than one.
const float* Matcher::surface_row(std::size_t row, bool begins) {
  if (config_.masked) {
    return masked_surface_rows(row, 1);
  }
  constexpr std::size_t kRows = kFftLanes > 1 ? Fft2::kBlock : 1;
  const std::size_t side = config_.side;
  if (begins || row < block_row_ || row >= block_row_ + kRows) {
    block_row_ = std::min(row, side - kRows);
    fft_.inverse_rows(surface(), block_row_, kRows, memory_.rows.data());
  }
  return memory_.rows.data() + (row - block_row_) * side;
}

/// A peak's place, refined, and the pose that it means.
void Matcher::locate_peak(const Fft2::Peak& peak) {
  if (peak.value < config_.min_peak) {
    return;
  }
  const std::size_t side = config_.side;
  const int radius = PeakWindow::radius_for(config_);
  PeakWindow window;
  for (int dy = -radius; dy <= radius; ++dy) {
    window.set_row(dy, {surface_row(cyclic(peak.row, dy, side), dy == -radius), side}, peak.column, radius);
  }
  const PeakOffset offset = peak_offset(window, radius, config_);
  // Turning pixel centres 0 … side - 1 by 180 degrees about their middle maps i to side - 1 - i, whereas the conjugate
  // spectrum stands for -i: a shift of side - 1 is to be taken off.
  const double mirrored = half_turn_ ? static_cast<double>(side - 1) : 0.0;
  const double x = static_cast<double>(peak.column) + offset.x - mirrored;
  const double y = static_cast<double>(peak.row) + offset.y - mirrored;
  const auto pixel_m = static_cast<double>(config_.pixel_m);
  const RotationPeak& rotation = rotation_.peaks()[rotation_index_];
  Hypothesis hypothesis;
  hypothesis.a_T_b = {nearest_shift(x, side) * pixel_m, nearest_shift(y, side) * pixel_m,
                      wrap_angle(turned_angle() + (half_turn_ ? kPi : 0.0))};
  hypothesis.peak = peak.value;
  hypothesis.rotation_peak = rotation.strength;
  hypothesis.scale = rotation.scale;
  const PeakSpread spread = translation_spread(window, radius);
  const double square_m = pixel_m * pixel_m;
  hypothesis.covariance = {static_cast<float>(spread.xx * square_m), static_cast<float>(spread.xy * square_m),
                           static_cast<float>(spread.yy * square_m), rotation.variance + turn_variance()};
  add_hypothesis(hypothesis);
}

/// Of the peak under way, pixels squared: see PeakCovariance.
PeakSpread Matcher::translation_spread(const PeakWindow& window, int radius) const {
  // Lines' worth of independent samples. Whitening leaves a lower peak than a coefficient would be, which counts more.
  const double lines = config_.masked ? 6.0 : 48.0;
  const auto side = static_cast<double>(config_.side);
  const double r = std::min(1.0, static_cast<double>(window.at(0, 0)));
  const PictureCurvature& own = a_.curvature;
  const Curvature shape = config_.masked ? curvature(window, radius)
                                         : Curvature{r * static_cast<double>(own.xx), r * static_cast<double>(own.xy),
                                                     r * static_cast<double>(own.yy)};
  PeakSpread spread = spread_by_noise(shape, (1.0 - r * r) / (r * lines * side), 0.25 * side);
  const double fit = fit_variance(config_, config_.masked ? PeakKind::coefficient : PeakKind::whitened);
  spread.xx += fit;
  spread.yy += fit;
  return spread;
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
      hypotheses_.erase(i);
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
