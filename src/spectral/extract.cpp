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
  const std::size_t pixels = std::size_t{config_.side} * config_.side;
  const Span<float> memory = out_->image.empty() ? as_floats(memory_.second) : out_->image;
  return {memory.first(pixels), config_.side};
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
  if (observed_.empty() || config_.masked || !(config_.free_weight > 0.0F)) {
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
  for (std::size_t r = first; r < first + count; ++r) {
    add_curvature(r);
  }
}

/// What a row and those beside it add to the picture's correlation with itself: cyclic, as the transform is.
void Matcher::add_curvature(std::size_t row) {
  const ImageView image = picture_image();
  const std::size_t side = image.side;
  const float* const here = image.row(row);
  const float* const above = image.row(row + 1 == side ? 0 : row + 1);
  const float* const below = image.row(row == 0 ? side - 1 : row - 1);
  // Lanes without order between them, so that the compiler may take them side by side; sides are even.
  constexpr std::size_t kLanes = 8;
  float lanes[5][kLanes] = {};
  const auto add = [&](std::size_t c, std::size_t left, std::size_t right, std::size_t lane) {
    const float dx = here[right] - here[c];
    const float dy = above[c] - here[c];
    lanes[0][lane] += here[c];
    lanes[1][lane] += here[c] * here[c];
    lanes[2][lane] += dx * dx;
    lanes[3][lane] += dy * dy;
    lanes[4][lane] += 0.25F * (here[right] - here[left]) * (above[c] - below[c]);
  };
  add(0, side - 1, 1, 0);
  std::size_t c = 1;
  for (; c + kLanes < side; c += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      add(c + lane, c + lane - 1, c + lane + 1, lane);
    }
  }
  for (; c < side; ++c) {
    add(c, c - 1, c + 1 == side ? 0 : c + 1, 0);
  }
  for (std::size_t k = 0; k < 5; ++k) {
    for (const float lane : lanes[k]) {
      moments_[k] += static_cast<double>(lane);
    }
  }
}

void Matcher::end_curvature() {
  const auto pixels = static_cast<double>(std::size_t{config_.side} * config_.side);
  const double energy = moments_[1] - moments_[0] * moments_[0] / pixels;
  const double scale = energy > 0.0 ? 1.0 / energy : 0.0;
  out_->curvature = {static_cast<float>(scale * moments_[2]), static_cast<float>(scale * moments_[4]),
                     static_cast<float>(scale * moments_[3])};
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
