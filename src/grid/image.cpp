#include "mellin/grid/image.hpp"

#include <algorithm>
#include <cassert>

#include "grid/thicken.hpp"
#include "mellin/core/math.hpp"

namespace mellin {

namespace {

/// Half of a Gaussian kernel, centre first, that sums to 1 over both sides.
void gaussian_kernel(double sigma, Span<float> half) {
  double sum = 0.0;
  for (std::size_t i = 0; i < half.size(); ++i) {
    const double x = static_cast<double>(i) / sigma;
    sum += (i == 0 ? 1.0 : 2.0) * exp(-0.5 * x * x);
  }
  for (std::size_t i = 0; i < half.size(); ++i) {
    const double x = static_cast<double>(i) / sigma;
    half[i] = static_cast<float>(exp(-0.5 * x * x) / sum);
  }
}

/// out[i] = the `size` elements from padded[radius] on, each under the kernel; kernel: one half, centre first.
void convolve(const float* padded, std::size_t size, Span<const float> kernel, float* out) {
  const std::size_t radius = kernel.size() - 1;
  for (std::size_t i = 0; i < size; ++i) {
    out[i] = kernel[0] * padded[i + radius];
  }
  for (std::size_t k = 1; k <= radius; ++k) {
    const float* const before = padded + radius - k;
    const float* const behind = padded + radius + k;
    const float weight = kernel[k];
    for (std::size_t i = 0; i < size; ++i) {
      out[i] += weight * (before[i] + behind[i]);
    }
  }
}

}  // namespace

bool is_consistent(const ImageView& image) {
  return image.side > 0 && image.pixels.data() != nullptr &&
         image.pixels.size() == std::size_t{image.side} * image.side;
}

Status obstacle_image(const GridView& grid, const ImageView& out) {
  const bool valid = is_consistent(out) && grid.side == out.side && grid.cells.size() == out.pixels.size();
  assert(valid);
  if (!valid) {
    return Status::invalid_argument;
  }
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    out.pixels[i] = hit_share(grid.cells[i]);
  }
  return Status::ok;
}

Status thicken(const ImageView& in, const ImageView& out) {
  const bool valid = is_consistent(in) && is_consistent(out) && in.side == out.side;
  assert(valid);
  if (!valid) {
    return Status::invalid_argument;
  }
  const std::size_t last = in.side - 1U;
  for (std::size_t r = 0; r <= last; ++r) {
    const float* const above = in.row(r == 0 ? 0 : r - 1);
    const float* const middle = in.row(r);
    const float* const below = in.row(std::min(r + 1, last));
    const auto column_maximum = [=](std::size_t c) { return std::max(std::max(above[c], middle[c]), below[c]); };
    float left = column_maximum(0);
    float centre = left;
    for (std::size_t c = 0; c <= last; ++c) {
      const float right = column_maximum(std::min(c + 1, last));
      out.row(r)[c] = std::max(std::max(left, centre), right);
      left = centre;
      centre = right;
    }
  }
  return Status::ok;
}

Status blur(const ImageView& in, const ImageView& out, Span<float> scratch) {
  const bool valid = is_consistent(in) && is_consistent(out) && in.side == out.side && in.side >= RowBlur::kMinSide &&
                     scratch.size() >= RowBlur::scratch_size(in.side, 1);
  assert(valid);
  if (!valid) {
    return Status::invalid_argument;
  }
  RowBlur row_blur;
  const auto read = [&in](std::size_t c, std::size_t r) { return in.at(c, r); };
  for (std::size_t r = 0; r < in.side; ++r) {
    row_blur.make_row(read, in.side, 1, r, scratch, out.row(r));
  }
  return Status::ok;
}

Status halve(const ImageView& in, const ImageView& out) {
  const bool valid = is_consistent(in) && is_consistent(out) && in.side == 2 * out.side;
  assert(valid);
  if (!valid) {
    return Status::invalid_argument;
  }
  for (std::size_t r = 0; r < out.side; ++r) {
    for (std::size_t c = 0; c < out.side; ++c) {
      const float upper = in.row(2 * r)[2 * c] + in.row(2 * r)[2 * c + 1];
      const float lower = in.row(2 * r + 1)[2 * c] + in.row(2 * r + 1)[2 * c + 1];
      out.row(r)[c] = 0.25F * (upper + lower);
    }
  }
  return Status::ok;
}

Status thicken_and_halve(const ImageView& in, const ImageView& out, std::size_t first, std::size_t count) {
  const bool valid = is_consistent(in) && is_consistent(out) && in.side == 2 * out.side && first <= out.side &&
                     count <= out.side - first;
  assert(valid);
  if (!valid) {
    return Status::invalid_argument;
  }
  const auto read = [&in](std::size_t column, std::size_t row) { return in.row(row)[column]; };
  for (std::size_t r = first; r < first + count; ++r) {
    thicken_and_halve_row(read, in.side, r, out.row(r));
  }
  return Status::ok;
}

