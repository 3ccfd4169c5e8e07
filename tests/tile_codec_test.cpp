#include "mellin/store/tile_codec.hpp"

#include <doctest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

#include "host/tum.hpp"
#include "store_fixture.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// Codes as many tiles of a grid as fit and decodes them again; returns the payload's length, -1 where they differ.
long round_trip(const Bytes& cells, std::uint16_t side, std::size_t room, std::uint32_t& tiles) {
  Bytes payload(room + 1, 0xA5);
  TileEncoder encoder;
  encoder.begin(Span<std::uint8_t>(payload.data(), room));
  const GridView grid{Span<const std::uint8_t>(cells.data(), cells.size()), side, 0.05F};
  std::uint8_t tile[kTileCells];
  for (tiles = 0; tiles < tile_count(side); ++tiles) {
    gather_tile(grid, tile_rect(side, tiles), tile);
    if (encoder.add(tile, tile_rect(side, tiles)) != TileEncoder::Outcome::added) {
      break;
    }
  }
  const std::size_t size = encoder.finish();
  if (payload[room] != 0xA5 || size > room || encoder.tiles() != tiles) {
    return -1;
  }
  TileDecoder decoder;
  decoder.begin(Span<const std::uint8_t>(payload.data(), size));
  Bytes back(cells.size(), 7);
  for (std::uint32_t i = 0; i < tiles; ++i) {
    const TileRect rect = tile_rect(side, i);
    decoder.next(tile, rect);
    scatter_tile(Span<const std::uint8_t>(tile, rect.cells()), rect, side,
                 Span<std::uint8_t>(back.data(), back.size()));
    for (std::size_t r = rect.row; r < std::size_t{rect.row} + rect.height; ++r) {
      for (std::size_t c = rect.column; c < std::size_t{rect.column} + rect.width; ++c) {
        if (back[r * side + c] != cells[r * side + c]) {
          return -1;
        }
      }
    }
  }
  return static_cast<long>(size);
}

std::filesystem::path data_folder() {
  const char* const named = std::getenv("MELLIN_DATA");
  return named != nullptr ? std::filesystem::path(named)
                          : std::filesystem::path(__FILE__).parent_path().parent_path().parent_path() / "shared/data";
}

struct PosedScan {
  Pose2 pose;
  std::vector<double> ranges;
};

/// Scans of a CARMEN log with the poses of the ground truth.
std::vector<PosedScan> read_scans(const std::filesystem::path& log, const std::filesystem::path& tum) {
  const auto poses = host::read_tum(tum.string());
  std::vector<PosedScan> scans;
  gzFile file = gzopen(log.c_str(), "rb");
  std::vector<char> line(100'000);
  while (file != nullptr && gzgets(file, line.data(), static_cast<int>(line.size())) != nullptr) {
    std::istringstream in(line.data());
    std::string word;
    std::size_t beams = 0;
    if (!(in >> word >> beams) || word != "FLASER") {
      continue;
    }
    PosedScan scan;
    scan.ranges.resize(beams);
    for (double& range : scan.ranges) {
      in >> range;
    }
    for (int i = 0; i < 6; ++i) {
      in >> word;
    }
    double stamp = 0.0;
    in >> stamp;
    for (const auto& pose : poses) {
      if (std::fabs(pose.seconds - stamp) < 1e-4) {
        scan.pose = pose.pose;
        scans.push_back(scan);
        break;
      }
    }
  }
  gzclose(file);
  return scans;
}

/// The submap of scans [first, first + 40) as the mapper means it: hits over observations, centred on the poses.
Bytes render(const std::vector<PosedScan>& scans, std::size_t first, std::uint16_t side, double cell_m) {
  constexpr std::size_t kScans = 40;
  constexpr double kMaxRange = 20.0;
  std::vector<int> hits(std::size_t{side} * side);
  std::vector<int> seen(hits.size());
  double cx = 0.0;
  double cy = 0.0;
  for (std::size_t i = first; i < first + kScans; ++i) {
    cx += scans[i].pose.x / kScans;
    cy += scans[i].pose.y / kScans;
  }
  const auto count = [&](double x, double y, bool hit) {
    const double c = std::floor((x - cx) / cell_m) + side / 2;
    const double r = std::floor((y - cy) / cell_m) + side / 2;
    if (c >= 0 && r >= 0 && c < side && r < side) {
      const std::size_t at = static_cast<std::size_t>(r) * side + static_cast<std::size_t>(c);
      ++seen[at];
      hits[at] += hit ? 1 : 0;
    }
  };
  for (std::size_t i = first; i < first + kScans; ++i) {
    const PosedScan& scan = scans[i];
    for (std::size_t beam = 0; beam < scan.ranges.size(); ++beam) {
      const double range = scan.ranges[beam];
      if (range >= kMaxRange) {
        continue;
      }
      const double angle = scan.pose.theta - kHalfPi + kPi * static_cast<double>(beam) / 180.0;
      for (double d = 0.0; d < range - cell_m; d += cell_m) {
        count(scan.pose.x + d * std::cos(angle), scan.pose.y + d * std::sin(angle), false);
      }
      count(scan.pose.x + range * std::cos(angle), scan.pose.y + range * std::sin(angle), true);
    }
  }
  Bytes cells(hits.size(), kUnobserved);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (seen[i] > 0) {
      cells[i] = static_cast<std::uint8_t>(std::lround(254.0 * hits[i] / seen[i]));
    }
  }
  return cells;
}

}  // namespace

