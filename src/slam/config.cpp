#include "mellin/config.hpp"

#include "mellin/spectral/fft2.hpp"

namespace mellin {
namespace {

/// A laser stands on the robot; the bound keeps cell arithmetic within its range.
constexpr double kMaxMount_m = 10.0;

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
  if (!is_finite(static_cast<double>(laser.angle_min_rad))) {
    return refuse(log, "angle_min_rad", static_cast<double>(laser.angle_min_rad), "a finite number");
  }
  const Pose2& mount = laser.base_T_laser;
  if (!is_finite(mount) || !(translation(mount) <= kMaxMount_m)) {
    return refuse(log, "base_T_laser", is_finite(mount) ? translation(mount) : mount.x, "within 10 m of the base");
  }
  return Status::ok;
}

/// A number with its limits. Written so that NaN is outside.
struct Limits {
  const char* field;
  float value;
  float least;  ///< 0 itself is allowed only where `zero` says so
  float most;
  bool zero;
  const char* expected;
};

Status validate_all(Span<const Limits> fields, const Log& log) {
  for (const Limits& f : fields) {
    const bool in_range = f.value >= f.least && f.value <= f.most && (f.zero || f.value > 0.0F);
    if (!in_range) {
      return refuse(log, f.field, static_cast<double>(f.value), f.expected);
    }
  }
  return Status::ok;
}

Status validate_numbers(const Config& c, const Log& log) {
  const ParticleMapperConfig& mapper = c.mapper;
  const MotionNoise& noise = mapper.noise;
  const OdometryEdgeNoise& edge = c.collection.odometry;
  constexpr float kMuch = 1e6F;
  const char* const over_zero = "over 0";
  const char* const not_negative = "0 or more";
  const Limits fields[] = {
      {"take_distance_m", mapper.take_distance_m, 0.0F, kMuch, false, over_zero},
      {"take_angle_rad", mapper.take_angle_rad, 0.0F, kMuch, false, over_zero},
      {"resample_share", mapper.resample_share, 0.0F, 1.0F, true, "0 to 1"},
      {"proposal_spread", mapper.proposal_spread, 0.0F, kMuch, true, not_negative},
      {"distance_base_m", noise.distance_base_m, 1e-5F, kMuch, false, "at least 0.00001"},
      {"distance_per_m", noise.distance_per_m, 0.0F, kMuch, true, not_negative},
      {"distance_per_rad", noise.distance_per_rad, 0.0F, kMuch, true, not_negative},
      {"angle_base_rad", noise.angle_base_rad, 1e-5F, kMuch, false, "at least 0.00001"},
      {"angle_per_m", noise.angle_per_m, 0.0F, kMuch, true, not_negative},
      {"angle_per_rad", noise.angle_per_rad, 0.0F, kMuch, true, not_negative},
      {"scale_sigma", mapper.odometry.scale_sigma, 1e-5F, 0.3F, false, "0.00001 to 0.3"},
      {"angle_per_m_sigma", mapper.odometry.angle_per_m_sigma, 1e-5F, 1.0F, false, "0.00001 to 1"},
      {"angle_per_rad_sigma", mapper.odometry.angle_per_rad_sigma, 1e-5F, 0.3F, false, "0.00001 to 0.3"},
      {"least_noise", mapper.odometry.least_noise, 0.01F, 1.0F, false, "0.01 to 1"},
      {"most_noise", mapper.odometry.most_noise, 1.0F, 100.0F, false, "1 to 100"},
      {"search_distance_m", mapper.matcher.search_distance_m, 0.0F, 1000.0F * c.cell_m, true, "0 to 1000 cells"},
      {"search_angle_rad", mapper.matcher.search_angle_rad, 0.0F, 3.1416F, true, "0 to half a turn"},
      {"search_angle_step_rad", mapper.matcher.search_angle_step_rad, 0.001F, 3.1416F, false, "0.001 to half a turn"},
      {"scan_weight", mapper.matcher.scan_weight, 0.0F, kMuch, false, over_zero},
      {"search_gain", mapper.matcher.search_gain, 0.0F, kMuch, true, not_negative},
      {"point_sigma_m", mapper.matcher.point_sigma_m, 1e-5F, kMuch, false, "at least 0.00001"},
      {"independent_share", mapper.matcher.independent_share, 0.0F, 1.0F, false, "over 0, at most 1"},
      {"min_inlier_share", mapper.matcher.min_inlier_share, 0.0F, 1.0F, true, "0 to 1"},
      {"recovery_distance_m", mapper.matcher.recovery_distance_m, 0.0F, 1000.0F * c.cell_m, true, "0 to 1000 cells"},
      {"recovery_angle_rad", mapper.matcher.recovery_angle_rad, 0.0F, 3.1416F, true, "0 to half a turn"},
      {"recovery_angle_step_rad", mapper.matcher.recovery_angle_step_rad, 0.001F, 3.1416F, false,
       "0.001 to half a turn"},
      {"recovery_inlier_share", mapper.matcher.recovery_inlier_share, 0.0F, 1.0F, true, "0 to 1"},
      {"recovery_gain", mapper.matcher.recovery_gain, 0.0F, 1.0F, true, "0 to 1"},
      {"conflict_share", mapper.monitor.conflict_share, 0.0F, 1.0F, false, "over 0, at most 1"},
      {"sure_share", mapper.monitor.sure_share, 0.0F, 1.0F, true, "0 to 1"},
      {"suspect_share", mapper.monitor.suspect_share, 0.0F, 1.0F, false, "over 0, at most 1"},
      {"least_share", mapper.monitor.least_share, 0.0F, 1.0F, false, "over 0, at most 1"},
      {"max_path_m", c.submaps.max_path_m, 0.0F, kMuch, false, over_zero},
      {"every_path_m", c.submaps.every_path_m, 0.0F, kMuch, false, over_zero},
      {"max_drift_m", c.submaps.max_drift_m, 0.0F, kMuch, true, not_negative},
      {"max_drift_rad", c.submaps.max_drift_rad, 0.0F, kMuch, true, not_negative},
      {"drift_share", c.submaps.drift_share, 0.0F, 1.0F, true, "0 to 1"},
      {"smoother.reach_m", c.submaps.smoother.reach_m, 0.0F, 10.0F, false, "over 0, at most 10"},
      {"smoother.point_sigma_m", c.submaps.smoother.point_sigma_m, 1e-3F, 10.0F, true, "0.001 to 10"},
      {"smoother.independent_share", c.submaps.smoother.independent_share, 0.0F, 1.0F, true, "0 to 1"},
      {"smoother.step_sigma_m", c.submaps.smoother.step_sigma_m, 1e-3F, 10.0F, true, "0.001 to 10"},
      {"smoother.step_sigma_rad", c.submaps.smoother.step_sigma_rad, 1e-3F, 10.0F, true, "0.001 to 10"},
      {"min_gain_bits", c.collection.linker.min_gain_bits, 0.0F, 20.0F, true, "0 to 20"},
      {"nearby_m", c.collection.nearby_m, 0.0F, kMuch, true, not_negative},
      {"base_m", edge.base_m, 1e-5F, kMuch, false, "at least 0.00001"},
      {"per_m", edge.per_m, 0.0F, kMuch, true, not_negative},
      {"base_rad", edge.base_rad, 1e-5F, kMuch, false, "at least 0.00001"},
      {"per_m_rad", edge.per_m_rad, 0.0F, kMuch, true, not_negative},
  };
  return validate_all(fields, log);
}

Status validate_matcher(const MatcherConfig& m, const Log& log) {
  constexpr float kMuch = 999.0F;
  const auto number = [](auto value) { return static_cast<float>(value); };
  const Limits fields[] = {
      {"max_peaks", number(m.max_peaks), 1.0F, number(kMaxRotationPeaks), false, "1 to 6"},
      {"com_radius", number(m.com_radius), 0.0F, 3.0F, true, "0 to 3"},
      {"peak_share", m.peak_share, 0.0F, 1.0F, true, "0 to 1"},
      {"min_peak", m.min_peak, 0.0F, 1.0F, true, "0 to 1"},
      {"lowpass_sigma", m.lowpass_sigma, 0.0F, kMuch, true, "0 to 999"},
      {"whitening_floor", m.whitening_floor, 0.0F, 1.0F, false, "over 0, at most 1"},
      {"edge_margin", m.edge_margin, 0.0F, 0.1F, false, "over 0, at most 0.1"},
      {"turns_per_bin", number(m.turns_per_bin), 0.0F, 8.0F, true, "0 to 8"},
      {"kept_turns", number(m.kept_turns), 0.0F, number(m.side) * number(m.turns_per_bin), true,
       "0 to the pictures' side x turns_per_bin"},
      {"min_overlap", m.min_overlap, 0.0F, 1.0F, false, "over 0, at most 1"},
      {"preprocessing", number(m.preprocessing), 0.0F, number(Preprocessing::blur), true, "a Preprocessing"},
      {"rotation", number(m.rotation), 0.0F, number(RotationMode::log_polar_scale), true, "a RotationMode"},
      {"high_pass", number(m.high_pass), 0.0F, number(HighPass::reddy), true, "a HighPass"},
      {"peak_fit", number(m.peak_fit), 0.0F, number(PeakFit::gaussian), true, "a PeakFit"},
  };
  return validate_all(fields, log);
}

Status validate_cascade(const ScreeningConfig& s, const Log& log) {
  const Limits fields[] = {
      {"coarse_peaks", static_cast<float>(s.coarse_peaks), 0.0F, 6.0F, true, "0 to 6"},
      {"coarse_peak", s.coarse_peak, 0.0F, 1.0F, true, "0 to 1"},
      {"coarse_agreement", s.coarse_agreement, 0.0F, 1.0F, true, "0 to 1"},
      {"min_rotation_peak", s.min_rotation_peak, 0.0F, 1.0F, true, "0 to 1"},
      {"first_peaks", static_cast<float>(s.first_peaks), 1.0F, 6.0F, true, "1 to 6"},
      {"further_agreement", s.further_agreement, 0.0F, 1.0F, true, "0 to 1"},
      {"verified", static_cast<float>(s.verified), 1.0F, 255.0F, true, "at least 1"},
      {"verified_share", s.verified_share, 0.0F, 1.0F, true, "0 to 1"},
  };
  if (s.coarse_peaks > 0 &&
      (!s.cache_features || s.matcher.side % 2 != 0 || !is_fft_side(coarse_config(s).matcher.side))) {
    return refuse(log, "coarse_peaks", s.coarse_peaks,
                  "0 where features are not cached, or half of screening_side is no transform's side");
  }
  return validate_all(fields, log);
}

/// Arrays whose lengths are products: within 2^31 elements, so that a 32-bit processor measures them right.
Status validate_products(const Config& c, const Log& log) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 31U;
  const char* const expected = "at most 2147483648";
  const std::uint64_t cells = std::uint64_t{c.side} * c.side;
  // A digest and its features have up to 16 numbers a pixel.
  const std::uint64_t pixels = std::uint64_t{c.screening_side} * c.screening_side;
  const std::uint64_t digests = c.screening.hold_digests ? c.max_submaps : 2;
  if (c.mapper.particles * cells > kMost) {
    return refuse(log, "particles x side^2", static_cast<double>(c.mapper.particles * cells), expected);
  }
  if (c.grid_slots * cells > kMost) {
    return refuse(log, "grid_slots x side^2", static_cast<double>(c.grid_slots * cells), expected);
  }
  if (16 * digests * pixels > kMost) {
    return refuse(log, "16 x max_submaps x screening_side^2", static_cast<double>(16 * digests * pixels), expected);
  }
  return Status::ok;
}

