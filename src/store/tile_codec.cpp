#include "mellin/store/tile_codec.hpp"

#include <cassert>
#include <cstring>

namespace mellin {
namespace {

// A probability that a bit is 1 in the upper 13 bits of a word, how often it was adapted in the lower 3: young ones
// learn fast (rate 1/2, 1/4, …), old ones slowly.
constexpr std::uint16_t kCountMask = 7;
constexpr std::uint16_t kSlowestShift = 6;
constexpr std::uint16_t kEven = 0x8000;
/// Keeps probabilities off 0 and 1, where a wrong guess would cost without bound.
constexpr std::uint32_t kMargin = 64;

constexpr std::uint32_t chance(std::uint16_t p) { return p & ~std::uint32_t{kCountMask}; }

std::uint16_t adapted(std::uint16_t p, bool bit) {
  const std::uint32_t count = p & kCountMask;
  const std::uint32_t shift = count + 1 < kSlowestShift ? count + 1 : kSlowestShift;
  std::uint32_t value = chance(p);
  if (bit) {
    value += (0x10000U - value) >> shift;
  } else {
    value -= value >> shift;
  }
  value = value < kMargin ? kMargin : value > 0x10000U - kMargin ? 0x10000U - kMargin : value;
  const std::uint32_t next = count < kCountMask ? count + 1 : count;
  return static_cast<std::uint16_t>((value & ~std::uint32_t{kCountMask}) | next);
}

/// Divides [low, high] by the chance of a 1, which takes the lower part.
std::uint32_t split(std::uint32_t low, std::uint32_t high, std::uint16_t p) {
  return low + static_cast<std::uint32_t>((std::uint64_t{high - low} * chance(p)) >> 16U);
}

constexpr std::uint32_t kTopByte = 0xFF000000U;
constexpr std::uint32_t kHighestTreeBit = 128;

/// What the contexts tell apart: unobserved, free, rather free, rather occupied.
std::uint32_t cell_class(std::uint8_t cell) {
  if (cell == kUnobserved) {
    return 0;
  }
  return cell == 0 ? 1U : cell <= kCertainlyOccupied / 2 ? 2U : 3U;
}

std::uint32_t coarse(std::uint32_t cell_class) { return cell_class < 2 ? cell_class : 2U; }

struct Neighbours {
  std::uint32_t w, n, nw, ne;  ///< classes
  std::uint32_t context() const { return ((w * 4 + n) * 3 + coarse(nw)) * 3 + coarse(ne); }
  std::uint32_t tree() const {
    const std::uint32_t most = w > n ? w : n;
    return most < 2 ? 0U : most - 1;
  }
};

/// Classes of the cells already coded around (column, row). One that lies outside the tile is taken to be like the
/// nearest one known; the first cell's are unobserved.
Neighbours neighbours(const std::uint8_t* tile, const TileRect& rect, std::uint32_t column, std::uint32_t row) {
  const std::uint8_t* const here = tile + row * rect.width + column;
  if (row == 0) {
    const std::uint32_t w = column == 0 ? 0U : cell_class(here[-1]);
    return {w, w, w, w};
  }
  const std::uint8_t* const above = here - rect.width;
  const std::uint32_t n = cell_class(*above);
  const std::uint32_t w = column == 0 ? n : cell_class(here[-1]);
  return {w, n, column == 0 ? n : cell_class(above[-1]), column + 1U == rect.width ? n : cell_class(above[1])};
}

bool all_unobserved(Span<const std::uint8_t> tile) {
  for (const std::uint8_t cell : tile) {
    if (cell != kUnobserved) {
      return false;
    }
  }
  return true;
}

}  // namespace

/// The order of decisions, the same for both directions: a coder's code() writes the bit or sets it.
class TileCoding {
 public:
  template <class Coder>
  static void tile(Coder& coder, Span<std::uint8_t> cells, const TileRect& rect) {
    TileModel& model = coder.model_;
    bool empty = all_unobserved(cells);
    coder.code(model.empty[0], empty);
    if (empty) {
      std::memset(cells.data(), kUnobserved, cells.size());
      return;
    }
    for (std::uint32_t row = 0; row < rect.height; ++row) {
      for (std::uint32_t column = 0; column < rect.width; ++column) {
        cell(coder, cells[row * rect.width + column], neighbours(cells.data(), rect, column, row));
      }
    }
  }

 private:
  template <class Coder>
  static void cell(Coder& coder, std::uint8_t& cell, const Neighbours& around) {
    TileModel& model = coder.model_;
    bool unobserved = cell == kUnobserved;
    coder.code(model.unobserved[around.context()], unobserved);
    if (unobserved) {
      cell = kUnobserved;
      return;
    }
    bool free = cell == 0;
    coder.code(model.free[around.context()], free);
    if (free) {
      cell = 0;
      return;
    }
    value(coder, cell, model.value[around.tree()]);
  }

