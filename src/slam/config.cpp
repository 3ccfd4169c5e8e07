#include "mellin/config.hpp"

namespace mellin {
namespace {

Status refuse(const Log& log, const char* field, double value, const char* expected) {
  log.write(MELLIN_LOG_WARNING, LogLine() << "config: " << field << " is " << value << ", expected " << expected);
  return Status::invalid_config;
}

Status validate_laser(const LaserConfig& laser, float cell_m, const Log& log) {
  if (laser.beams > 4096) {
    return refuse(log, "beams", laser.beams, "at most 4096");
  }
  if (!(laser.min_range_m >= 0.0F)) {
    return refuse(log, "min_range_m", static_cast<double>(laser.min_range_m), "0 or more");
  }
  if (!(laser.max_range_m > laser.min_range_m) || !(laser.max_range_m <= 131.0F) ||
      !(laser.max_range_m < 8000.0F * cell_m)) {
    return refuse(log, "max_range_m", static_cast<double>(laser.max_range_m),
                  "over min_range_m, at most 131 and 8000 cells");
  }
  const double field_of_view = static_cast<double>(laser.angle_increment_rad) * (laser.beams > 0 ? laser.beams - 1 : 0);
  if (!(field_of_view > -kTwoPi - 0.01) || !(field_of_view < kTwoPi + 0.01)) {
    return refuse(log, "angle_increment_rad", static_cast<double>(laser.angle_increment_rad),
                  "a field of view of one turn at most");
  }
  if (!is_finite(laser.base_T_laser) || !is_finite(static_cast<double>(laser.angle_min_rad))) {
    return refuse(log, "base_T_laser", laser.base_T_laser.x, "finite numbers");
  }
  return Status::ok;
}

}  // namespace

Status validate(const Config& given, Log log) {
  const Config c = resolved(given);
  if (c.mapper.max_beams == 0) {
    return refuse(log, "lasers", 0.0, "at least one with beams");
  }
  if (!(c.cell_m >= 0.005F) || !(c.cell_m <= 2.0F)) {
    return refuse(log, "cell_m", static_cast<double>(c.cell_m), "0.005 to 2");
  }
  for (const LaserConfig& laser : c.lasers) {
    const Status status = laser.beams == 0 ? Status::ok : validate_laser(laser, c.cell_m, log);
    if (status != Status::ok) {
      return status;
    }
  }
  if (c.side < 64 || c.side > kMaxStoreSide || c.side % 32 != 0) {
    return refuse(log, "side", c.side, "64 to 2048, a multiple of 32");
  }
  if (c.remembered_scans < 2) {
    return refuse(log, "remembered_scans", c.remembered_scans, "at least 2");
  }
  if (std::uint64_t{c.mapper.max_beams} * c.remembered_scans > kMaxCellCount) {
    return refuse(log, "remembered_scans x beams", static_cast<double>(c.mapper.max_beams) * c.remembered_scans,
                  "at most 65535, what a cell can count");
  }
  if (c.mapper.particles < 1 || c.mapper.particles > 1000) {
    return refuse(log, "particles", c.mapper.particles, "1 to 1000");
  }
  if (c.mapper.spare_scans < 1) {
    return refuse(log, "spare_scans", c.mapper.spare_scans, "at least 1");
  }
  if (c.mapper.matcher.search_points < 1) {
    return refuse(log, "search_points", c.mapper.matcher.search_points, "at least 1");
  }
  if (!(c.mapper.take_distance_m > 0.0F) || !(c.mapper.take_angle_rad > 0.0F)) {
    return refuse(log, "take_distance_m", static_cast<double>(c.mapper.take_distance_m), "over 0");
  }
  if (c.submaps.every_scans < 1 || c.submaps.band_rows < 1) {
    return refuse(log, "every_scans", c.submaps.every_scans, "at least 1");
  }
  if (c.class_side < 16 || c.side % c.class_side != 0) {
    return refuse(log, "class_side", c.class_side, "a divisor of side, at least 16");
  }
  if (c.grid_slots < 2) {
    return refuse(log, "grid_slots", c.grid_slots, "at least 2");
  }
  if (c.max_submaps < 2 || c.max_submaps > 65535) {
    return refuse(log, "max_submaps", c.max_submaps, "2 to 65535");
  }
  if (c.max_sessions < 1) {
    return refuse(log, "max_sessions", c.max_sessions, "at least 1");
  }
  if (c.collection.linker.pending < 1 || c.collection.linker.pending > kMaxHypotheses) {
    return refuse(log, "pending", c.collection.linker.pending, "1 to 64");
  }
  return Status::ok;
}

}  // namespace mellin
