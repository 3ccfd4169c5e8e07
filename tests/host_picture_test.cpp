#include <doctest.h>
#include <png.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/file.hpp"
#include "host/map_picture.hpp"
#include "host/png_image.hpp"
#include "tests/host_support.hpp"

using namespace mellin;
using namespace mellin::host;
using mellin::test::read_bytes;
using mellin::test::TemporaryFolder;

namespace {

/// Decoded by libpng: an independent reader of what encode_png wrote.
Picture decode(const std::string& bytes, std::size_t channels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) != 0);
  CHECK((image.format & PNG_FORMAT_FLAG_COLOR) == (channels == 3 ? PNG_FORMAT_FLAG_COLOR : 0U));
  image.format = channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
  Picture picture(image.width, image.height, channels, 0);
  REQUIRE(png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr) != 0);
  return picture;
}

constexpr float kCell = 0.05F;

/// A grid drawn as text, the top line first: '.' free, '#' occupied, ' ' unobserved.
struct Drawn {
  std::vector<std::uint8_t> cells;
  std::uint16_t side;
  float cell_m;

  explicit Drawn(const std::vector<std::string>& lines, float cell = kCell)
      : side(static_cast<std::uint16_t>(lines.size())), cell_m(cell) {
    for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
      for (const char c : *line) {
        cells.push_back(c == '#' ? kCertainlyOccupied : c == '.' ? 0 : kUnobserved);
      }
    }
  }
  GridView view() const { return {{cells.data(), cells.size()}, side, cell_m}; }
};

std::vector<std::string> text_of(const MapImage& map) {
  std::vector<std::string> lines(map.grey.height);
  for (std::size_t y = 0; y < map.grey.height; ++y) {
    for (std::size_t x = 0; x < map.grey.width; ++x) {
      const std::uint8_t grey = *map.grey.at(x, y);
      lines[y] += grey == kMapUnobserved ? ' ' : grey < 90 ? '#' : grey > 204 ? '.' : '?';
    }
  }
  return lines;
}

MapImage map_of(const std::vector<std::pair<const Drawn*, Pose2>>& submaps, double cell_m = 0.05,
                double margin_m = 0.0) {
  MapBounds bounds;
  for (const auto& [grid, pose] : submaps) {
    bounds.include_submap(grid->side * static_cast<double>(grid->cell_m), pose);
  }
  MapPictureOptions options;
  options.cell_m = cell_m;
  options.margin_m = margin_m;
  MapPicture picture(bounds, options);
  for (const auto& [grid, pose] : submaps) {
    picture.add(grid->view(), pose);
  }
  return picture.finish();
}

using Lines = std::vector<std::string>;

}  // namespace

TEST_CASE("a picture comes back from its PNG") {
  Picture grey(5, 3, 1, 7);
  *grey.at(4, 2) = 200;
  *grey.at(0, 1) = 3;
  CHECK(decode(encode_png(grey), 1).pixels == grey.pixels);
  Picture rgb = to_rgb(grey);
  draw_disc(rgb, 1.5, 0.5, 0.1, {10, 20, 30});
  const Picture back = decode(encode_png(rgb), 3);
  CHECK(back.pixels == rgb.pixels);
  CHECK(back.at(1, 0)[2] == 30);
  CHECK(back.at(4, 2)[0] == 200);
  CHECK_THROWS_AS((void)encode_png(Picture{}), std::runtime_error);
  CHECK_THROWS_AS(Picture(1, 1, 2, 0), std::invalid_argument);
}

TEST_CASE("a PGM is its header and its rows") {
  Picture grey(2, 2, 1, 9);
  *grey.at(1, 0) = 65;
  const std::string expected = "P5\n2 2\n255\n\tA\t\t";
  CHECK(encode_pgm(grey) == expected);
  CHECK_THROWS_AS((void)encode_pgm(to_rgb(grey)), std::invalid_argument);
}

TEST_CASE("base64: the vectors of RFC 4648") {
  CHECK(encode_base64("").empty());
  CHECK(encode_base64("f") == "Zg==");
  CHECK(encode_base64("fo") == "Zm8=");
  CHECK(encode_base64("foo") == "Zm9v");
  CHECK(encode_base64("foobar") == "Zm9vYmFy");
  CHECK(encode_base64("\xff\xfe") == "//4=");
}

