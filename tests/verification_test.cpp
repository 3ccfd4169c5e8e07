#include "mellin/spectral/verification.hpp"

#include <doctest.h>

#include <initializer_list>
#include <limits>
#include <vector>

#include "mellin/grid/digest.hpp"

using namespace mellin;

namespace {

constexpr std::uint16_t kSide = 32;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint8_t kWall = kCertainlyOccupied;

/// A grid of 0.2 m cells, all free.
struct TestGrid {
  std::vector<std::uint8_t> cells = std::vector<std::uint8_t>(kSide * kSide, 0);
  void set(int column, int row, std::uint8_t value) {
    cells[static_cast<std::size_t>(row) * kSide + static_cast<std::size_t>(column)] = value;
  }
  GridView view() const { return {{cells.data(), cells.size()}, kSide, 0.2F}; }
};

/// Class grid that owns its memory.
struct Classes {
  explicit Classes(const GridView& grid, std::uint16_t side = kSide, const VerificationConfig& config = {})
      : memory(static_cast<std::size_t>(side) * side) {
    const Result<ClassView> result = classify(grid, config, side, {memory.data(), memory.size()});
    REQUIRE(result.ok());
    view = result.value();
  }
  std::size_t count(std::uint8_t bit) const {
    std::size_t n = 0;
    for (const std::uint8_t cell : memory) {
      n += (cell & bit) != 0 ? 1U : 0U;
    }
    return n;
  }
  std::vector<std::uint8_t> memory;
  ClassView view;
};

/// A wall along column `column`, rows 10 … 19.
TestGrid wall(int column) {
  TestGrid grid;
  for (int row = 10; row < 20; ++row) {
    grid.set(column, row, kWall);
  }
  return grid;
}

Agreement agreement(const Classes& a, const Classes& b, const Pose2& a_T_b) {
  const Result<Agreement> result = verify(a.view, b.view, a_T_b);
  REQUIRE(result.ok());
  return result.value();
}

}  // namespace

TEST_CASE("an obstacle is near its neighbours and the free space beyond is clear") {
  TestGrid grid;
  grid.set(5, 7, kWall);
  grid.set(20, 20, kUnobserved);
  const Classes classes(grid.view());
  CHECK(classes.count(kClassOccupied) == 1);
  CHECK(classes.count(kClassNear) == 9);
  CHECK(classes.count(kClassClear) == kSide * kSide - 9 - 1);
  CHECK(classes.count(kClassObserved) == kSide * kSide - 1);
}

TEST_CASE("blocks take the class of their obstacles") {
  TestGrid grid;
  grid.set(4, 6, kWall);
  grid.set(8, 8, kUnobserved);  // three of its block's four cells stay observed: still free
  for (int i = 0; i < 3; ++i) {
    grid.set(20 + i % 2, 20 + i / 2, kUnobserved);  // one of four is left: neither free nor an obstacle
  }
  const Classes classes(grid.view(), 16);
  CHECK(classes.view.cell_m == doctest::Approx(0.4));
  CHECK((classes.memory[3 * 16 + 2] & kClassOccupied) != 0);
  CHECK((classes.memory[4 * 16 + 4] & kClassClear) != 0);
  CHECK(classes.memory[10 * 16 + 10] == kClassObserved);
}

TEST_CASE("a submap agrees with itself as far as its walls reach") {
  const Classes a(wall(12).view());
  const Agreement same = agreement(a, a, {});
  CHECK(same.hits_b_on_a == 10);
  CHECK(same.hits_a_on_b == 10);
  CHECK(same.conflicts_b_on_a == 0);
  CHECK(same.shared_cells == kSide * kSide);
  CHECK(same.overlap == doctest::Approx(1.0));
  CHECK(same.union_overlap == doctest::Approx(1.0));
  CHECK(same.score == doctest::Approx(10 * 0.2 / (10 * 0.2 + static_cast<double>(VerificationConfig{}.doubt_m))));
}

TEST_CASE("walls in the other's free space are conflicts, and a shift by one cell is not") {
  const Classes a(wall(12).view());
  const Classes b(wall(15).view());
  const Agreement apart = agreement(a, b, {});
  CHECK(apart.hits_b_on_a == 0);
  CHECK(apart.conflicts_b_on_a == 10);
  CHECK(apart.conflicts_a_on_b == 10);
  CHECK(apart.score == 0.0F);
  const Agreement moved = agreement(a, b, {-0.6, 0.0, 0.0});  // b's frame lies three cells to the left of a's
  CHECK(moved.hits_b_on_a == 10);
  CHECK(moved.conflicts_b_on_a == 0);
  CHECK(agreement(a, b, {-0.4, 0.0, 0.0}).hits_b_on_a == 10);
  CHECK(agreement(a, b, {-0.8, 0.0, 0.0}).conflicts_b_on_a == 0);
}

TEST_CASE("poses turn about the grid's centre") {
  // The wall at x = 12 … seen by a submap whose frame is turned by 90 degrees lies along a row: (x, y) -> (y, -x).
  TestGrid turned;
  for (int i = 10; i < 20; ++i) {
    turned.set(i, kSide - 1 - 12, kWall);
  }
  const Agreement right = agreement(Classes(wall(12).view()), Classes(turned.view()), {0.0, 0.0, kHalfPi});
  CHECK(right.hits_b_on_a == 10);
  CHECK(right.hits_a_on_b == 10);
  const Agreement wrong = agreement(Classes(wall(12).view()), Classes(turned.view()), {0.0, 0.0, -kHalfPi});
  CHECK(wrong.hits_b_on_a == 0);
}

