// mellin match as a person calls it: map_server's pictures, masks, the page that explains, refusals.
#include <doctest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/simulator.hpp"
#include "host/submap_rendering.hpp"
#include "tests/host_support.hpp"
#include "tests/support/mellin_program.hpp"
#include "tests/support/submaps.hpp"

using namespace mellin;
using mellin::test::mellin_program;
using mellin::test::Outcome;
using mellin::test::read_bytes;
using mellin::test::TemporaryFolder;

namespace {

/// The grey of a cell: map_server's trinary values, or its scale.
unsigned char grey_of(std::uint8_t cell, bool trinary) {
  constexpr unsigned char kGreyUnknown = 205;
  if (cell == kUnobserved) {
    return kGreyUnknown;
  }
  if (trinary) {
    return cell >= 127 ? 0 : 254;
  }
  const auto grey = static_cast<unsigned char>(254 - cell);
  return grey == kGreyUnknown ? kGreyUnknown - 1 : grey;
}

/// As map_saver writes it, comment and all.
std::string pgm(const host::RenderedSubmap& grid, bool trinary) {
  std::string bytes = "P5\n# CREATOR: map_saver.cpp 0.050 m/pix\n" + std::to_string(grid.side) + " " +
                      std::to_string(grid.side) + "\n255\n";
  for (std::size_t row = grid.side; row-- > 0;) {
    for (std::size_t column = 0; column < grid.side; ++column) {
      bytes += static_cast<char>(grey_of(grid.cells[row * grid.side + column], trinary));
    }
  }
  return bytes;
}

/// White where the grid was observed.
std::string mask_of(const host::RenderedSubmap& grid) {
  std::string bytes = "P5 " + std::to_string(grid.side) + " " + std::to_string(grid.side) + " 255\n";
  for (std::size_t row = grid.side; row-- > 0;) {
    for (std::size_t column = 0; column < grid.side; ++column) {
      bytes += grid.cells[row * grid.side + column] == kUnobserved ? '\0' : '\xFF';
    }
  }
  return bytes;
}

std::string flat(std::size_t side, int grey) {
  return "P5 " + std::to_string(side) + " " + std::to_string(side) + " 255\n" +
         std::string(side * side, static_cast<char>(grey));
}

nlohmann::json hypotheses(const Outcome& outcome) {
  REQUIRE(outcome.status == 0);
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  CHECK(json.at("seconds").get<double>() > 0.0);
  return json.at("hypotheses");
}

/// Every src and href of the page.
std::vector<std::string> links_of(const std::string& page) {
  std::vector<std::string> links;
  for (const std::string attribute : {"src=\"", "href=\""}) {
    for (std::size_t at = page.find(attribute); at != std::string::npos; at = page.find(attribute, at + 1)) {
      const std::size_t from = at + attribute.size();
      links.push_back(page.substr(from, page.find('"', from) - from));
    }
  }
  return links;
}

void check_page(const std::string& folder, std::size_t fewest_links) {
  const std::string page = read_bytes(folder + "/index.html");
  CHECK(page.find("</html>") != std::string::npos);
  CHECK(page.find("nan") == std::string::npos);
  const std::vector<std::string> links = links_of(page);
  CHECK(links.size() >= fewest_links);
  for (const std::string& link : links) {
    CAPTURE(link);
    CHECK(std::filesystem::file_size(folder + "/" + link) > 60);
  }
}

}  // namespace

TEST_CASE("map_server's grids are matched, with masks or without, and every step is explained") {
  const TemporaryFolder folder;
  const std::vector<host::PosedScan> scans = test::simulated_scans(3);
  const host::RenderedSubmap a = test::submap(scans, 10, 40, 1, 0.0);
  const host::RenderedSubmap b = test::submap(scans, 20, 40, 1, 0.7);
  const double half_m = 0.5 * a.side * static_cast<double>(a.cell_m);
  const Pose2 corner{-half_m, -half_m, 0.0};
  const Pose2 truth = between(compose(a.world_T_submap, corner), compose(b.world_T_submap, corner));
  const std::string trinary = folder.write("a.pgm", pgm(a, true));
  const std::string scaled = folder.write("b.pgm", pgm(b, false));
  const std::string masks =
      " --mask-a " + folder.write("ma.pgm", mask_of(a)) + " --mask-b " + folder.write("mb.pgm", mask_of(b));
  const std::string page = folder.path() + "/deep/page";
  for (const std::string& options : {std::string(), masks, " --explain " + page}) {
    CAPTURE(options);
    const nlohmann::json found = hypotheses(mellin_program(folder, "match " + trinary + " " + scaled + options));
    REQUIRE(found.size() == 1);
    CHECK(found[0].at("confidence").get<double>() >= 0.5);
    const Pose2 pose{found[0].at("x").get<double>(), found[0].at("y").get<double>(),
                     found[0].at("theta").get<double>()};
    CHECK(translation(between(pose, truth)) < 0.1);
    CHECK(std::fabs(between(pose, truth).theta) < 0.01);
  }
  // Grids, matched pictures, spectra, polar pictures, the curve, two candidates with their surfaces, cut-out, overlay.
  check_page(page, 2 * (4 * 2 + 2 * 2 + 2) + 1);
}

TEST_CASE("pictures that show nothing give valid JSON and a page that says so") {
  const TemporaryFolder folder;
  const std::string unknown = folder.write("unknown.pgm", flat(200, 205));
  const std::string free = folder.write("free.pgm", flat(150, 254));
  const std::string page = folder.path() + "/page";
  CHECK(hypotheses(mellin_program(folder, "match " + unknown + " " + free + " --all --explain " + page)).empty());
  check_page(page, 8);
  CHECK(read_bytes(page + "/index.html").find("No hypothesis") != std::string::npos);
}

TEST_CASE("what cannot be matched or written is refused with a reason") {
  const TemporaryFolder folder;
  const std::string grid = folder.write("grid.pgm", flat(100, 254));
  const std::string large = folder.write("large.pgm", "P5 8193 2 255\n" + std::string(2 * 8193, '\xFE'));
  const std::string file = folder.write("file", "in the way");
  const Outcome too_large = mellin_program(folder, "match " + grid + " " + large);
  CHECK(too_large.status != 0);
  CHECK(too_large.err.find("8193") != std::string::npos);
  for (const std::string& arguments :
       {grid + " " + grid + " --explain " + file, grid + " " + grid + " --resolution 0",
        grid + " " + grid + " --mask-a " + large, grid + " " + folder.path() + "/missing.pgm"}) {
    CAPTURE(arguments);
    const Outcome outcome = mellin_program(folder, "match " + arguments);
    CHECK(outcome.status != 0);
    CHECK(!outcome.err.empty());
  }
}
