#include "mellin/store/tile_codec.hpp"

#include <doctest.h>

#include <algorithm>
#include <string>

#include "store_fixture.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// Codes as many tiles of a grid as fit and decodes them again; returns the payload's length, -1 where they differ.
long round_trip(const Bytes& cells, std::uint16_t side, std::size_t room, std::uint32_t& tiles) {
  Bytes payload(room + 1, 0xA5);
  TileEncoder encoder;
  encoder.begin(Span<std::uint8_t>(payload.data(), room));
  const GridView grid{Span<const std::uint8_t>(cells.data(), cells.size()), side, 0.05F};
  std::uint8_t tile[kTileCells];
  for (tiles = 0; tiles < tile_count(side); ++tiles) {
    gather_tile(grid, tile_rect(side, tiles), tile);
    if (encoder.add(tile, tile_rect(side, tiles)) != TileEncoder::Outcome::added) {
      break;
    }
  }
  const std::size_t size = encoder.finish();
  if (payload[room] != 0xA5 || size > room || encoder.tiles() != tiles) {
    return -1;
  }
  TileDecoder decoder;
  decoder.begin(Span<const std::uint8_t>(payload.data(), size));
  Bytes back(cells.size(), 7);
  for (std::uint32_t i = 0; i < tiles; ++i) {
    const TileRect rect = tile_rect(side, i);
    decoder.next(tile, rect);
    scatter_tile(Span<const std::uint8_t>(tile, rect.cells()), rect, side,
                 Span<std::uint8_t>(back.data(), back.size()));
    for (std::size_t r = rect.row; r < std::size_t{rect.row} + rect.height; ++r) {
      for (std::size_t c = rect.column; c < std::size_t{rect.column} + rect.width; ++c) {
        if (back[r * side + c] != cells[r * side + c]) {
          return -1;
        }
      }
    }
  }
  return static_cast<long>(size);
}

}  // namespace

TEST_CASE("tiles cover the grid once, cut off at its edges") {
  for (const int edge : {2, 32, 34, 64, 100, 768}) {
    const auto side = static_cast<std::uint16_t>(edge);
    Bytes covered(std::size_t{side} * side, 0);
    for (std::uint32_t tile = 0; tile < tile_count(side); ++tile) {
      const TileRect rect = tile_rect(side, tile);
      for (std::size_t r = rect.row; r < std::size_t{rect.row} + rect.height; ++r) {
        for (std::size_t c = rect.column; c < std::size_t{rect.column} + rect.width; ++c) {
          ++covered[r * side + c];
        }
      }
    }
    CHECK(std::count(covered.begin(), covered.end(), 1) == static_cast<std::ptrdiff_t>(covered.size()));
  }
}

TEST_CASE("every grid survives, and so does every tile that fits, whatever room there is") {
  Random32 random(5);
  std::uint32_t tiles = 0;
  for (int trial = 0; trial < trials(400); ++trial) {
    const auto side = static_cast<std::uint16_t>(2 + 2 * (random() % 60));
    Bytes cells =
        trial % 4 == 0 ? random_bytes(std::size_t{side} * side, random()) : room_grid(side < 16 ? 16 : side, random());
    const auto true_side = static_cast<std::uint16_t>(std::lround(std::sqrt(static_cast<double>(cells.size()))));
    if (trial % 4 == 3) {
      const auto only = static_cast<std::uint8_t>(random());
      std::fill(cells.begin(), cells.end(), only);
    }
    CHECK(round_trip(cells, true_side, random() % 3000, tiles) >= 0);
    if (trial % 4 != 0) {
      CHECK(round_trip(cells, true_side, 20'000, tiles) >= 0);
      CHECK(tiles == tile_count(true_side));
    }
  }
}

TEST_CASE("unobserved space costs next to nothing, and noise is told to be incompressible") {
  std::uint32_t tiles = 0;
  const long size = round_trip(Bytes(768 * 768, kUnobserved), 768, 2000, tiles);
  CHECK(tiles == 576);
  CHECK(size <= 8);
  TileEncoder encoder;
  Bytes payload(4000);
  encoder.begin(Span<std::uint8_t>(payload.data(), payload.size()));
  Bytes noise = random_bytes(kTileCells, 8);
  CHECK(encoder.add(Span<std::uint8_t>(noise.data(), noise.size()), tile_rect(32, 0)) ==
        TileEncoder::Outcome::incompressible);
  CHECK(encoder.tiles() == 0);
  CHECK(encoder.finish() == 0);
  encoder.begin(Span<std::uint8_t>(payload.data(), 100));
  CHECK(encoder.add(Span<std::uint8_t>(noise.data(), noise.size()), tile_rect(32, 0)) == TileEncoder::Outcome::no_room);
}

TEST_CASE("any bytes decode to some cells") {
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    const Bytes bytes = random_bytes(seed * 3, seed);
    TileDecoder decoder;
    decoder.begin(Span<const std::uint8_t>(bytes.data(), bytes.size()));
    std::uint8_t tile[kTileCells];
    for (std::uint32_t i = 0; i < 9; ++i) {
      decoder.next(tile, tile_rect(96, i));
    }
  }
}
