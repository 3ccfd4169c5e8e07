// A drive on the simulated floor as the log that the reader would make of it, with the truth of every scan.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/simulator.hpp"
#include "host/tum.hpp"

namespace mellin::test {

#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif
#else
inline constexpr bool kSanitized = false;
#endif

struct SimulatedLog {
  host::Log log;
  std::vector<host::StampedPose> truth;
};

/// The scans of one session, at most `scans` of them (0: all).
inline SimulatedLog simulated_log(const host::SimOptions& options, int session = 0, std::size_t scans = 0) {
  SimulatedLog out;
  out.log.path = "simulated-" + std::to_string(session);
  host::LaserSpec laser;
  laser.beams = static_cast<std::size_t>(options.beams);
  laser.angle_min_rad = -kHalfPi;
  laser.increment_rad = host::beam_increment(options.beams);
  laser.max_range_m = options.range_m;
  out.log.lasers.push_back(laser);
  for (const host::SimScan& scan : host::simulate(options, session).scans) {
    if (scans != 0 && out.log.scans.size() == scans) {
      break;
    }
    char stamp[32];
    std::snprintf(stamp, sizeof stamp, "%.6f", scan.seconds);
    host::LogScan in;
    in.seconds = std::stod(stamp);
    in.stamp = stamp;
    in.odometry = scan.odometry_T_base;
    in.ranges = scan.ranges;
    out.log.scans.push_back(in);
    out.truth.push_back({stamp, in.seconds, scan.world_T_base});
  }
  return out;
}

}  // namespace mellin::test
