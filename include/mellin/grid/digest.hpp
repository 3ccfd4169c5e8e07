// The digest of a submap: a thumbnail that stays in RAM and is screened against all others (paper, Section III-C), with
// what was observed beside it, so that a hypothesis can be checked on the digests alone.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/row_blur.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

/// Bytes of a mask of side * side bits: row-major, the lowest bit of a byte first.
constexpr std::size_t mask_bytes(std::uint16_t side) { return (std::size_t{side} * side + 7) / 8; }

inline bool mask_bit(Span<const std::uint8_t> mask, std::size_t i) { return ((mask[i / 8] >> (i % 8)) & 1U) != 0; }

/// A digest that somebody else owns. Pixel (column, row) has index row * side + column, frame as the submap's.
struct DigestView {
  Span<const std::uint8_t> obstacles;  ///< side * side: thickened, scaled and normalised, 0 … 255
  Span<const std::uint8_t> observed;   ///< mask: at least half of the pixel's cells were observed; may be empty
  Span<const std::uint8_t> free;       ///< mask: observed and no cell reaches kFreeBelow; may be empty
  std::uint16_t side = 0;              ///< pixels
  float cell_m = 0.0F;                 ///< edge of a pixel, m
};

/// A digest to be written. Empty masks are left out (an image for registration needs none).
struct DigestOut {
  Span<std::uint8_t> obstacles;
  Span<std::uint8_t> observed;
  Span<std::uint8_t> free;
  std::uint16_t side = 0;

  /// Memory for one digest with both masks.
  template <class A>
  static constexpr DigestOut carve(A& arena, std::uint16_t side, Part part = Part::digests) {
    DigestOut out;
    out.obstacles = arena.template take<std::uint8_t>(std::size_t{side} * side, part);
    out.observed = arena.template take<std::uint8_t>(mask_bytes(side), part);
    out.free = arena.template take<std::uint8_t>(mask_bytes(side), part);
    out.side = side;
    return out;
  }
  DigestView view(float cell_m) const { return {obstacles, observed, free, side, cell_m}; }
};

/// A cell with less than this (a quarter of the observations were hits) counts as free.
inline constexpr std::uint8_t kFreeBelow = 64;

/// What is done to obstacles, thin as lasers see them, before a picture is halved or matched (paper, Section IV-B2).
enum class Preprocessing : std::uint8_t {
  none,
  erosion,  ///< of free space: obstacles grow by a cell, thicken() in image.hpp
  blur      ///< Gaussian, standard deviation one cell, blur() in image.hpp
};

/// Makes a digest, or the picture that the matcher registers, from a submap's grid: it is preprocessed (by default
/// obstacles are thickened by a cell), halved and normalised, again and again until it has the wanted side (paper,
/// Sections IV-B2 and V-A). At the grid's own side it is preprocessed and normalised.
class DigestMaker {
 public:
  /// Floats of scratch that begin() needs: a picture of half the grid's side, none where nothing is halved; to blur,
  /// ten rows and one of the grid beside it.
  static constexpr std::size_t scratch_size(std::uint16_t grid_side, std::uint16_t digest_side,
                                            Preprocessing preprocessing = Preprocessing::erosion) {
    const std::size_t picture = digest_side == grid_side ? 0 : std::size_t{grid_side} * grid_side / 4;
    const std::size_t factor = digest_side == grid_side ? 1 : 2;
    return picture + (preprocessing == Preprocessing::blur ? RowBlur::scratch_size(grid_side, factor) : 0);
  }

  /// Starts on `grid`; grid, scratch and out must live until step() is done.
  /// invalid_argument: sizes do not hold, or the grid's side is not the digest's times a power of two, or what is to be
  /// blurred has less than six rows.
  Status begin(const GridView& grid, Span<float> scratch, const DigestOut& out,
               Preprocessing preprocessing = Preprocessing::erosion);
  /// Treats up to `lines` rows, of the grid's cells under two rows of its first half, or under a row of the digest for
  /// the masks: at most grid side * max(4, grid side / digest side) cells a row, 6 grid side where it is blurred, each
  /// cell ten times; true when done.
  bool step(std::size_t lines);

 private:
  enum class Stage : std::uint8_t { masks, first, halve, write, done };

  std::size_t stage_rows() const;
  void next_stage();
  void mask_row(std::size_t row);
  void first_row(std::size_t row);
  void halve_row(std::size_t row);
  void write_row(std::size_t row);
  template <class Read>
  void preprocess_and_halve(const Read& read, std::size_t side, std::size_t row);
  const float* blurred_full_row(std::size_t row);
  void thicken_and_halve_cells(std::size_t row);
  void full_strip(std::size_t row, std::size_t first, std::size_t count, const float* blurred, float* out) const;

  GridView grid_;
  DigestOut out_;
  Span<float> picture_;
  Span<float> blur_scratch_;
  Preprocessing preprocessing_ = Preprocessing::erosion;
  RowBlur row_blur_;
  Stage stage_ = Stage::done;
  std::size_t row_ = 0;     // next row of the stage
  std::uint16_t side_ = 0;  // of the picture that the stage makes
  float largest_ = 0.0F;    // maximum of that picture so far
};

/// All of it at once. Status as DigestMaker::begin(). Time: some ten operations a cell.
Status make_digest(const GridView& grid, Span<float> scratch, const DigestOut& out,
                   Preprocessing preprocessing = Preprocessing::erosion);

}  // namespace mellin
