// Square float images over the caller's memory, and the preprocessing of occupancy grids before they are matched
// (paper, Sections IV-A and IV-B): obstacles thickened, blurred, halved, normalised, borders made seamless.
//
// Index order as in grid/submap.hpp: pixel (column, row) lies at pixels[row * side + column].
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/row_blur.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

/// A square image that somebody else owns.
struct ImageView {
  Span<float> pixels;  ///< side * side
  std::uint16_t side = 0;

  float* row(std::size_t r) const { return pixels.data() + r * side; }
  float at(std::size_t column, std::size_t r) const { return pixels[r * side + column]; }
};

/// Whether `image` has pixels for its side. Everything below asserts it and, where it returns a Status, returns
/// invalid_argument otherwise.
bool is_consistent(const ImageView& image);

/// A cell's share of hits, 0 to 1 (byte / 254). Unobserved cells count as free (paper, Section IV-B1).
inline float hit_share(std::uint8_t cell) { return cell == kUnobserved ? 0.0F : static_cast<float>(cell) / 254.0F; }

/// The obstacles of `grid` as an image of the same side. invalid_argument: sizes differ or do not hold.
Status obstacle_image(const GridView& grid, const ImageView& out);

/// Erosion of free space: each pixel becomes the maximum of its 3 x 3 neighbourhood, so that obstacles grow by a pixel
/// (paper, Section IV-B2). `out` is another image of the same side. invalid_argument: sizes differ.
Status thicken(const ImageView& in, const ImageView& out);

/// Gaussian blur with a standard deviation of one pixel, kernel cut at four, mirrored at the border without repeating
/// the outermost pixel; the paper's alternative to erosion (Section IV-B2). `out` is another image of the same side;
/// `scratch` holds at least RowBlur::scratch_size(side, 1) floats. invalid_argument: sizes differ, or a side below
/// RowBlur::kMinSide.
Status blur(const ImageView& in, const ImageView& out, Span<float> scratch);

/// Means of 2 x 2 pixels. `out` has half the side and may start where `in` starts. invalid_argument: sizes.
Status halve(const ImageView& in, const ImageView& out);

/// thicken, then halve, in one pass and without the image between them. `out` has half the side and may start where
/// `in` starts. Rows [first, first + count) of `out`, in ascending calls. invalid_argument: sizes.
Status thicken_and_halve(const ImageView& in, const ImageView& out, std::size_t first, std::size_t count);

/// Divides by the largest pixel and returns it; an image without a positive pixel stays as it is (returns 0).
float normalise(const ImageView& image);

/// Makes an image seamless for the DFT, which takes it for periodic: a margin along the borders is blended into its
/// cyclically blurred self (paper, Section IV-A step 1). The blur's standard deviation is half the margin.
class EdgeBlur {
 public:
  /// Width of the margin [pixels] that is `share` of the side, at least 2, at most a quarter of the side.
  static constexpr std::uint16_t margin(std::uint16_t side, float share) {
    const auto wanted = static_cast<std::uint16_t>(static_cast<float>(side) * share);
    const auto most = static_cast<std::uint16_t>(side / 4);
    return wanted < 2 ? std::uint16_t{2} : (wanted > most ? most : wanted);
  }
  /// Floats that begin() needs: two blurred bands, a line with its surroundings, the kernel. Below side * side for
  /// sides from 32 on and margins up to a tenth.
  static constexpr std::size_t scratch_size(std::uint16_t side, std::uint16_t margin_pixels) {
    const std::size_t band = std::size_t{2} * margin_pixels * side;
    return 2 * band + side + std::size_t{6} * margin_pixels + 1;
  }
  /// Lines of work in all, for step().
  static constexpr std::size_t lines(std::uint16_t side, std::uint16_t margin_pixels) {
    return std::size_t{2} * margin_pixels + std::size_t{2} * side;
  }

  /// Starts on `image`, which step() changes in place; both spans must live until it is done.
  /// invalid_argument: image inconsistent, margin of 0 or over side / 4, scratch too small.
  Status begin(const ImageView& image, std::uint16_t margin_pixels, Span<float> scratch);
  /// Treats up to `count` lines (each at most 2 side * (2 margin + 1) multiplications); true when done.
  bool step(std::size_t count);

 private:
  void blur_band_row(std::size_t band_row);
  void blur_across_columns(std::size_t row);
  void blur_down_columns(std::size_t row);
  void blend_row(std::size_t row);

  ImageView image_;
  std::size_t margin_ = 0;
  std::size_t next_ = 0;  // lines done: rows of the band, rows across the columns' band, rows blended
  Span<float> rows_;      // rows side - margin … side - 1, 0 … margin - 1, blurred
  Span<float> columns_;   // of each row the columns side - margin … side - 1, 0 … margin - 1, blurred along the row
  Span<float> line_;
  Span<float> kernel_;  // one half, from the centre on
};

}  // namespace mellin