  template <class Coder>
  static void value(Coder& coder, std::uint8_t& value, std::uint16_t (&tree)[256]) {
    std::uint32_t node = 1;
    for (std::uint32_t mask = kHighestTreeBit; mask != 0; mask >>= 1U) {
      bool bit = (value & mask) != 0;
      coder.code(tree[node], bit);
      node = node * 2 + (bit ? 1U : 0U);
    }
    value = static_cast<std::uint8_t>(node);
  }
};

TileRect tile_rect(std::uint16_t side, std::uint32_t tile) {
  assert(tile < tile_count(side));
  const std::uint32_t along = tiles_along(side);
  TileRect rect;
  rect.column = static_cast<std::uint16_t>(tile % along * kTileSide);
  rect.row = static_cast<std::uint16_t>(tile / along * kTileSide);
  const auto extent = [side](std::uint16_t from) {
    return static_cast<std::uint16_t>(side - from < kTileSide ? side - from : kTileSide);
  };
  rect.width = extent(rect.column);
  rect.height = extent(rect.row);
  return rect;
}

void gather_tile(const GridView& grid, const TileRect& rect, Span<std::uint8_t> tile) {
  for (std::size_t row = 0; row < rect.height; ++row) {
    const std::size_t from = (rect.row + row) * grid.side + rect.column;
    std::memcpy(&tile[row * rect.width], &grid.cells[from], rect.width);
  }
}

void scatter_tile(Span<const std::uint8_t> tile, const TileRect& rect, std::uint16_t side, Span<std::uint8_t> cells) {
  for (std::size_t row = 0; row < rect.height; ++row) {
    const std::size_t to = (rect.row + row) * side + rect.column;
    std::memcpy(&cells[to], &tile[row * rect.width], rect.width);
  }
}

void TileModel::reset() {
  empty[0] = kEven;
  for (std::uint16_t& p : unobserved) {
    p = kEven;
  }
  for (std::uint16_t& p : free) {
    p = kEven;
  }
  for (auto& tree : value) {
    for (std::uint16_t& p : tree) {
      p = kEven;
    }
  }
}

void TileEncoder::begin(Span<std::uint8_t> out) {
  model_.reset();
  out_ = out;
  size_ = 0;
  limit_ = 0;
  low_ = 0;
  high_ = 0xFFFFFFFFU;
  tiles_ = 0;
  overflow_ = false;
}

TileEncoder::Outcome TileEncoder::add(Span<std::uint8_t> tile, const TileRect& rect) {
  const std::size_t size = size_;
  const std::uint32_t low = low_;
  const std::uint32_t high = high_;
  const std::size_t room = out_.empty() ? 0 : out_.size() - 1;  // finish() needs a byte
  const std::size_t raw = size_ + rect.cells();
  limit_ = raw < room ? raw : room;
  overflow_ = false;
  TileCoding::tile(*this, tile.first(rect.cells()), rect);
  if (!overflow_) {
    ++tiles_;
    return Outcome::added;
  }
  size_ = size;
  low_ = low;
  high_ = high;
  return raw <= room ? Outcome::incompressible : Outcome::no_room;
}

std::size_t TileEncoder::finish() {
  // A number in [low, high] whose lower bytes are zero, as the decoder takes what lies behind the end to be. Their top
  // bytes differ here, so there is one.
  if (low_ != 0 && size_ < out_.size()) {
    out_[size_++] = static_cast<std::uint8_t>((low_ >> 24U) + 1U);
  }
  while (size_ > 0 && out_[size_ - 1] == 0) {
    --size_;
  }
  return size_;
}

void TileEncoder::code(std::uint16_t& probability, bool& bit) {
  if (overflow_) {
    return;
  }
  const std::uint32_t middle = split(low_, high_, probability);
  if (bit) {
    high_ = middle;
  } else {
    low_ = middle + 1;
  }
  probability = adapted(probability, bit);
  while (((low_ ^ high_) & kTopByte) == 0) {
    emit(static_cast<std::uint8_t>(high_ >> 24U));
    low_ <<= 8U;
    high_ = (high_ << 8U) | 0xFFU;
  }
}

void TileEncoder::emit(std::uint8_t byte) {
  if (size_ >= limit_) {
    overflow_ = true;
    return;
  }
  out_[size_++] = byte;
}

void TileDecoder::begin(Span<const std::uint8_t> in) {
  model_.reset();
  in_ = in;
  position_ = 0;
  low_ = 0;
  high_ = 0xFFFFFFFFU;
  code_ = 0;
  for (int i = 0; i < 4; ++i) {
    code_ = (code_ << 8U) | take();
  }
}

void TileDecoder::next(Span<std::uint8_t> tile, const TileRect& rect) {
  TileCoding::tile(*this, tile.first(rect.cells()), rect);
}

void TileDecoder::code(std::uint16_t& probability, bool& bit) {
  const std::uint32_t middle = split(low_, high_, probability);
  bit = code_ <= middle;
  if (bit) {
    high_ = middle;
  } else {
    low_ = middle + 1;
  }
  probability = adapted(probability, bit);
  while (((low_ ^ high_) & kTopByte) == 0) {
    low_ <<= 8U;
    high_ = (high_ << 8U) | 0xFFU;
    code_ = (code_ << 8U) | take();
  }
}

std::uint8_t TileDecoder::take() { return position_ < in_.size() ? in_[position_++] : std::uint8_t{0}; }

}  // namespace mellin
