#include "mellin/grid/digest.hpp"

#include <algorithm>
#include <cassert>

#include "grid/thicken.hpp"
#include "mellin/grid/image.hpp"

namespace mellin {

namespace {

/// Hits of a cell, 0 where unobserved; on the grid's scale, since the digest is normalised at the end.
std::uint8_t hits(std::uint8_t cell) { return cell == kUnobserved ? std::uint8_t{0} : cell; }

/// Reads the same as a pixel.
auto pixels_of(const GridView& grid) {
  return
      [grid](std::size_t c, std::size_t r) { return static_cast<float>(hits(grid.cells.data()[r * grid.side + c])); };
}

std::uint8_t larger(std::uint8_t a, std::uint8_t b) { return a > b ? a : b; }

/// Columns that a row of cells is treated in at a time, as bytes, so that the compiler takes many side by side.
constexpr std::size_t kStrip = 64;

/// `count` cells of `row` thickened across the rows `above` and `below`, as bytes: hits of the columns `first` - 1 …
/// first + count, those beyond the borders as the ones at them.
void column_maxima(const GridView& grid, const std::size_t (&rows)[3], std::size_t first, std::size_t count,
                   std::uint8_t* out) {
  const std::uint8_t* const above = grid.cells.data() + rows[0] * grid.side + first;
  const std::uint8_t* const middle = grid.cells.data() + rows[1] * grid.side + first;
  const std::uint8_t* const below = grid.cells.data() + rows[2] * grid.side + first;
  for (std::size_t c = 0; c < count; ++c) {
    out[c + 1] = larger(larger(hits(above[c]), hits(middle[c])), hits(below[c]));
  }
  const auto at = [&](std::ptrdiff_t c) { return larger(larger(hits(above[c]), hits(middle[c])), hits(below[c])); };
  out[0] = first == 0 ? out[1] : at(-1);
  out[count + 1] = first + count == grid.side ? out[count] : at(static_cast<std::ptrdiff_t>(count));
}

/// `count` <= kStrip cells of a row of the grid thickened by 3 x 3, from column `first` on.
void thicken_cells(const GridView& grid, std::size_t row, std::size_t first, std::size_t count, std::uint8_t* out) {
  const std::size_t rows[3] = {row == 0 ? 0 : row - 1, row, std::min(row + 1, grid.side - std::size_t{1})};
  std::uint8_t columns[kStrip + 2];
  column_maxima(grid, rows, first, count, columns);
  for (std::size_t c = 0; c < count; ++c) {
    out[c] = larger(larger(columns[c], columns[c + 1]), columns[c + 2]);
  }
}

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

Status DigestMaker::begin(const GridView& grid, Span<float> scratch, const DigestOut& out,
                          Preprocessing preprocessing) {
  const bool blurred = preprocessing == Preprocessing::blur;
  const std::size_t least_side = blurred ? RowBlur::kMinSide : 1;
  const bool valid = grid.side > 0 && grid.cells.size() == std::size_t{grid.side} * grid.side && out.side > 0 &&
                     is_power_of_two_multiple(grid.side, out.side) &&
                     out.obstacles.size() == std::size_t{out.side} * out.side && fits(out.observed, out.side) &&
                     fits(out.free, out.side) && scratch.size() >= scratch_size(grid.side, out.side, preprocessing) &&
                     (out.side == grid.side ? out.side : 2U * out.side) >= least_side;
  assert(valid);
  stage_ = Stage::done;
  if (!valid) {
    return Status::invalid_argument;
  }
  grid_ = grid;
  out_ = out;
  preprocessing_ = preprocessing;
  picture_ = scratch.first(scratch_size(grid.side, out.side));
  const std::size_t kept = blurred ? RowBlur::scratch_size(grid.side, out.side == grid.side ? 1 : 2) : 0;
  blur_scratch_ = scratch.subspan(picture_.size(), kept);
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
        observed += cells[c] != kUnobserved ? 1U : 0U;
        highest = larger(highest, hits(cells[c]));
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

template <class Read>
void DigestMaker::preprocess_and_halve(const Read& read, std::size_t side, std::size_t row) {
  float* const out = picture_.data() + row * side_;
  switch (preprocessing_) {
    case Preprocessing::erosion:
      largest_ = std::max(largest_, thicken_and_halve_row(read, side, row, out));
      return;
    case Preprocessing::blur:
      row_blur_.make_row(read, side, 2, row, blur_scratch_, out);
      break;
    case Preprocessing::none:
      for (std::size_t c = 0; c < side_; ++c) {
        const float upper = read(2 * c, 2 * row) + read(2 * c + 1, 2 * row);
        const float lower = read(2 * c, 2 * row + 1) + read(2 * c + 1, 2 * row + 1);
        out[c] = 0.25F * (upper + lower);
      }
      break;
  }
  largest_ = std::max(largest_, *std::max_element(out, out + side_));
}

/// The first halving of eroded free space: as preprocess_and_halve(), but on bytes.
void DigestMaker::thicken_and_halve_cells(std::size_t row) {
  std::uint8_t upper[kStrip];
  std::uint8_t lower[kStrip];
  std::uint16_t fourfold = 0;  // the largest sum of four cells
  for (std::size_t first = 0; first < grid_.side; first += kStrip) {
    const std::size_t count = std::min(kStrip, grid_.side - first);
    thicken_cells(grid_, 2 * row, first, count, upper);
    thicken_cells(grid_, 2 * row + 1, first, count, lower);
    float* const out = picture_.data() + row * side_ + first / 2;
    for (std::size_t c = 0; c < count / 2; ++c) {
      const auto sum = static_cast<std::uint16_t>(upper[2 * c] + upper[2 * c + 1] + lower[2 * c] + lower[2 * c + 1]);
      fourfold = sum > fourfold ? sum : fourfold;
      out[c] = 0.25F * static_cast<float>(sum);
    }
  }
  largest_ = std::max(largest_, 0.25F * static_cast<float>(fourfold));
}

/// The first halving reads the grid itself, so that no picture of its side is needed. Without any, the maximum is all
/// that is wanted: thickening does not change it.
void DigestMaker::first_row(std::size_t row) {
  const GridView& grid = grid_;
  if (side_ != grid.side) {
    return preprocessing_ == Preprocessing::erosion ? thicken_and_halve_cells(row)
                                                    : preprocess_and_halve(pixels_of(grid), grid.side, row);
  }
  if (preprocessing_ == Preprocessing::blur) {
    const float* const blurred = blurred_full_row(row);
    largest_ = std::max(largest_, *std::max_element(blurred, blurred + side_));
    return;
  }
  const std::uint8_t* const cells = grid.cells.data() + row * grid.side;
  std::uint8_t highest = 0;
  for (std::size_t c = 0; c < grid.side; ++c) {
    highest = larger(highest, hits(cells[c]));
  }
  largest_ = std::max(largest_, static_cast<float>(highest));
}

void DigestMaker::halve_row(std::size_t row) {
  const std::size_t from = 2 * std::size_t{side_};
  const float* const pixels = picture_.data();
  const auto read = [pixels, from](std::size_t c, std::size_t r) { return pixels[r * from + c]; };
  preprocess_and_halve(read, from, row);
}

/// Row `row` of the grid, blurred; valid until the next one. Made twice, for the maximum and to be written, which
/// spares a picture.
const float* DigestMaker::blurred_full_row(std::size_t row) {
  const GridView& grid = grid_;
  const auto read = pixels_of(grid);
  // Once a row is blurred along, the line that it was read into is free.
  float* const out = blur_scratch_.data() + RowBlur::kMaxTaps * grid.side;
  row_blur_.make_row(read, grid.side, 1, row, blur_scratch_, out);
  return out;
}

/// Row `row` at the grid's own side, before it is normalised, from column `first` on, `count` <= kStrip columns.
void DigestMaker::full_strip(std::size_t row, std::size_t first, std::size_t count, const float* blurred,
                             float* out) const {
  std::uint8_t cells[kStrip];
  switch (preprocessing_) {
    case Preprocessing::erosion:
      thicken_cells(grid_, row, first, count, cells);
      std::copy(cells, cells + count, out);
      return;
    case Preprocessing::blur:
      std::copy(blurred + first, blurred + first + count, out);
      return;
    case Preprocessing::none:
      std::transform(grid_.cells.data() + row * grid_.side + first,
                     grid_.cells.data() + row * grid_.side + first + count, out,
                     [](std::uint8_t cell) { return static_cast<float>(hits(cell)); });
      return;
  }
}

/// One division at the end equals normalising at every scale: maxima and means scale with their arguments.
void DigestMaker::write_row(std::size_t row) {
  const float scale = largest_ > 0.0F ? 255.0F / largest_ : 0.0F;
  const bool full = out_.side == grid_.side;
  const float* const blurred = full && preprocessing_ == Preprocessing::blur ? blurred_full_row(row) : nullptr;
  for (std::size_t first = 0; first < out_.side; first += kStrip) {
    const std::size_t count = std::min(kStrip, out_.side - first);
    float strip[kStrip];
    if (full) {
      full_strip(row, first, count, blurred, strip);
    }
    const float* const values = full ? strip : picture_.data() + row * out_.side + first;
    std::uint8_t* const out = out_.obstacles.data() + row * out_.side + first;
    for (std::size_t c = 0; c < count; ++c) {
      out[c] = static_cast<std::uint8_t>(std::min(255.0F, values[c] * scale + 0.5F));
    }
  }
}

Status make_digest(const GridView& grid, Span<float> scratch, const DigestOut& out, Preprocessing preprocessing) {
  DigestMaker maker;
  const Status status = maker.begin(grid, scratch, out, preprocessing);
  while (!maker.step(out.side)) {
  }
  return status;
}

}  // namespace mellin