TEST_CASE("lines are drawn from end to end and clipped at the border") {
  Picture picture(10, 10, 3, 0);
  draw_line(picture, 1.5, 2.5, 8.5, 2.5, {255, 0, 0});
  for (std::size_t x = 0; x < 10; ++x) {
    CHECK(*picture.at(x, 2) == (x >= 1 && x <= 8 ? 255 : 0));
  }
  draw_line(picture, -50.0, -50.0, 50.0, 50.0, {0, 255, 0});
  for (std::size_t i = 0; i < 10; ++i) {
    CHECK(picture.at(i, i)[1] == 255);
  }
  const std::vector<std::uint8_t> before = picture.pixels;
  draw_line(picture, NAN, 0.0, 5.0, 5.0, {1, 2, 3});
  draw_line(picture, 1e9, 0.0, 5.0, 5.0, {1, 2, 3});
  draw_disc(picture, 100.0, 100.0, 3.0, {1, 2, 3});
  draw_disc(picture, -100.0, -100.0, 3.0, {1, 2, 3});
  CHECK(picture.pixels == before);
}

TEST_CASE("a submap at the origin is its own picture, y up, and says where it lies") {
  const Drawn grid({"#.  ",  //
                    ".#..",  //
                    "  ..",  //
                    "  .#"});
  const MapImage map = map_of({{&grid, {}}});
  CHECK(text_of(map) == Lines{"#.  ", ".#..", "  ..", "  .#"});
  CHECK(map.origin_x == doctest::Approx(-0.1));
  CHECK(map.origin_y == doctest::Approx(-0.1));
  CHECK(map.pixel_x(-0.1) == doctest::Approx(0.0));
  CHECK(map.pixel_y(-0.1) == doctest::Approx(4.0));
  CHECK(map.pixel_y(0.1) == doctest::Approx(0.0));
}

TEST_CASE("what was not observed is cut off, a margin stays") {
  const Drawn grid({"    ",  //
                    " #. ",  //
                    "    ",  //
                    "    "});
  const MapImage map = map_of({{&grid, {}}}, 0.05, 0.05);
  CHECK(text_of(map) == Lines{"    ", " #. ", "    "});
  CHECK(map.origin_x == doctest::Approx(-0.1));
  CHECK(map.origin_y == doctest::Approx(-0.05));
  const Drawn nothing({"  ", "  "});
  CHECK(text_of(map_of({{&nothing, {}}})) == Lines{" "});
}

TEST_CASE("a submap turned by a right angle and moved") {
  const Drawn grid({"##..",  //
                    "....",  //
                    "....",  //
                    "...."});
  // Turned left by 90 degrees the top left corner comes to the bottom left.
  const MapImage map = map_of({{&grid, {10.0, 5.0, kHalfPi}}});
  CHECK(text_of(map) == Lines{"....", "....", "#...", "#..."});
  CHECK(map.origin_x == doctest::Approx(9.9));
  CHECK(map.origin_y == doctest::Approx(4.9));
}

TEST_CASE("submaps add up: the majority wins, the unobserved says nothing") {
  const Drawn wall({"#.", "# "});
  const Drawn free({"..", " #"});
  CHECK(text_of(map_of({{&wall, {}}, {&wall, {}}, {&free, {}}})) == Lines{"#.", "##"});
  CHECK(text_of(map_of({{&free, {}}, {&free, {}}, {&free, {}}, {&free, {}}, {&wall, {}}})) == Lines{"..", "##"});
}

TEST_CASE("coarse and fine submaps fill the map's cells") {
  const Drawn coarse({"#.", ".#"}, 0.1F);
  CHECK(text_of(map_of({{&coarse, {}}})) == Lines{"##..", "##..", "..##", "..##"});
  const Drawn fine({"##..", "##..", "    ", "    "}, 0.025F);
  CHECK(text_of(map_of({{&fine, {}}})) == Lines{"#."});
}

