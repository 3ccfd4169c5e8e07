// mellin match on what people bring: whole maps, pictures that say nothing or too little, pictures that all look alike.
#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/grid_registration.hpp"
#include "tests/support/submaps.hpp"

using namespace mellin;
using namespace mellin::host;

namespace {

/// Part of a rendered grid, its lower left corner at (column, row).
OccupancyImage part(const RenderedSubmap& grid, std::size_t column, std::size_t row, std::size_t width,
                    std::size_t height) {
  OccupancyImage image{width, height, {}};
  for (std::size_t r = row; r < row + height; ++r) {
    const auto* first = grid.cells.data() + r * grid.side + column;
    image.cells.insert(image.cells.end(), first, first + width);
  }
  return image;
}

/// From the lower left corner of such a part to the grid's frame.
Pose2 grid_T_part(const RenderedSubmap& grid, std::size_t column, std::size_t row) {
  const auto cell_m = static_cast<double>(grid.cell_m);
  const double half = 0.5 * grid.side;
  return {(static_cast<double>(column) - half) * cell_m, (static_cast<double>(row) - half) * cell_m, 0.0};
}

/// A grid of that size, all cells with one value.
OccupancyImage flat(std::size_t width, std::size_t height, std::uint8_t cell) {
  return {width, height, std::vector<std::uint8_t>(width * height, cell)};
}

constexpr std::uint8_t kWall = 254;

/// Free space within `reach` cells of the middle, by the distance of `measure`, a wall round it.
template <class Measure>
OccupancyImage closed(std::size_t side, double reach, Measure&& measure) {
  OccupancyImage image = flat(side, side, kUnobserved);
  const double middle = 0.5 * static_cast<double>(side - 1);
  for (std::size_t i = 0; i < image.cells.size(); ++i) {
    const double d = measure(static_cast<double>(i % side) - middle, static_cast<double>(i / side) - middle);
    if (d < reach + 1.0) {
      image.cells[i] = d < reach ? std::uint8_t{0} : kWall;
    }
  }
  return image;
}

OccupancyImage circle(std::size_t side, double reach) {
  return closed(side, reach, [](double x, double y) { return std::sqrt(x * x + y * y); });
}

OccupancyImage square_room(std::size_t side, double reach) {
  return closed(side, reach, [](double x, double y) { return std::max(std::fabs(x), std::fabs(y)); });
}

/// A wall from border to border, free on one side of it.
OccupancyImage straight_wall(std::size_t side) {
  OccupancyImage image = flat(side, side, kUnobserved);
  for (std::size_t i = 0; i < image.cells.size(); ++i) {
    const std::size_t row = i / side;
    if (row <= side / 2 && row + side / 4 >= side / 2) {
      image.cells[i] = row == side / 2 ? kWall : std::uint8_t{0};
    }
  }
  return image;
}

/// Finite, confidences from 0 to 1 and in order.
void check_sound(const std::vector<GridHypothesis>& found) {
  double last = 1.0;
  for (const GridHypothesis& h : found) {
    CHECK(std::isfinite(h.a_T_b.x));
    CHECK(std::isfinite(h.a_T_b.y));
    CHECK(std::isfinite(h.a_T_b.theta));
    CHECK(std::isfinite(h.peak));
    CHECK(h.agreement >= 0.0);
    CHECK(h.agreement <= 1.0);
    CHECK(h.confidence >= 0.0);
    CHECK(h.confidence <= last);
    last = h.confidence;
  }
}

}  // namespace

TEST_CASE("a submap is found in the map of the whole building") {
  const std::vector<PosedScan> scans = test::simulated_scans(3);
  constexpr std::uint16_t kMapSide = 2048;
  const RenderedSubmap map = render_submap(scans, centred_frame(scans, 0.0), kMapSide, 0.05F);
  const OccupancyImage a = part(map, 24, 274, 2000, 1500);
  for (const std::size_t first : {10U, 70U, 130U, 200U}) {
    for (const double heading : {0.0, 0.7, 2.5}) {
      CAPTURE(first);
      CAPTURE(heading);
      const RenderedSubmap submap = test::submap(scans, first, 40, 1, heading);
      const OccupancyImage b = part(submap, 100, 50, 600, 700);
      const Pose2 truth = between(compose(map.world_T_submap, grid_T_part(map, 24, 274)),
                                  compose(submap.world_T_submap, grid_T_part(submap, 100, 50)));
      const std::vector<GridHypothesis> found = register_grids(a, b, 0.05);
      check_sound(found);
      REQUIRE(!found.empty());
      CHECK(found[0].confidence >= kAcceptedConfidence);
      const Pose2 error = between(found[0].a_T_b, truth);
      CHECK(translation(error) < 0.15);
      CHECK(std::fabs(error.theta) < 0.01);
      // And the map in the submap.
      const std::vector<GridHypothesis> back = register_grids(b, a, 0.05);
      REQUIRE(!back.empty());
      CHECK(translation(between(inverse(back[0].a_T_b), truth)) < 0.15);
    }
  }
}

TEST_CASE("pictures without structure match nothing, not even themselves") {
  const std::vector<OccupancyImage> blank = {flat(300, 200, 0),     flat(300, 200, kUnobserved),
                                             flat(300, 200, kWall), flat(1, 1, kWall),
                                             flat(1, 1, 0),         flat(700, 3, 0)};
  OccupancyImage single = flat(300, 300, 0);
  single.cells[150 * 300 + 150] = kWall;
  const OccupancyImage room = square_room(300, 100.0);
  for (const OccupancyImage& b : blank) {
    for (const OccupancyImage* a : std::initializer_list<const OccupancyImage*>{&b, &single, &room}) {
      for (const auto& found : {register_grids(*a, b, 0.05), register_grids(b, *a, 0.05)}) {
        check_sound(found);
        CHECK((found.empty() || found[0].confidence < kAcceptedConfidence));
      }
    }
  }
}

TEST_CASE("pictures that look alike when turned or moved are not told for sure") {
  OccupancyImage single = flat(300, 300, 0);
  single.cells[150 * 300 + 150] = kWall;
  const OccupancyImage round = circle(300, 100.0);
  const OccupancyImage room = square_room(300, 100.0);
  // Of the wall B saw another length: it may lie anywhere along it.
  const std::vector<OccupancyImage> shapes_a = {single, straight_wall(300), round, room};
  const std::vector<OccupancyImage> shapes_b = {single, straight_wall(220), round, room};
  for (std::size_t i = 0; i < shapes_a.size(); ++i) {
    for (std::size_t k = 0; k < shapes_b.size(); ++k) {
      CAPTURE(i);
      CAPTURE(k);
      const std::vector<GridHypothesis> found = register_grids(shapes_a[i], shapes_b[k], 0.05);
      check_sound(found);
      CHECK((found.empty() || found[0].confidence < kAcceptedConfidence));
    }
  }
  // A square room fits in four ways, all of them found and equally likely.
  const std::vector<GridHypothesis> found = register_grids(room, room, 0.05);
  REQUIRE(found.size() >= 4);
  CHECK(found[3].confidence == doctest::Approx(found[0].confidence).epsilon(0.05));
}

TEST_CASE("resolutions from the finest to the coarsest are taken") {
  const OccupancyImage a = circle(300, 90.0);
  const OccupancyImage b = square_room(260, 80.0);
  for (const double resolution_m : {1e-4, 1e-3, 0.02, 0.1, 0.5, 10.0, 100.0}) {
    CAPTURE(resolution_m);
    check_sound(register_grids(a, b, resolution_m));
  }
}
