#include "mellin/grid/digest.hpp"

#include <algorithm>
#include <cassert>

#include "grid/thicken.hpp"
#include "mellin/grid/image.hpp"

namespace mellin {

namespace {

/// Hits of a cell, 0 where unobserved; on the grid's scale, since the digest is normalised at the end.
float hits(std::uint8_t cell) { return cell == kUnobserved ? 0.0F : static_cast<float>(cell); }

bool is_power_of_two_multiple(std::uint32_t side, std::uint32_t of) {
  while (of < side) {
    of *= 2;
  }
  return of == side;
}

bool fits(Span<std::uint8_t> mask, std::uint16_t side) { return mask.empty() || mask.size() == mask_bytes(side); }

void set_bit(Span<std::uint8_t> mask, std::size_t i) {
  if (!mask.empty()) {
    mask[i / 8] = static_cast<std::uint8_t>(mask[i / 8] | (1U << (i % 8)));
  }
}

}  // namespace

Status DigestMaker::begin(const GridView& grid, Span<float> scratch, const DigestOut& out) {
  const bool valid = grid.side > 0 && grid.cells.size() == std::size_t{grid.side} * grid.side && out.side > 0 &&
                     is_power_of_two_multiple(grid.side, out.side) &&
                     out.obstacles.size() == std::size_t{out.side} * out.side && fits(out.observed, out.side) &&
                     fits(out.free, out.side) && scratch.size() >= scratch_size(grid.side, out.side);
  assert(valid);
  stage_ = Stage::done;
  if (!valid) {
    return Status::invalid_argument;
  }
  grid_ = grid;
  out_ = out;
  scratch_ = scratch;
  std::fill(out.observed.begin(), out.observed.end(), std::uint8_t{0});
  std::fill(out.free.begin(), out.free.end(), std::uint8_t{0});
  stage_ = Stage::masks;
  row_ = 0;
  largest_ = 0.0F;
  return Status::ok;
}

bool DigestMaker::step(std::size_t lines) {
  for (std::size_t i = 0; i < lines && stage_ != Stage::done; ++i) {
    switch (stage_) {
      case Stage::masks:
        mask_row(row_);
        break;
      case Stage::first:
        first_row(row_);
        break;
      case Stage::halve:
        halve_row(row_);
        break;
      case Stage::write:
        write_row(row_);
        break;
      case Stage::done:
        break;
    }
    if (++row_ == stage_rows()) {
      next_stage();
    }
  }
  return stage_ == Stage::done;
}

std::size_t DigestMaker::stage_rows() const {
  return stage_ == Stage::masks || stage_ == Stage::write ? out_.side : side_;
}

void DigestMaker::next_stage() {
  row_ = 0;
  switch (stage_) {
    case Stage::masks:
      stage_ = Stage::first;
      side_ = out_.side == grid_.side ? grid_.side : static_cast<std::uint16_t>(grid_.side / 2);
      return;
    case Stage::first:
    case Stage::halve:
      if (side_ == out_.side) {
        stage_ = Stage::write;
        return;
      }
      stage_ = Stage::halve;
      side_ = static_cast<std::uint16_t>(side_ / 2);
      largest_ = 0.0F;
      return;
    case Stage::write:
    case Stage::done:
      stage_ = Stage::done;
      return;
  }
}

void DigestMaker::mask_row(std::size_t row) {
  if (out_.observed.empty() && out_.free.empty()) {
    return;
  }
  const std::size_t factor = std::size_t{grid_.side} / out_.side;
  for (std::size_t column = 0; column < out_.side; ++column) {
    std::size_t observed = 0;
    std::uint8_t highest = 0;
    for (std::size_t r = row * factor; r < (row + 1) * factor; ++r) {
      const std::uint8_t* const cells = grid_.cells.data() + r * grid_.side + column * factor;
      for (std::size_t c = 0; c < factor; ++c) {
        if (cells[c] != kUnobserved) {
          ++observed;
          highest = std::max(highest, cells[c]);
        }
      }
    }
    if (2 * observed >= factor * factor) {
      const std::size_t i = row * out_.side + column;
      set_bit(out_.observed, i);
      if (highest < kFreeBelow) {
        set_bit(out_.free, i);
      }
    }
  }
}

/// The first halving reads the grid itself, so that no picture of its side is needed. Without any, the maximum is all
/// that is wanted: thickening does not change it.
void DigestMaker::first_row(std::size_t row) {
  const GridView& grid = grid_;
  if (side_ == grid.side) {
    for (std::size_t c = 0; c < grid.side; ++c) {
      largest_ = std::max(largest_, hits(grid.cells[row * grid.side + c]));
    }
    return;
  }
  const auto read = [&grid](std::size_t c, std::size_t r) { return hits(grid.cells.data()[r * grid.side + c]); };
  largest_ = std::max(largest_, thicken_and_halve_row(read, grid.side, row, scratch_.data() + row * side_));
}

void DigestMaker::halve_row(std::size_t row) {
  const std::size_t from = 2 * std::size_t{side_};
  const float* const pixels = scratch_.data();
  const auto read = [pixels, from](std::size_t c, std::size_t r) { return pixels[r * from + c]; };
  largest_ = std::max(largest_, thicken_and_halve_row(read, from, row, scratch_.data() + row * side_));
}

/// One division at the end equals normalising at every scale: maxima and means scale with their arguments.
void DigestMaker::write_row(std::size_t row) {
  const float scale = largest_ > 0.0F ? 255.0F / largest_ : 0.0F;
  const std::size_t last = out_.side - 1U;
  for (std::size_t c = 0; c <= last; ++c) {
    float value = 0.0F;
    if (out_.side == grid_.side) {
      for (std::size_t r = row == 0 ? 0 : row - 1; r <= std::min(row + 1, last); ++r) {
        for (std::size_t k = c == 0 ? 0 : c - 1; k <= std::min(c + 1, last); ++k) {
          value = std::max(value, hits(grid_.cells[r * grid_.side + k]));
        }
      }
    } else {
      value = scratch_[row * out_.side + c];
    }
    out_.obstacles[row * out_.side + c] = static_cast<std::uint8_t>(std::min(255.0F, value * scale + 0.5F));
  }
}

Status make_digest(const GridView& grid, Span<float> scratch, const DigestOut& out) {
  DigestMaker maker;
  const Status status = maker.begin(grid, scratch, out);
  while (!maker.step(out.side)) {
  }
  return status;
}

}  // namespace mellin
