#include "mellin/grid/row_blur.hpp"

#include "mellin/core/math.hpp"

namespace mellin {

void RowBlur::begin(std::size_t factor) {
  double weight[kRadius + 1] = {};
  double sum = 0.0;
  for (std::size_t k = 0; k <= kRadius; ++k) {
    weight[k] = exp(-0.5 * static_cast<double>(k * k));
    sum += k == 0 ? weight[k] : 2.0 * weight[k];
  }
  // Tap t weighs the pixel t - kRadius away; the mean of two neighbours adds the kernel moved by one.
  const auto tap = [&](std::size_t t) {
    return t > 2 * kRadius ? 0.0 : weight[t < kRadius ? kRadius - t : t - kRadius] / sum;
  };
  factor_ = factor;
  taps_ = 2 * kRadius + factor;
  next_ = 0;
  for (std::size_t t = 0; t < taps_; ++t) {
    kernel_[t] = static_cast<float>(factor == 1 ? tap(t) : 0.5 * (tap(t) + (t == 0 ? 0.0 : tap(t - 1))));
  }
}

void RowBlur::blur_along(Span<const float> line, std::size_t width, float* out) const {
  for (std::size_t i = 0; i < width; ++i) {
    float sum = 0.0F;
    for (std::size_t t = 0; t < taps_; ++t) {
      sum += kernel_[t] * line[factor_ * i + t];
    }
    out[i] = sum;
  }
}

void RowBlur::blur_down(Span<const float> ring, std::size_t side, std::size_t width, std::size_t row,
                        float* out) const {
  for (std::size_t i = 0; i < width; ++i) {
    out[i] = 0.0F;
  }
  for (std::size_t t = 0; t < taps_; ++t) {
    const float* const line = ring.data() + (mirrored(factor_ * row + t, side) % kMaxTaps) * width;
    for (std::size_t i = 0; i < width; ++i) {
      out[i] += kernel_[t] * line[i];
    }
  }
}

}  // namespace mellin
