#include "mellin/spectral/distance_field.hpp"

#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "mellin/core/random.hpp"

using namespace mellin;

namespace {

constexpr std::uint8_t kFrom = 64;

/// A field with its memory, filled `rows` rows at a time.
std::vector<std::uint8_t> field_of(const std::vector<std::uint8_t>& cells, std::uint16_t side, float cell_m,
                                   float reach_m, std::uint32_t rows = 5) {
  std::vector<std::uint8_t> below(side);
  std::vector<DistanceField::Run> runs(side);
  std::vector<std::uint8_t> out(cells.size(), 77);
  DistanceField field;
  field.begin({{cells.data(), cells.size()}, side, cell_m}, reach_m, kFrom, {out.data(), out.size()},
              {{below.data(), below.size()}, {runs.data(), runs.size()}});
  while (!field.step(rows)) {
  }
  return out;
}

/// Distance in cells from the centre of each cell to that of the nearest obstacle cell, by looking at all of them.
std::vector<double> brute_force(const std::vector<std::uint8_t>& cells, int side) {
  std::vector<double> distances(cells.size(), 1e9);
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const std::uint8_t cell = cells[static_cast<std::size_t>(row * side + column)];
      if (cell < kFrom || cell == kUnobserved) {
        continue;
      }
      for (int r = 0; r < side; ++r) {
        for (int c = 0; c < side; ++c) {
          double& distance = distances[static_cast<std::size_t>(r * side + c)];
          distance = std::min(distance, std::hypot(c - column, r - row));
        }
      }
    }
  }
  return distances;
}

/// A grid with obstacles in a share of its cells, not next to one another: the centre of the hits is the cell's own.
std::vector<std::uint8_t> scattered(int side, double share, std::uint64_t seed) {
  std::vector<std::uint8_t> cells(static_cast<std::size_t>(side * side), 0);
  Random random(seed, 0);
  for (int row = 0; row < side; row += 2) {
    for (int column = 0; column < side; column += 2) {
      if (random.uniform() < share) {
        cells[static_cast<std::size_t>(row * side + column)] = kCertainlyOccupied;
      }
    }
  }
  return cells;
}

}  // namespace

TEST_CASE("the distance field of scattered obstacles is that of a search through all of them") {
  constexpr int kSide = 64;
  for (const double share : {0.3, 0.05, 0.01, 0.002}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const std::vector<std::uint8_t> cells = scattered(kSide, share, seed);
      const std::vector<double> truth = brute_force(cells, kSide);
      const std::vector<std::uint8_t> found = field_of(cells, kSide, 0.05F, 1.0F);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const double expected = truth[i] * 254.0 / 20.0;
        if (expected < 254.0) {
          REQUIRE(std::fabs(found[i] - expected) <= 0.51);
        } else {
          REQUIRE(found[i] >= 254);
        }
      }
    }
  }
}

TEST_CASE("the distance field does not depend on the slices, and of nothing is beyond everywhere") {
  constexpr std::uint16_t kSide = 48;
  const std::vector<std::uint8_t> cells = scattered(kSide, 0.02, 9);
  CHECK(field_of(cells, kSide, 0.1F, 1.0F, 1) == field_of(cells, kSide, 0.1F, 1.0F, 1000));
  for (const std::uint8_t cell : {std::uint8_t{0}, std::uint8_t{kFrom - 1}, kUnobserved}) {
    const std::vector<std::uint8_t> none(std::size_t{kSide} * kSide, cell);
    CHECK(field_of(none, kSide, 0.1F, 1.0F) == std::vector<std::uint8_t>(none.size(), kFieldBeyond));
  }
}

TEST_CASE("the distance field is taken to the centre of mass of the hits") {
  // A wall along column 20 whose hits are shared with column 21 in the ratio of 3 to 1: it lies a quarter of a cell
  // further on.
  constexpr std::uint16_t kSide = 48;
  std::vector<std::uint8_t> cells(std::size_t{kSide} * kSide, 0);
  for (std::size_t row = 0; row < kSide; ++row) {
    cells[row * kSide + 20] = 180;
    cells[row * kSide + 21] = 60;
  }
  const std::vector<std::uint8_t> found = field_of(cells, kSide, 0.05F, 1.0F);
  for (std::size_t column = 5; column < 36; ++column) {
    const double expected = std::fabs(static_cast<double>(column) - 20.25) * 254.0 / 20.0;
    CHECK(std::fabs(found[24 * kSide + column] - expected) <= 0.51);
  }
}

TEST_CASE("the distance field takes cells of absurd sizes") {
  constexpr std::uint16_t kSide = 32;
  const std::vector<std::uint8_t> full(std::size_t{kSide} * kSide, kCertainlyOccupied);
  for (const float cell_m : {1e-30F, 1e-3F, 1e30F}) {
    CHECK(field_of(full, kSide, cell_m, 1.0F)[16 * kSide + 16] == 0);
  }
}
