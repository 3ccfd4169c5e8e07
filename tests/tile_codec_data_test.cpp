// The tile codec on submaps of a real log, beside zlib.
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
