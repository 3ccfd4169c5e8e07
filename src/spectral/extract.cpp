// The passes that make a picture's features.
#include <algorithm>
#include <cmath>

#include "mellin/spectral/matcher.hpp"
#include "spectral/resample.hpp"

namespace mellin {

namespace {

/// A spectrum's memory lent to real numbers: at least side * (side + 2) of them.
Span<float> as_floats(Span<Complex> memory) {
  return Span<float>(reinterpret_cast<float*>(memory.data()), 2 * memory.size());
}

float magnitude(Complex z) { return std::sqrt(z.re * z.re + z.im * z.im); }

}  // namespace

/// The seamless picture lies in the features, or, where they keep none, in scratch memory until it is transformed.
ImageView Matcher::picture_image() const {
  if (!out_->image.empty()) {
    return {out_->image, config_.side};
  }
  return {as_floats(memory_.second).first(Features::image_count(config_.side)), config_.side};
}

void Matcher::load_rows(std::size_t first, std::size_t count) {
  const ImageView image = picture_image();
  const std::size_t end = (first + count) * image.side;
  for (std::size_t i = first * image.side; i < end; ++i) {
    const std::uint8_t value = picture_[i];
    lowest_ = std::min(lowest_, value);
    highest_ = std::max(highest_, value);
    image.pixels[i] = static_cast<float>(value) / 255.0F;
  }
}

void Matcher::blur_edges(std::size_t first, std::size_t count) {
  if (first == 0 && edge_blur_.begin(picture_image(), margin_, as_floats(memory_.first)) != Status::ok) {
    return;
  }
  edge_blur_.step(count);
}

void Matcher::transform_picture_rows(std::size_t first, std::size_t count) {
  const ImageView image = picture_image();
  for (std::size_t r = first; r < first + count; r += Fft2::kBlock) {
    fft_.forward_rows(image.row(r), r, std::min(Fft2::kBlock, first + count - r), memory_.first);
  }
}

/// Also notes the magnitudes, in proportion to the frequency (high-pass, Fig. 1b), for the rings.
void Matcher::transform_picture_columns(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  fft_.forward_columns(memory_.first, first, count);
  for (std::size_t kx = first; kx < first + count; ++kx) {
    const Complex* const column = memory_.first.data() + kx * side;
    float* const weighted = as_floats(memory_.second).data() + kx * side;
    double sum = 0.0;
    for (std::size_t i = 0; i < side; ++i) {
      weighted[i] = magnitude(column[i]);
      sum += static_cast<double>(weighted[i]);
    }
    sum_ += sum;
    if (config_.high_pass) {
      const auto fx = static_cast<float>(kx);
      for (std::size_t i = 0; i < side; ++i) {
        const auto fy = static_cast<float>(std::min(i, side - i));
        weighted[i] *= std::sqrt(fx * fx + fy * fy);
      }
    }
  }
}

void Matcher::end_magnitudes() {
  const double mean = sum_ / static_cast<double>(spectrum_size(config_.side));
  out_->floor = static_cast<float>(static_cast<double>(config_.whitening_floor) * mean);
  sum_ = 0.0;
}

/// The phase-only filter (IV-A step 3), with the low-pass and the scale of the whole transform folded in.
void Matcher::whiten_columns(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  for (std::size_t kx = first; kx < first + count; ++kx) {
    const Complex* const column = memory_.first.data() + kx * side;
    Complex* const filter = out_->filter.data() + kx * side;
    const float scale = filter_scale_ * memory_.lowpass[kx];
    for (std::size_t i = 0; i < side; ++i) {
      const float weight = scale * memory_.lowpass[i] / (magnitude(column[i]) + out_->floor);
      filter[i] = {weight * column[i].re, weight * column[i].im};
    }
  }
}

/// Ring i has the radius i + 1: from the lowest frequency to that of the pixels. Without its mean it correlates as a
/// coefficient does, and rings without angular structure have no say.
void Matcher::sample_rings(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t width = side / 2 + 1;
  const Span<const float> magnitudes = as_floats(memory_.second).first(spectrum_size(config_.side));
  float* const ring = memory_.rows.data();
  for (std::size_t i = first; i < first + count; ++i) {
    sample_ring(magnitudes, side, static_cast<float>(i + 1), memory_.directions, ring);
    double sum = 0.0;
    for (std::size_t k = 0; k < side; ++k) {
      sum += static_cast<double>(ring[k]);
    }
    const auto mean = static_cast<float>(sum / static_cast<double>(side));
    for (std::size_t k = 0; k < side; ++k) {
      ring[k] -= mean;
    }
    Complex* const spectrum = out_->rings.data() + i * width;
    fft_.forward_line(ring, spectrum);
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

void Matcher::scale_rings(std::size_t first, std::size_t count) {
  const std::size_t width = config_.side / 2U + 1U;
  const auto scale = static_cast<float>(1.0 / sqrt(sum_));
  for (std::size_t i = first * width; i < (first + count) * width; ++i) {
    out_->rings[i].re *= scale;
    out_->rings[i].im *= scale;
  }
}

}  // namespace mellin
