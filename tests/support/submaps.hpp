// Submaps with known poses for tests: from the simulated floor, and from the real logs where they are at hand.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/simulator.hpp"
#include "host/submap_rendering.hpp"
#include "host/tum.hpp"

namespace mellin::test {

/// Keeps the scans that are at least `distance_m` or `angle_rad` from the one kept before.
inline std::vector<host::PosedScan> taken(const std::vector<host::PosedScan>& scans, double distance_m,
                                          double angle_rad) {
  std::vector<host::PosedScan> kept;
  for (const host::PosedScan& scan : scans) {
    if (!kept.empty()) {
      const Pose2 moved = between(kept.back().world_T_laser, scan.world_T_laser);
      if (translation(moved) < distance_m && std::abs(moved.theta) < angle_rad) {
        continue;
      }
    }
    kept.push_back(scan);
  }
  return kept;
}

/// The scans of a drive round the simulated floor, at their true poses.
inline std::vector<host::PosedScan> simulated_scans(std::uint64_t seed) {
  host::SimOptions options;
  options.seed = seed;
  std::vector<host::PosedScan> scans;
  for (const host::SimScan& scan : host::simulate(options, 0).scans) {
    scans.push_back({scan.world_T_base, scan.ranges, -kHalfPi, kPi / 180.0, options.range_m});
  }
  return taken(scans, 0.5, 0.5);
}

/// The folder with the real logs: $MELLIN_DATA, else ../shared/data beside the sources or any folder above.
inline std::optional<std::string> data_folder() {
  if (const char* given = std::getenv("MELLIN_DATA"); given != nullptr) {
    return std::filesystem::exists(given) ? std::optional<std::string>(given) : std::nullopt;
  }
  for (auto folder = std::filesystem::path(__FILE__).parent_path(); folder != folder.root_path();
       folder = folder.parent_path()) {
    if (std::filesystem::exists(folder / "shared" / "data" / "intel.tum")) {
      return (folder / "shared" / "data").string();
    }
  }
  return std::nullopt;
}

/// The taken scans (0.5 m or 30 degrees apart) of a real log that have a true pose.
inline std::vector<host::PosedScan> real_scans(const std::string& folder, const std::string& name) {
  const host::Log log = host::read_carmen_log(folder + "/" + name + ".log.gz");
  const std::vector<host::StampedPose> truth = host::read_tum(folder + "/" + name + ".tum");
  std::vector<host::PosedScan> scans;
  std::size_t next = 0;
  for (const host::LogScan& scan : log.scans) {
    while (next < truth.size() && truth[next].seconds < scan.seconds - 1.5e-3) {
      ++next;
    }
    if (next < truth.size() && truth[next].seconds < scan.seconds + 1.5e-3) {
      const host::LaserSpec& laser = log.lasers[scan.laser];
      scans.push_back(
          {truth[next].pose, scan.ranges, laser.angle_min_rad, laser.increment_rad, std::min(laser.max_range_m, 40.0)});
    }
  }
  return taken(scans, 0.5, 30.0 * kPi / 180.0);
}

/// `count` scans from `first` on, every `stride`-th, in a submap turned by `heading_rad`.
inline host::RenderedSubmap submap(const std::vector<host::PosedScan>& scans, std::size_t first, std::size_t count,
                                   std::size_t stride, double heading_rad) {
  std::vector<host::PosedScan> part;
  for (std::size_t i = 0; i < count; ++i) {
    part.push_back(scans[first + i * stride]);
  }
  return host::render_submap(part, host::centred_frame(part, heading_rad), 768, 0.05F);
}

}  // namespace mellin::test
