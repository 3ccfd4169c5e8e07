#include "spectral/resample.hpp"

#include <algorithm>

namespace mellin {

namespace {

float mix(float a, float b, float share) { return a + share * (b - a); }

/// A pixel, or 0 beyond the border.
float pixel_or_zero(const ImageView& image, int column, int row) {
  const int side = image.side;
  const bool inside = column >= 0 && column < side && row >= 0 && row < side;
  return inside ? image.at(static_cast<std::size_t>(column), static_cast<std::size_t>(row)) : 0.0F;
}

}  // namespace

void turned_row(const ImageView& image, SinCosF turn, std::size_t row, float* out) {
  const int side = image.side;
  const float centre = 0.5F * static_cast<float>(side - 1);
  const float dy = static_cast<float>(row) - centre;
  // Where the pixel comes from, plus 1 so that truncation rounds down as far as the ring of zeros round the picture.
  const float x_of_centre = centre + 1.0F + turn.sin * dy;
  const float y_of_centre = centre + 1.0F + turn.cos * dy;
  const float end = static_cast<float>(side + 1);
  const float* const pixels = image.pixels.data();
  for (int c = 0; c < side; ++c) {
    const float dx = static_cast<float>(c) - centre;
    const float x = x_of_centre + turn.cos * dx;
    const float y = y_of_centre - turn.sin * dx;
    if (!(x > 0.0F && x < end && y > 0.0F && y < end)) {
      out[c] = 0.0F;
      continue;
    }
    const int column = static_cast<int>(x) - 1;
    const int line = static_cast<int>(y) - 1;
    const float share_x = x - static_cast<float>(column + 1);
    const float share_y = y - static_cast<float>(line + 1);
    if (column >= 0 && column < side - 1 && line >= 0 && line < side - 1) {
      const float* const lower = pixels + static_cast<std::ptrdiff_t>(line) * side + column;
      const float* const upper = lower + side;
      out[c] = mix(mix(lower[0], lower[1], share_x), mix(upper[0], upper[1], share_x), share_y);
    } else {
      const float lower = mix(pixel_or_zero(image, column, line), pixel_or_zero(image, column + 1, line), share_x);
      const float upper =
          mix(pixel_or_zero(image, column, line + 1), pixel_or_zero(image, column + 1, line + 1), share_x);
      out[c] = mix(lower, upper, share_y);
    }
  }
}

void sample_ring(Span<const float> magnitudes, std::size_t side, float radius, Span<const Complex> directions,
                 float* out) {
  const std::size_t last_column = side / 2;
  const auto offset = static_cast<float>(side);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const float x = radius * directions[i].re;
    const float y = radius * directions[i].im + offset;  // from side / 2 on, so that truncation rounds down
    const std::size_t column = std::min(static_cast<std::size_t>(x), last_column);
    const std::size_t next_column = std::min(column + 1, last_column);
    const auto line = static_cast<std::size_t>(y);
    const float share_x = x - static_cast<float>(column);
    const float share_y = y - static_cast<float>(line);
    const std::size_t low = line >= side ? line - side : line;
    const std::size_t high = low + 1 == side ? 0 : low + 1;
    const float* const here = magnitudes.data() + column * side;
    const float* const there = magnitudes.data() + next_column * side;
    out[i] = mix(mix(here[low], here[high], share_y), mix(there[low], there[high], share_y), share_x);
  }
}

}  // namespace mellin
