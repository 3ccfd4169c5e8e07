#include "spectral/resample.hpp"

#include <algorithm>

namespace mellin {

namespace {

float mix(float a, float b, float share) { return a + share * (b - a); }

/// Along a row of the turned picture: where each pixel comes from. Coordinates are larger by 1, so that truncation
/// rounds down as far as the ring of zeros round the picture. Each coordinate is monotone in the column, rounding
/// included: the pixels that come from inside the picture are one run.
struct TurnedRow {
  float x_of_centre;
  float y_of_centre;
  float cos;
  float sin;
  float centre;
  float side;

  float x(std::size_t column) const { return x_of_centre + cos * (static_cast<float>(column) - centre); }
  float y(std::size_t column) const { return y_of_centre - sin * (static_cast<float>(column) - centre); }
  /// All four pixels around it are pixels of the picture.
  bool inside(std::size_t column) const {
    return x(column) >= 1.0F && x(column) < side && y(column) >= 1.0F && y(column) < side;
  }
};

/// A pixel, or 0 beyond the border.
float pixel_or_zero(const ImageView& image, int column, int row) {
  const int side = image.side;
  const bool inside = column >= 0 && column < side && row >= 0 && row < side;
  return inside ? image.at(static_cast<std::size_t>(column), static_cast<std::size_t>(row)) : 0.0F;
}

/// The picture at (x, y), anywhere.
float sample_near_border(const ImageView& image, float x, float y) {
  const float end = static_cast<float>(image.side + 1);
  if (!(x > 0.0F && x < end && y > 0.0F && y < end)) {
    return 0.0F;
  }
  const int column = static_cast<int>(x) - 1;
  const int row = static_cast<int>(y) - 1;
  const float share_x = x - static_cast<float>(column + 1);
  const float lower = mix(pixel_or_zero(image, column, row), pixel_or_zero(image, column + 1, row), share_x);
  const float upper = mix(pixel_or_zero(image, column, row + 1), pixel_or_zero(image, column + 1, row + 1), share_x);
  return mix(lower, upper, y - static_cast<float>(row + 1));
}

}  // namespace

void turned_row(const ImageView& image, SinCosF turn, std::size_t row, const Kernels& kernels, float* out) {
  const int side = image.side;
  const float centre = 0.5F * static_cast<float>(side - 1);
  const float dy = static_cast<float>(row) - centre;
  const TurnedRow from{centre + 1.0F + turn.sin * dy, centre + 1.0F + turn.cos * dy, turn.cos, turn.sin, centre,
                       static_cast<float>(side)};
  std::size_t begin = 0;
  std::size_t end = image.side;
  for (; begin < end && !from.inside(begin); ++begin) {
    out[begin] = sample_near_border(image, from.x(begin), from.y(begin));
  }
  for (; end > begin && !from.inside(end - 1); --end) {
    out[end - 1] = sample_near_border(image, from.x(end - 1), from.y(end - 1));
  }
  kernels.turned_run({image.pixels.data(), side, from.x_of_centre, from.y_of_centre, from.cos, from.sin, centre}, begin,
                     end, out);
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