TEST_CASE("tiles cover the grid once, cut off at its edges") {
  for (const int edge : {2, 32, 34, 64, 100, 768}) {
    const auto side = static_cast<std::uint16_t>(edge);
    Bytes covered(std::size_t{side} * side, 0);
    for (std::uint32_t tile = 0; tile < tile_count(side); ++tile) {
      const TileRect rect = tile_rect(side, tile);
      for (std::size_t r = rect.row; r < std::size_t{rect.row} + rect.height; ++r) {
        for (std::size_t c = rect.column; c < std::size_t{rect.column} + rect.width; ++c) {
          ++covered[r * side + c];
        }
      }
    }
    CHECK(std::count(covered.begin(), covered.end(), 1) == static_cast<std::ptrdiff_t>(covered.size()));
  }
}

TEST_CASE("every grid survives, and so does every tile that fits, whatever room there is") {
  Random32 random(5);
  std::uint32_t tiles = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const auto side = static_cast<std::uint16_t>(2 + 2 * (random() % 60));
    Bytes cells =
        trial % 4 == 0 ? random_bytes(std::size_t{side} * side, random()) : room_grid(side < 16 ? 16 : side, random());
    const auto true_side = static_cast<std::uint16_t>(std::lround(std::sqrt(static_cast<double>(cells.size()))));
    if (trial % 4 == 3) {
      const auto only = static_cast<std::uint8_t>(random());
      std::fill(cells.begin(), cells.end(), only);
    }
    CHECK(round_trip(cells, true_side, random() % 3000, tiles) >= 0);
    if (trial % 4 != 0) {
      CHECK(round_trip(cells, true_side, 20'000, tiles) >= 0);
      CHECK(tiles == tile_count(true_side));
    }
  }
}

TEST_CASE("unobserved space costs next to nothing, and noise is told to be incompressible") {
  std::uint32_t tiles = 0;
  const long size = round_trip(Bytes(768 * 768, kUnobserved), 768, 2000, tiles);
  CHECK(tiles == 576);
  CHECK(size <= 8);
  TileEncoder encoder;
  Bytes payload(4000);
  encoder.begin(Span<std::uint8_t>(payload.data(), payload.size()));
  Bytes noise = random_bytes(kTileCells, 8);
  CHECK(encoder.add(Span<std::uint8_t>(noise.data(), noise.size()), tile_rect(32, 0)) ==
        TileEncoder::Outcome::incompressible);
  CHECK(encoder.tiles() == 0);
  CHECK(encoder.finish() == 0);
  encoder.begin(Span<std::uint8_t>(payload.data(), 100));
  CHECK(encoder.add(Span<std::uint8_t>(noise.data(), noise.size()), tile_rect(32, 0)) == TileEncoder::Outcome::no_room);
}

TEST_CASE("any bytes decode to some cells") {
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    const Bytes bytes = random_bytes(seed * 3, seed);
    TileDecoder decoder;
    decoder.begin(Span<const std::uint8_t>(bytes.data(), bytes.size()));
    std::uint8_t tile[kTileCells];
    for (std::uint32_t i = 0; i < 9; ++i) {
      decoder.next(tile, tile_rect(96, i));
    }
  }
}

TEST_CASE("submaps of a real log take less on flash than zlib makes of them") {
  const std::filesystem::path data = data_folder();
  if (!std::filesystem::exists(data / "intel.log.gz")) {
    std::puts("skipped: no data");
    return;
  }
  const std::vector<PosedScan> scans = read_scans(data / "intel.log.gz", data / "intel.tum");
  REQUIRE(scans.size() > 400);
  struct Size {
    std::uint16_t side;
    double cell_m;
  };
  for (const Size& size : {Size{768, 0.05}, Size{384, 0.1}, Size{192, 0.2}}) {
    StoreConfig config = small_config(size.side);
    TornFlash flash({4096, 2048, 256});
    TestStore t(config, flash.flash());
    REQUIRE(t.store.format() == Status::ok);
    std::size_t zlib = 0;
    std::size_t stored = 0;
    constexpr std::uint32_t kSubmaps = 5;
    for (std::uint32_t id = 0; id < kSubmaps; ++id) {
      const Bytes cells = render(scans, id * (scans.size() - 40) / kSubmaps, size.side, size.cell_m);
      uLongf length = compressBound(cells.size());
      Bytes packed(length);
      REQUIRE(compress2(packed.data(), &length, cells.data(), cells.size(), 6) == Z_OK);
      zlib += length;
      REQUIRE(t.put(sample_header(id), cells, {}) == Status::ok);
      CHECK(t.cells(id) == cells);
      stored += t.store.stored_bytes(id);
    }
    std::printf("side %d: %zu bytes a submap on flash, zlib -6 %zu, raw %zu\n", int{size.side}, stored / kSubmaps,
                zlib / kSubmaps, std::size_t{size.side} * size.side);
    CHECK(stored < zlib);
  }
}