TEST_CASE("no evidence has the grey of the unobserved, and more hits are darker") {
  std::vector<std::uint8_t> cells(256 * 256, kUnobserved);
  for (std::size_t value = 0; value <= kCertainlyOccupied; ++value) {
    cells[value] = static_cast<std::uint8_t>(value);
  }
  MapBounds bounds;
  bounds.include_submap(12.8, {});
  MapPictureOptions options;
  options.margin_m = 0.0;
  MapPicture picture(bounds, options);
  picture.add({{cells.data(), cells.size()}, 256, 0.05F}, {});
  const MapImage map = picture.finish();
  REQUIRE(map.grey.width == 255);
  REQUIRE(map.grey.height == 1);
  for (std::size_t value = 0; value < 255; ++value) {
    CHECK(*map.grey.at(value, 0) != kMapUnobserved);
    CHECK((value == 0 || *map.grey.at(value, 0) <= *map.grey.at(value - 1, 0)));
  }
  CHECK(*map.grey.at(0, 0) > 205);
  CHECK(*map.grey.at(254, 0) < 50);
}

TEST_CASE("what is no map is refused") {
  CHECK_THROWS_AS(MapPicture(MapBounds{}), std::invalid_argument);
  CHECK_THROWS_AS(MapPicture(MapBounds{0, 0, 1e9, 1e9}), std::invalid_argument);
  CHECK_THROWS_AS(MapPicture(MapBounds{0, 0, std::numeric_limits<double>::infinity(), 1}), std::invalid_argument);
  CHECK_THROWS_AS(MapPicture(MapBounds{0, 0, NAN, 1}), std::invalid_argument);
  MapPicture picture(MapBounds{0, 0, 1, 1});
  const Drawn grid({"#.", ".#"});
  CHECK_THROWS_AS(picture.add(grid.view(), {NAN, 0, 0}), std::invalid_argument);
  GridView wrong = grid.view();
  wrong.side = 4;
  CHECK_THROWS_AS(picture.add(wrong, {}), std::invalid_argument);
  picture.add(grid.view(), {1e6, 1e6, 0.3});  // far outside: nothing happens
  CHECK(text_of(picture.finish()) == std::vector<std::string>{std::string(1, ' ')});
}

TEST_CASE("the map's files") {
  const TemporaryFolder folder;
  const Drawn grid({"#.", ".#"});
  const MapImage map = map_of({{&grid, {1.0, 2.0, 0.0}}});
  write_map(map, folder.path(), "map-1");
  CHECK(read_bytes(folder.path() + "/map-1.pgm") == encode_pgm(map.grey));
  CHECK(decode(read_bytes(folder.path() + "/map-1.png"), 1).pixels == map.grey.pixels);
  CHECK(read_bytes(folder.path() + "/map-1.yaml") ==
        "image: map-1.pgm\nresolution: 0.05\norigin: [0.950000, 1.950000, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n");
}

TEST_CASE("the overlay draws the graph where the map says") {
  const Drawn grid(std::vector<std::string>(40, std::string(40, '.')));
  const MapImage map = map_of({{&grid, {}}});
  const std::vector<std::vector<Pose2>> trajectories{{{-0.9, -0.9, 0}, {0.9, -0.9, 0}}};
  const std::vector<MapEdge> edges{{{-0.9, 0.9, 0}, {0.9, 0.9, 0}, EdgeKind::loop}};
  const Picture picture = draw_overlay(map, trajectories, edges);
  const std::uint8_t* driven = picture.at(20, 38);
  CHECK(driven[2] > driven[0] + 50);
  const std::uint8_t* loop = picture.at(20, 2);
  CHECK(loop[1] > loop[0] + 50);
  CHECK(picture.at(20, 20)[0] == *map.grey.at(20, 20));
}

TEST_CASE("a file is written whole or stays as it was") {
  const TemporaryFolder folder;
  const std::string path = folder.write("a.txt", "old");
  write_file(path, "new");
  CHECK(read_bytes(path) == "new");
  std::filesystem::create_directory(folder.path() + "/a.txt.part");  // in the way of the next write
  CHECK_THROWS_AS(write_file(path, "newer"), std::runtime_error);
  CHECK(read_bytes(path) == "new");
  CHECK_THROWS_AS(write_file(folder.path() + "/none/b.txt", "x"), std::runtime_error);
}
