#include <doctest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "mellin/core/random.hpp"
#include "mellin/grid/counting_grid.hpp"
#include "mellin/mapping/live_grid.hpp"
#include "mellin/mapping/scan_memory.hpp"
#include "tests/support/cell_map.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;

namespace {

std::vector<std::pair<int, int>> cells_of(const Ray& ray, const CellRect& rect) {
  std::vector<std::pair<int, int>> cells;
  visit_ray(ray, rect, [&](std::int32_t c, std::int32_t r, bool) { cells.emplace_back(c, r); });
  return cells;
}

constexpr CellRect kEverywhere{-100000, -100000, 100000, 100000};

int random_int(Random& random, int low, int high) {
  return low + static_cast<int>(random.uniform() * (high - low + 1));
}

/// A scanner over a full circle in a world without shape: what counts here is only that ranges differ.
struct World {
  static constexpr std::uint16_t kBeams = 24;
  static constexpr std::uint16_t kScans = 9;
  static constexpr float kCell = 0.1F;
  LaserConfig lasers[kMaxLasers];
  std::vector<StoredRange> ranges = std::vector<StoredRange>((kScans + 1) * kBeams);
  std::vector<std::int64_t> stamps = std::vector<std::int64_t>(kScans + 1);
  std::vector<std::uint8_t> which = std::vector<std::uint8_t>(kScans + 1);
  std::vector<Point2f> directions = std::vector<Point2f>(kMaxLasers * kBeams);
  ScanMemory scans;

  World() {
    lasers[0].beams = kBeams;
    lasers[0].angle_increment_rad = 0.2617994F;
    lasers[0].max_range_m = 12.0F;
    lasers[0].base_T_laser = {0.23, -0.07, 0.4};
    scans = ScanMemory({kScans, kBeams},
                       {{ranges.data(), ranges.size()},
                        {stamps.data(), stamps.size()},
                        {which.data(), which.size()},
                        {directions.data(), directions.size()}},
                       Span<const LaserConfig>(lasers, kMaxLasers));
  }
  std::uint32_t push(Random& random) {
    std::vector<float> r(kBeams);
    for (float& range : r) {
      range = random.uniform() < 0.1 ? NAN : static_cast<float>(random.uniform() * 13.0);
    }
    scans.stage({0, Span<const float>(r.data(), r.size()), {}, 0});
    return scans.take_staged();
  }
};

struct Remembered {
  std::uint32_t number;
  Pose2 pose;
  CellRect rect;
};

/// What the beams of one scan count: every beam walked cell by cell with its own clipping, into an array.
test::CellMap counts_of(const World& world, const Remembered& scan) {
  test::CellMap counts(scan.rect);
  world.scans.visit_rays(scan.number, grid_pose(scan.pose, World::kCell), World::kCell, [&](const Ray& ray) {
    visit_ray(ray, kEverywhere, [&](std::int32_t c, std::int32_t row, bool hit) { counts.count(c, row, hit); });
  });
  return counts;
}

}  // namespace

TEST_CASE("a ray meets one cell a step along its longer axis, joined, and ends where it should") {
  Random random(3, 1);
  for (int i = 0; i < 2000; ++i) {
    const Ray ray{random_int(random, -40, 40), random_int(random, -40, 40), random_int(random, -40, 40),
                  random_int(random, -40, 40), true};
    const auto cells = cells_of(ray, kEverywhere);
    const int major = std::max(std::abs(ray.column_to - ray.column_from), std::abs(ray.row_to - ray.row_from));
    REQUIRE(static_cast<int>(cells.size()) == major + 1);
    CHECK(cells.front() == std::pair<int, int>(ray.column_from, ray.row_from));
    CHECK(cells.back() == std::pair<int, int>(ray.column_to, ray.row_to));
    for (std::size_t k = 1; k < cells.size(); ++k) {
      CHECK(std::abs(cells[k].first - cells[k - 1].first) <= 1);
      CHECK(std::abs(cells[k].second - cells[k - 1].second) <= 1);
    }
    // Never farther than half a cell from the straight line.
    const double dx = ray.column_to - ray.column_from, dy = ray.row_to - ray.row_from, length = std::hypot(dx, dy);
    for (const auto& [c, r] : cells) {
      if (length > 0) {
        CHECK(std::fabs((c - ray.column_from) * dy - (r - ray.row_from) * dx) / length <= 0.5 + 1e-9);
      }
    }
  }
}

TEST_CASE("a clipped ray meets exactly those cells of the whole ray that lie in the rectangle") {
  Random random(4, 1);
  for (int i = 0; i < 5000; ++i) {
    const Ray ray{random_int(random, -40, 40), random_int(random, -40, 40), random_int(random, -40, 40),
                  random_int(random, -40, 40), true};
    const int c = random_int(random, -50, 40), r = random_int(random, -50, 40);
    const CellRect rect{c, r, c + random_int(random, 0, 40), r + random_int(random, 0, 40)};
    std::vector<std::pair<int, int>> expected;
    for (const auto& cell : cells_of(ray, kEverywhere)) {
      if (rect.contains(cell.first, cell.second)) {
        expected.push_back(cell);
      }
    }
    REQUIRE(cells_of(ray, rect) == expected);
  }
}

