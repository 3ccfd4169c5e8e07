// The passes that make a picture's features.
#include <algorithm>
#include <cmath>

#include "mellin/grid/digest.hpp"
#include "mellin/spectral/matcher.hpp"

namespace mellin {

namespace {

float magnitude(Complex z) { return std::sqrt(z.re * z.re + z.im * z.im); }

}  // namespace

/// The seamless picture lies in the features, or, where they keep none, in scratch memory until it is transformed.
ImageView Matcher::picture_image() const {
  if (!out_->image.empty()) {
    return {out_->image, config_.side};
  }
  return {as_floats(memory_.second).first(Features::image_count(config_.side)), config_.side};
}

/// Obstacles count 1, observed free space -free_weight, what lies between in between, the unobserved 0.
void Matcher::load_rows(std::size_t first, std::size_t count) {
  const ImageView image = picture_image();
  const std::size_t end = (first + count) * image.side;
  for (std::size_t i = first * image.side; i < end; ++i) {
    const std::uint8_t value = picture_[i];
    lowest_ = std::min(lowest_, value);
    highest_ = std::max(highest_, value);
    image.pixels[i] = static_cast<float>(value) / 255.0F;
  }
  if (observed_.empty() || !(config_.free_weight > 0.0F)) {
    return;
  }
  for (std::size_t i = first * image.side; i < end; ++i) {
    if (mask_bit(observed_, i)) {
      image.pixels[i] -= config_.free_weight * (1.0F - image.pixels[i]);
    }
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

/// Also notes the magnitudes, for the rotation.
void Matcher::transform_picture_columns(std::size_t first, std::size_t count) {
  fft_.forward_columns(memory_.first, first, count);
  for (std::size_t kx = first; kx < first + count; ++kx) {
    sum_ += rotation_.note_column(memory_.first.data() + kx * config_.side, kx);
  }
}

void Matcher::end_magnitudes() {
  const double mean = sum_ / static_cast<double>(spectrum_size(config_.side));
  out_->floor = static_cast<float>(static_cast<double>(config_.whitening_floor) * mean);
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

}  // namespace mellin