TEST_CASE("obstacles alone give the hits, conflicts and score of all cells, also across the border") {
  TestGrid grid_a = wall(8);
  TestGrid grid_b = wall(20);
  for (int i = 0; i < kSide; ++i) {
    grid_a.set(i, (5 * i + i * i / 3) % kSide, kWall);
    grid_b.set((7 * i + 3) % kSide, i, kWall);
  }
  for (const std::uint8_t reach : std::initializer_list<std::uint8_t>{0, 1}) {
    const VerificationConfig config = {127, reach, reach, 2.0F};
    const Classes a(grid_a.view(), kSide, config);
    const Classes b(grid_b.view(), kSide / 2, config);
    std::vector<ClassCell> memory_a(a.memory.size());
    std::vector<ClassCell> memory_b(b.memory.size());
    const auto cells_a = obstacles(a.view, {memory_a.data(), memory_a.size()});
    const auto cells_b = obstacles(b.view, {memory_b.data(), memory_b.size()});
    REQUIRE(cells_a.ok());
    REQUIRE(cells_b.ok());
    CHECK(cells_a.value().size() == a.count(kClassOccupied));
    for (int i = 0; i < 40; ++i) {
      const Pose2 a_T_b{0.21 * i - 4.0, 3.0 - 0.17 * i, 0.37 * i};
      const Agreement all = verify(a.view, b.view, a_T_b, config).value();
      const Agreement quick =
          verify_obstacles({a.view, cells_a.value()}, {b.view, cells_b.value()}, a_T_b, config).value();
      CHECK(quick.score == all.score);
      CHECK(quick.hits_b_on_a == all.hits_b_on_a);
      CHECK(quick.conflicts_b_on_a == all.conflicts_b_on_a);
      CHECK(quick.hits_a_on_b == all.hits_a_on_b);
      CHECK(quick.conflicts_a_on_b == all.conflicts_a_on_b);
      CHECK((i != 10 || all.hits_b_on_a + all.hits_a_on_b > 0));
    }
    CHECK(obstacles(a.view, {memory_a.data(), 5}).status() == Status::invalid_argument);
  }
}

TEST_CASE("what was not observed says nothing") {
  TestGrid blind;
  for (std::uint8_t& cell : blind.cells) {
    cell = kUnobserved;
  }
  const Agreement nothing = agreement(Classes(blind.view()), Classes(wall(12).view()), {});
  CHECK(nothing.hits_b_on_a + nothing.conflicts_b_on_a == 0);
  CHECK(nothing.overlap == 0.0F);
  CHECK(nothing.score == 0.0F);
  // Shifted by half the grid, the observed areas share half of it.
  const Classes a(wall(12).view());
  const Agreement half = agreement(a, a, {3.2, 0.0, 0.0});
  CHECK(half.overlap == doctest::Approx(0.5));
  CHECK(half.union_overlap == doctest::Approx(1.0 / 3.0));
}

TEST_CASE("a digest gives the classes of its masks") {
  const TestGrid grid = wall(12);
  std::vector<std::uint8_t> obstacles(16 * 16);
  std::vector<std::uint8_t> observed(mask_bytes(16));
  std::vector<std::uint8_t> free(mask_bytes(16));
  DigestOut out{
      {obstacles.data(), obstacles.size()}, {observed.data(), observed.size()}, {free.data(), free.size()}, 16};
  std::vector<float> scratch(DigestMaker::scratch_size(kSide, 16));
  REQUIRE(make_digest(grid.view(), {scratch.data(), scratch.size()}, out) == Status::ok);
  std::vector<std::uint8_t> memory(16 * 16);
  const VerificationConfig config;
  const Result<ClassView> digest = classify(out.view(0.4F), config, {memory.data(), memory.size()});
  REQUIRE(digest.ok());
  CHECK(memory == Classes(grid.view(), 16).memory);
  DigestView blind = out.view(0.4F);
  blind.free = {};
  CHECK(classify(blind, config, {memory.data(), memory.size()}).status() == Status::invalid_argument);
}

TEST_CASE("verification refuses what is not a grid, a pose or a configuration") {
  const TestGrid grid;
  std::vector<std::uint8_t> memory(kSide * kSide);
  const Span<std::uint8_t> out(memory.data(), memory.size());
  CHECK(classify(grid.view(), {}, 12, out).status() == Status::invalid_argument);
  CHECK(classify(grid.view(), {}, 0, out).status() == Status::invalid_argument);
  CHECK(classify(grid.view(), {}, kSide, out.first(10)).status() == Status::invalid_argument);
  GridView bad = grid.view();
  bad.cell_m = std::numeric_limits<float>::quiet_NaN();
  CHECK(classify(bad, {}, kSide, out).status() == Status::invalid_argument);
  VerificationConfig config;
  config.clear_cells = 0;
  CHECK(classify(grid.view(), config, kSide, out).status() == Status::invalid_config);
  const Classes a(grid.view());
  CHECK(verify(a.view, a.view, {kNan, 0.0, 0.0}).status() == Status::invalid_argument);
  CHECK(verify(a.view, {}, {}).status() == Status::invalid_argument);
  CHECK(agreement(a, a, {1e30, -1e30, 1.0}).shared_cells == 0);
}
