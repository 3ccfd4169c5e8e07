#include "mellin/spectral/surface_peaks.hpp"

#include <algorithm>

#include "spectral/peaks.hpp"

namespace mellin {
namespace {

std::size_t cyclic_distance(std::size_t a, std::size_t b, std::size_t size) {
  const std::size_t apart = a > b ? a - b : b - a;
  return std::min(apart, size - apart);
}

}  // namespace

void SurfacePeaks::add_row(std::size_t row, Span<const float> values) {
  const float least = peaks_.size() < most_ ? 0.0F : peaks_[most_ - 1].value;
  if (!(highest(values.data(), values.size()) > least)) {
    return;
  }
  for (std::size_t c = 0; c < values.size(); ++c) {
    const float value = values[c];
    if (value > least && value >= values[cyclic(c, 1, values.size())] && value > values[cyclic(c, -1, values.size())]) {
      add({value, row, c});
    }
  }
}

void SurfacePeaks::add(const Fft2::Peak& peak) {
  const auto same = [&](const Fft2::Peak& other) {
    return cyclic_distance(peak.row, other.row, side_) < kApart &&
           cyclic_distance(peak.column, other.column, side_) < kApart;
  };
  std::size_t at = 0;
  for (; at < peaks_.size() && peaks_[at].value >= peak.value; ++at) {
    if (same(peaks_[at])) {
      return;
    }
  }
  for (std::size_t i = peaks_.size(); i-- > at;) {
    if (same(peaks_[i])) {
      peaks_.erase(i);
    }
  }
  if (peaks_.size() == most_) {
    if (at == most_) {
      return;
    }
    peaks_.erase(most_ - 1);
  }
  peaks_.insert(at, peak);
}

}  // namespace mellin