/// Whether halving `side` leads to `small`.
bool halves_to(std::uint32_t side, std::uint32_t small) {
  while (side > small && side % 2 == 0) {
    side /= 2;
  }
  return side == small;
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
  if (c.mapper.count_once_a_scan && c.remembered_scans > kMaxSmallCellCount) {
    return refuse(log, "remembered_scans", c.remembered_scans, "at most 255 where they are counted once a scan");
  }
  if (std::uint64_t{c.mapper.max_beams} * c.remembered_scans > kMaxCellCount) {
    return refuse(log, "remembered_scans x beams", static_cast<double>(c.mapper.max_beams) * c.remembered_scans,
                  "at most 65535, what a cell can count");
  }
  if (c.mapper.particles < 1 || c.mapper.particles > 1000) {
    return refuse(log, "particles", c.mapper.particles, "1 to 1000");
  }
  if (c.mapper.spare_scans < 1 || c.mapper.spare_scans + std::uint32_t{c.remembered_scans} > 65535) {
    return refuse(log, "spare_scans", c.mapper.spare_scans, "at least 1, with remembered_scans at most 65535");
  }
  if (c.mapper.matcher.search_points < 1) {
    return refuse(log, "search_points", c.mapper.matcher.search_points, "at least 1");
  }
  if (c.mapper.odometry.memory_scans < 2) {
    return refuse(log, "memory_scans", c.mapper.odometry.memory_scans, "at least 2");
  }
  const Status numbers = validate_numbers(c, log);
  if (numbers != Status::ok) {
    return numbers;
  }
  if (c.submaps.every_scans < 1) {
    return refuse(log, "every_scans", c.submaps.every_scans, "at least 1");
  }
  if (c.submaps.band_rows < 1) {
    return refuse(log, "band_rows", c.submaps.band_rows, "at least 1");
  }
  constexpr const char* kTransformed = "side over a power of two, even, 32 to 1024, a product of 2, 3 and 5";
  if (!is_fft_side(c.screening_side) || !halves_to(c.side, c.screening_side)) {
    return refuse(log, "screening_side", c.screening_side, kTransformed);
  }
  if (!is_fft_side(c.registration_side) || !halves_to(c.side, c.registration_side)) {
    return refuse(log, "registration_side", c.registration_side, kTransformed);
  }
  for (const MatcherConfig* const matcher : {&c.screening.matcher, &c.registration.matcher}) {
    const Status status = validate_matcher(*matcher, log);
    if (status != Status::ok) {
      return status;
    }
  }
  const Status cascade = validate_cascade(c.screening, log);
  if (cascade != Status::ok) {
    return cascade;
  }
  if (c.class_side < 16 || c.side % c.class_side != 0) {
    return refuse(log, "class_side", c.class_side, "a divisor of side, at least 16");
  }
  if (c.submaps.smoother.points < 1) {
    return refuse(log, "smoother.points", c.submaps.smoother.points, "at least 1");
  }
  if (c.submaps.smoother.partners > ScanSmoother::kMostPartners) {
    return refuse(log, "smoother.partners", c.submaps.smoother.partners, "at most 10");
  }
  if (c.grid_slots < 2) {
    return refuse(log, "grid_slots", c.grid_slots, "at least 2");
  }
  if (c.max_submaps < 2 || c.max_submaps > 65535) {
    return refuse(log, "max_submaps", c.max_submaps, "2 to 65535");
  }
  if (c.collection.graph.max_fill < c.max_submaps) {
    return refuse(log, "max_fill", c.collection.graph.max_fill, "at least max_submaps");
  }
  if (c.collection.graph.work_per_step < 1) {
    return refuse(log, "work_per_step", c.collection.graph.work_per_step, "at least 1");
  }
  if (validate(MapCollection::graph_config(c.collection)) != Status::ok) {
    return refuse(log, "max_edges", c.collection.graph.max_edges, "at most 2^24, and max_fill at most 2^28");
  }
  if (c.max_sessions < 1) {
    return refuse(log, "max_sessions", c.max_sessions, "at least 1");
  }
  if (c.screening.cache_features && !c.screening.hold_digests) {
    return refuse(log, "cache_features", 1.0, "0 where hold_digests is 0");
  }
  if (c.collection.linker.pending < 1 || c.collection.linker.pending > kMaxHypotheses) {
    return refuse(log, "pending", c.collection.linker.pending, "1 to 64");
  }
  return validate_products(c, log);
}

}  // namespace mellin