float normalise(const ImageView& image) {
  assert(is_consistent(image));
  float largest = 0.0F;
  for (const float pixel : image.pixels) {
    largest = std::max(largest, pixel);
  }
  if (largest > 0.0F) {
    for (float& pixel : image.pixels) {
      pixel /= largest;
    }
  }
  return largest;
}

Status EdgeBlur::begin(const ImageView& image, std::uint16_t margin_pixels, Span<float> scratch) {
  const bool valid = is_consistent(image) && margin_pixels > 0 && 4 * margin_pixels <= image.side &&
                     scratch.size() >= scratch_size(image.side, margin_pixels);
  assert(valid);
  if (!valid) {
    image_ = {};
    return Status::invalid_argument;
  }
  image_ = image;
  margin_ = margin_pixels;
  next_ = 0;
  const std::size_t band = 2 * margin_ * image.side;
  const std::size_t line = image.side + 4 * margin_;
  rows_ = scratch.first(band);
  columns_ = scratch.subspan(band, band);
  line_ = scratch.subspan(2 * band, line);
  kernel_ = scratch.subspan(2 * band + line, 2 * margin_ + 1);
  gaussian_kernel(static_cast<double>(margin_) / 2.0, kernel_);
  return Status::ok;
}

bool EdgeBlur::step(std::size_t count) {
  const std::size_t band = 2 * margin_;
  const std::size_t side = image_.side;
  const std::size_t all = band + 2 * side;
  for (std::size_t i = 0; i < count && next_ < all && side > 0; ++i, ++next_) {
    if (next_ < band) {
      blur_band_row(next_);
    } else if (next_ < band + side) {
      blur_across_columns(next_ - band);
    } else {
      blend_row(next_ - band - side);
    }
  }
  return side == 0 || next_ == all;
}

/// A row of the upper and lower band, both ways.
void EdgeBlur::blur_band_row(std::size_t band_row) {
  const std::size_t side = image_.side;
  const std::size_t radius = 2 * margin_;
  const std::size_t centre = (side - margin_ + band_row) % side;
  float* const down = line_.data() + radius;
  const float* const middle = image_.row(centre);
  for (std::size_t c = 0; c < side; ++c) {
    down[c] = kernel_[0] * middle[c];
  }
  for (std::size_t k = 1; k <= radius; ++k) {
    const float* const before = image_.row((centre + side - k) % side);
    const float* const behind = image_.row((centre + k) % side);
    const float weight = kernel_[k];
    for (std::size_t c = 0; c < side; ++c) {
      down[c] += weight * (before[c] + behind[c]);
    }
  }
  std::copy(down + side - radius, down + side, line_.data());
  std::copy(down, down + radius, down + side);
  convolve(line_.data(), side, kernel_, rows_.data() + band_row * side);
}

/// A row's piece in the left and right band, along the row; the other way follows in blend_row().
void EdgeBlur::blur_across_columns(std::size_t r) {
  const float* const row = image_.row(r);
  const std::size_t reach = 3 * margin_;
  std::copy(row + image_.side - reach, row + image_.side, line_.data());
  std::copy(row, row + reach, line_.data() + reach);
  convolve(line_.data(), 2 * margin_, kernel_, columns_.data() + r * 2 * margin_);
}

/// A row's piece in the left and right band, blurred both ways, at the start of the line's memory.
void EdgeBlur::blur_down_columns(std::size_t r) {
  const std::size_t side = image_.side;
  const std::size_t width = 2 * margin_;
  float* const out = line_.data();
  for (std::size_t c = 0; c < width; ++c) {
    out[c] = kernel_[0] * columns_[r * width + c];
  }
  for (std::size_t k = 1; k < kernel_.size(); ++k) {
    const float* const before = columns_.data() + (r + side - k) % side * width;
    const float* const behind = columns_.data() + (r + k) % side * width;
    const float weight = kernel_[k];
    for (std::size_t c = 0; c < width; ++c) {
      out[c] += weight * (before[c] + behind[c]);
    }
  }
}

/// The bands lie across the seams of the periodic picture: their first halves end at the last row or column.
void EdgeBlur::blend_row(std::size_t r) {
  const std::size_t side = image_.side;
  float* const row = image_.row(r);
  const std::size_t row_distance = std::min(r, side - 1 - r);
  const auto band_index = [this, side](std::size_t i) { return i < margin_ ? i + margin_ : i - (side - margin_); };
  const auto share = [this](std::size_t distance) {
    return static_cast<float>(distance) / static_cast<float>(margin_);
  };
  if (row_distance < margin_) {
    const float* const blurred = rows_.data() + band_index(r) * side;
    for (std::size_t c = 0; c < side; ++c) {
      const float keep = share(std::min(row_distance, std::min(c, side - 1 - c)));
      row[c] = keep * row[c] + (1.0F - keep) * blurred[c];
    }
    return;
  }
  blur_down_columns(r);
  for (std::size_t i = 0; i < margin_; ++i) {
    const float keep = share(i);
    for (const std::size_t c : {i, side - 1 - i}) {
      row[c] = keep * row[c] + (1.0F - keep) * line_[band_index(c)];
    }
  }
}

}  // namespace mellin
