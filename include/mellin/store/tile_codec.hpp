// Lossless coding of submap cells, tile by tile: a binary arithmetic coder whose probabilities adapt to the cells
// around (the scheme of JBIG, ITU-T T.82: template contexts and adaptive binary coding; bytewise here). The encoder and
// the decoder need no more memory than themselves and stop after any tile, so that coding can be done in slices.
//
// Each tile codes a flag "no cell observed", then cell by cell in raster order: unobserved? else free (0)? else the
// value 1 to 254 in eight binary decisions. The contexts are the classes of the neighbours W, N, NW, NE within the
// tile. The model starts afresh in every record, so records stand alone.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/span.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

/// Edge of a tile in cells. A grid's tiles are numbered in raster order; those at the far edges may be cut off.
inline constexpr std::uint16_t kTileSide = 32;
inline constexpr std::size_t kTileCells = std::size_t{kTileSide} * kTileSide;

/// Tiles along an edge of the grid, and in all of it.
constexpr std::uint16_t tiles_along(std::uint16_t side) {
  return static_cast<std::uint16_t>((side + kTileSide - 1) / kTileSide);
}
constexpr std::uint32_t tile_count(std::uint16_t side) {
  return static_cast<std::uint32_t>(tiles_along(side)) * tiles_along(side);
}

/// A tile's place in its grid.
struct TileRect {
  std::uint16_t column = 0;  ///< of its first cell
  std::uint16_t row = 0;
  std::uint16_t width = 0;
  std::uint16_t height = 0;
  std::size_t cells() const { return static_cast<std::size_t>(width) * height; }
};

/// Requires tile < tile_count(side).
TileRect tile_rect(std::uint16_t side, std::uint32_t tile);

/// Copies the tile's cells, in raster order, from or to a grid of side * side cells.
void gather_tile(const GridView& grid, const TileRect& rect, Span<std::uint8_t> tile);
void scatter_tile(Span<const std::uint8_t> tile, const TileRect& rect, std::uint16_t side, Span<std::uint8_t> cells);

/// Adaptive probabilities of the binary decisions.
class TileModel {
 public:
  static constexpr std::size_t kContexts = 144;
  static constexpr std::size_t kTrees = 3;
  TileModel() { reset(); }
  void reset();

  std::uint16_t empty[1];
  std::uint16_t unobserved[kContexts];
  std::uint16_t free[kContexts];
  std::uint16_t value[kTrees][256];
};

class TileEncoder {
 public:
  enum class Outcome : std::uint8_t {
    added,
    no_room,        ///< does not fit in what is left of the output
    incompressible  ///< takes more than its raw cells
  };

  /// Starts a record's payload in `out`.
  void begin(Span<std::uint8_t> out);
  /// Codes one tile more. Where the outcome is not `added`, nothing was written, and the record has to be finished.
  /// `tile`: rect.cells() cells in raster order; they are not changed.
  Outcome add(Span<std::uint8_t> tile, const TileRect& rect);
  /// Ends the payload and returns its length. At most the size of `out`.
  std::size_t finish();
  std::uint16_t tiles() const { return tiles_; }

 private:
  friend class TileCoding;
  void code(std::uint16_t& probability, bool& bit);
  void emit(std::uint8_t byte);

  TileModel model_;
  Span<std::uint8_t> out_;
  std::size_t size_ = 0;
  std::size_t limit_ = 0;
  std::uint32_t low_ = 0;
  std::uint32_t high_ = 0xFFFFFFFFU;
  std::uint16_t tiles_ = 0;
  bool overflow_ = false;
};

/// Reads whatever bytes it is given: every input decodes to some cells, and a checksum has to say whether the right
/// ones.
class TileDecoder {
 public:
  /// Starts with a record's payload, which must outlive the decoding.
  void begin(Span<const std::uint8_t> in);
  /// Decodes the next tile: rect.cells() cells in raster order.
  void next(Span<std::uint8_t> tile, const TileRect& rect);

 private:
  friend class TileCoding;
  void code(std::uint16_t& probability, bool& bit);
  std::uint8_t take();

  TileModel model_;
  Span<const std::uint8_t> in_;
  std::size_t position_ = 0;
  std::uint32_t low_ = 0;
  std::uint32_t high_ = 0xFFFFFFFFU;
  std::uint32_t code_ = 0;
};

}  // namespace mellin
