// Gaussian blur of one pixel, with or without halving, row by row over whatever a pixel is read from.
#pragma once

#include <cstddef>

#include "mellin/core/span.hpp"

namespace mellin {

/// Blurs as blur() in image.hpp does (standard deviation one pixel, cut at four, mirrored at the border), then takes
/// the mean of 2 x 2 pixels if `factor` is 2. Rows come in ascending order, and each pixel is read once, before the row
/// of the same place is written: `out` may lie where the pixels are read from.
class RowBlur {
 public:
  static constexpr std::size_t kRadius = 4;
  static constexpr std::size_t kMaxTaps = 2 * kRadius + 2;  // with the mean of two
  /// Smallest side that the mirrored border has room in.
  static constexpr std::size_t kMinSide = 6;

  /// Floats of scratch memory for a picture of `side`, kept from row to row.
  static constexpr std::size_t scratch_size(std::size_t side, std::size_t factor) {
    return kMaxTaps * (side / factor) + side + 2 * kRadius;
  }

  /// Row `row` of side / factor pixels. Row 0 begins a picture; `scratch` stays the same from row to row.
  template <class Read>
  void make_row(const Read& read, std::size_t side, std::size_t factor, std::size_t row, Span<float> scratch,
                float* out) {
    if (row == 0) {
      begin(factor);
    }
    const std::size_t width = side / factor;
    const Span<float> line = scratch.subspan(kMaxTaps * width, side + 2 * kRadius);
    const std::size_t end = factor * row + taps_ - kRadius;
    for (; next_ < side && next_ < end; ++next_) {
      for (std::size_t i = 0; i < line.size(); ++i) {
        line[i] = read(mirrored(i, side), next_);
      }
      blur_along(line, width, scratch.data() + (next_ % kMaxTaps) * width);
    }
    blur_down(scratch, side, width, row, out);
  }

 private:
  /// Index i - kRadius mirrored into [0, side) without repeating the border pixel.
  static std::size_t mirrored(std::size_t i, std::size_t side) {
    if (i < kRadius) {
      return kRadius - i;
    }
    return i - kRadius < side ? i - kRadius : 2 * (side - 1) - (i - kRadius);
  }
  void begin(std::size_t factor);
  void blur_along(Span<const float> line, std::size_t width, float* out) const;
  void blur_down(Span<const float> ring, std::size_t side, std::size_t width, std::size_t row, float* out) const;

  float kernel_[kMaxTaps] = {};
  std::size_t taps_ = 0;
  std::size_t factor_ = 1;
  std::size_t next_ = 0;  // row of the picture that is read next
};

}  // namespace mellin