TEST_CASE("the byte of a submap cell") {
  CHECK(submap_cell({0, 0}) == 255);
  CHECK(submap_cell({5, 0}) == 0);
  CHECK(submap_cell({5, 5}) == 254);
  CHECK(submap_cell({2, 1}) == 127);
  CHECK(submap_cell({3, 1}) == 85);  // 84.67
  CHECK(submap_cell({65535, 65535}) == 254);
}

void live_grid_equals_rebuilt_one(bool once) {
  constexpr std::uint16_t kSide = 64;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(test::trials(12)); ++seed) {
    Random random(seed, 5);
    World world;
    MeasureArena measured;
    (void)LiveGrid::carve(measured, kSide, 1, once);
    std::vector<std::uint64_t> words(measured.use().total() / 8);
    Arena arena({reinterpret_cast<std::byte*>(words.data()), words.size() * 8});
    LiveGrid live(LiveGrid::carve(arena, kSide, 1, once), 0, kSide, World::kCell);
    // Far from the origin on odd seeds: the robot may have driven kilometres.
    Pose2 robot{seed % 2 == 0 ? 0.0 : 2000.0, seed % 2 == 0 ? 0.0 : -1500.0, 0.0};
    live.reset(robot);
    std::vector<Remembered> memory;
    for (int step = 0; step < 20 + test::trials(100); ++step) {
      robot = {robot.x + 0.4 * random.normal(), robot.y + 0.4 * random.normal(), 3.0 * random.normal()};
      const double what = random.uniform();
      if (what < 0.5) {
        if (memory.size() == World::kScans) {
          live.remove(world.scans, memory.front().number, memory.front().pose, memory.front().rect);
          memory.erase(memory.begin());
        }
        memory.push_back({world.push(random), robot, live.grid().window()});
        live.add(world.scans, memory.back().number, robot, memory.back().rect);
      } else if (what < 0.7 && !memory.empty()) {
        live.remove(world.scans, memory.front().number, memory.front().pose, memory.front().rect);
        memory.erase(memory.begin());
      } else {
        live.roll_to(random.uniform() < 0.03 ? Pose2{robot.x + 50.0, robot.y, 0.0} : robot);
        for (Remembered& r : memory) {
          r.rect = intersection(r.rect, live.grid().window());
        }
      }
      test::CellMap expected(live.grid().window());
      for (const Remembered& r : memory) {
        expected.add(counts_of(world, r), once);
      }
      const CellRect w = live.grid().window();
      int wrong_counts = 0, wrong_field = 0;
      for (int row = w.row_min; row < w.row_end; ++row) {
        for (int c = w.column_min; c < w.column_end; ++c) {
          const CellCount want = expected.at(c, row);
          const CellCount have = live.grid().at(c, row);
          wrong_counts += want.observations != have.observations || want.hits != have.hits ? 1 : 0;
          int nearest = 0;
          for (int dy = -2; dy <= 2; ++dy) {
            for (int dx = -2; dx <= 2; ++dx) {
              if (w.contains(c + dx, row + dy)) {
                nearest = std::max<int>(nearest, field_value(solidity(expected.at(c + dx, row + dy)), dx, dy));
              }
            }
          }
          wrong_field += nearest != live.field(c, row) ? 1 : 0;
        }
      }
      REQUIRE(wrong_counts == 0);
      REQUIRE(wrong_field == 0);
    }
  }
}

TEST_CASE("any sequence of adds, rolls and removals equals the grid rebuilt from the remembered scans") {
  live_grid_equals_rebuilt_one(false);
}

TEST_CASE("and so it is where a scan counts a cell once") { live_grid_equals_rebuilt_one(true); }

TEST_CASE("the field falls off with the distance from a solid cell") {
  CHECK(field_value(15, 0, 0) == 255);
  for (int d = 0; d <= 2; ++d) {
    for (int e = 0; e <= 2; ++e) {
      const double expected = 255.0 * std::exp(-(d * d + e * e) / (2 * 1.5 * 1.5));
      CHECK(static_cast<double>(field_value(15, d, -e)) == doctest::Approx(expected).epsilon(0.01));
    }
  }
  CHECK(solidity({10, 0}) == 0);
  CHECK(solidity({10, 5}) == 15);
  CHECK(solidity({12, 3}) == 7);  // a quarter of the beams: half of the steps
  // Hit once or twice: 9 or 13 of the steps at most.
  CHECK(solidity({1, 1}) == 9);
  CHECK(solidity({2, 2}) == 13);
  CHECK(solidity({3, 3}) == 15);
  CHECK(solidity({10, 1}) == 1);
}

TEST_CASE("stored ranges: what is no measurement is 0, the rest is good to a millimetre") {
  LaserConfig laser;
  laser.min_range_m = 0.1F;
  laser.max_range_m = 80.0F;
  for (const float bad : {NAN, INFINITY, -INFINITY, -1.0F, 0.0F, 0.09F, 80.0F, 1e30F}) {
    CHECK(store_range(bad, laser) == 0);
  }
  for (float range = 0.1F; range < 79.9F; range += 0.0137F) {
    CHECK(std::fabs(static_cast<float>(store_range(range, laser)) * kRangeStep_m - range) < 1.01e-3F);
  }
}
