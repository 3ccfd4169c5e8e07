#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/grid_image.hpp"
#include "host/grid_registration.hpp"
#include "host/png_image.hpp"
#include "tests/support/submaps.hpp"

using namespace mellin;
using namespace mellin::host;

namespace {

/// A file of the test's own that is removed with it.
class TestFile {
 public:
  TestFile(const std::string& name, const std::string& bytes)
      : path_((std::filesystem::temp_directory_path() / ("mellin-match-test-" + name)).string()) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~TestFile() { std::filesystem::remove(path_); }
  TestFile(const TestFile&) = delete;
  TestFile& operator=(const TestFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

using Cells = std::vector<std::uint8_t>;

/// The part of a submap that was observed, with its lower left corner at (column, row) of the submap.
struct Cropped {
  OccupancyImage image;
  Pose2 submap_T_corner;
};

Cropped crop(const RenderedSubmap& submap, std::size_t margin) {
  std::size_t low_c = submap.side;
  std::size_t low_r = submap.side;
  std::size_t high_c = 0;
  std::size_t high_r = 0;
  for (std::size_t r = 0; r < submap.side; ++r) {
    for (std::size_t c = 0; c < submap.side; ++c) {
      if (submap.cells[r * submap.side + c] != kUnobserved) {
        low_c = std::min(low_c, c);
        high_c = std::max(high_c, c + 1);
        low_r = std::min(low_r, r);
        high_r = std::max(high_r, r + 1);
      }
    }
  }
  low_c -= std::min(low_c, margin);
  Cropped cropped{{high_c - low_c, high_r - low_r, {}}, {}};
  for (std::size_t r = low_r; r < high_r; ++r) {
    for (std::size_t c = low_c; c < high_c; ++c) {
      cropped.image.cells.push_back(submap.cells[r * submap.side + c]);
    }
  }
  const double half = 0.5 * submap.side;
  const auto cell_m = static_cast<double>(submap.cell_m);
  cropped.submap_T_corner = {(static_cast<double>(low_c) - half) * cell_m, (static_cast<double>(low_r) - half) * cell_m,
                             0.0};
  return cropped;
}

/// A hall of 17 m x 11 m with slanted partitions, seen from eight places.
RenderedSubmap other_building() {
  const std::vector<WallSegment> walls = {
      {{-8.5, -5.5}, {8.5, -5.5}}, {{8.5, -5.5}, {8.5, 5.5}}, {{8.5, 5.5}, {-8.5, 5.5}},  {{-8.5, 5.5}, {-8.5, -5.5}},
      {{-6.0, -3.0}, {-3.5, 1.0}}, {{-2.0, 4.0}, {1.5, 2.8}}, {{2.0, -4.5}, {3.0, -1.0}}, {{4.5, 1.0}, {6.5, 3.7}},
      {{-1.0, -2.0}, {0.7, -1.1}}, {{5.0, -3.2}, {7.4, -2.6}}};
  std::vector<PosedScan> scans;
  for (int i = 0; i < 8; ++i) {
    PosedScan scan{{-7.0 + 2.0 * i, i % 2 == 0 ? 0.3 : 1.9, 0.0}, {}, -kPi, kPi / 180.0, 30.0};
    for (int beam = 0; beam < 360; ++beam) {
      scan.ranges_m.push_back(static_cast<float>(
          cast_ray(walls, {scan.world_T_laser.x, scan.world_T_laser.y}, -kPi + beam * kPi / 180.0, 30.0)));
    }
    scans.push_back(scan);
  }
  return render_submap(scans, {}, 768, 0.05F);
}

}  // namespace

TEST_CASE("PGM and PNG grids are read with row 0 at the bottom") {
  // Top row: black, free, unobserved; bottom row: a quarter occupied, white, nearly black.
  const Cells expected = {63, 0, 244, 254, 0, kUnobserved};
  const std::string pixels = {'\0', '\xFE', '\xCD', '\xBF', '\xFF', '\x0A'};
  const TestFile binary("a.pgm", "P5\n# by hand\n3 2\n255\n" + pixels);
  const TestFile text("b.pgm", "P2 3 2 255\n0 254 205 # top\n191 255 10\n");
  Picture picture(3, 2, 1, 0);
  std::copy(pixels.begin(), pixels.end(), picture.pixels.begin());
  const TestFile png("c.png", encode_png(picture));
  const TestFile coloured("d.png", encode_png(to_rgb(picture)));
  for (const TestFile* file : {&binary, &text, &png, &coloured}) {
    const OccupancyImage image = read_occupancy_image(file->path());
    CHECK(image.width == 3);
    CHECK(image.height == 2);
    CHECK(image.cells == expected);
  }
  const TestFile wide("e.pgm", std::string("P5 2 1 65535\n") + std::string({'\0', '\0', '\xFF', '\xFF'}));
  CHECK(read_occupancy_image(wide.path()).cells == Cells{254, 0});
}

TEST_CASE("a mask says what was observed") {
  const TestFile grid("f.pgm", "P2 2 2 255\n0 0\n205 254\n");
  const TestFile mask("g.pgm", "P2 2 2 255\n255 0\n255 255\n");
  OccupancyImage image = read_occupancy_image(grid.path());
  apply_mask(image, mask.path());
  CHECK(image.cells == Cells{49, 0, 254, kUnobserved});
  const TestFile other("h.pgm", "P2 1 2 255\n255 0\n");
  CHECK_THROWS_AS(apply_mask(image, other.path()), std::runtime_error);
}

TEST_CASE("what is no picture is refused with a reason") {
  const std::vector<std::string> contents = {"",
                                             "hello",
                                             "P5",
                                             "P5 3 2",
                                             "P5 3 2 255\nabc",
                                             "P5 0 2 255\n",
                                             "P5 99999 2 255\n",
                                             "P5 2 2 70000\n",
                                             "P2 2 1 100\n1 101\n",
                                             "P2 2 1 100\n1 x\n",
                                             "P2 99999999999999999999 1 1\n",
                                             "\x89PNG\r\n\x1a\n garbage",
                                             encode_png(Picture(64, 64, 1, 7)).substr(0, 60)};
  for (const std::string& content : contents) {
    const TestFile file("bad", content);
    CHECK_THROWS_AS(read_occupancy_image(file.path()), std::runtime_error);
  }
  CHECK_THROWS_AS(read_occupancy_image("/nowhere/at/all.pgm"), std::runtime_error);
}

TEST_CASE("grids of different sizes are registered at their true pose, and foreign ones are not") {
  const std::vector<PosedScan> scans = test::simulated_scans(3);
  REQUIRE(scans.size() > 90);
  for (const double heading : {0.0, 0.7, 2.0, -1.1}) {
    const RenderedSubmap whole_a = test::submap(scans, 10, 40, 1, 0.0);
    const RenderedSubmap whole_b = test::submap(scans, 20, 40, 1, heading);
    const Cropped a = crop(whole_a, 0);
    const Cropped b = crop(whole_b, 37);
    const Pose2 truth =
        between(compose(whole_a.world_T_submap, a.submap_T_corner), compose(whole_b.world_T_submap, b.submap_T_corner));
    const std::vector<GridHypothesis> found = register_grids(a.image, b.image, 0.05);
    REQUIRE(!found.empty());
    CHECK(found.front().confidence >= kAcceptedConfidence);
    const Pose2 error = between(found.front().a_T_b, truth);
    CHECK(translation(error) < 0.1);
    CHECK(std::fabs(error.theta) < 0.01);
  }
  // Another building, and a grid that shows nothing. (Simulated floors of other seeds share the ring and its bends.)
  const Cropped a = crop(test::submap(scans, 10, 40, 1, 0.0), 0);
  const Cropped b = crop(other_building(), 0);
  for (const GridHypothesis& hypothesis : register_grids(a.image, b.image, 0.05)) {
    CHECK(hypothesis.confidence < kAcceptedConfidence);
  }
  const OccupancyImage empty{50, 40, Cells(50 * 40, kUnobserved)};
  CHECK(register_grids(a.image, empty, 0.05).empty());
  CHECK_THROWS_AS(register_grids(a.image, b.image, 0.0), std::invalid_argument);
}
