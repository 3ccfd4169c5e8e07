#include "host/settings.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <type_traits>

namespace mellin::host {
namespace {

/// The fields of a spectral matcher that a profile may set; side and pixel follow from the grids.
template <class C, class Visit>
void visit_matcher(const std::string& prefix, C& c, Visit& visit) {
  visit((prefix + "rotation").c_str(), c.rotation);
  visit((prefix + "high_pass").c_str(), c.high_pass);
  visit((prefix + "preprocessing").c_str(), c.preprocessing);
  visit((prefix + "peak_fit").c_str(), c.peak_fit);
  visit((prefix + "com_radius").c_str(), c.com_radius);
  visit((prefix + "peak_share").c_str(), c.peak_share);
  visit((prefix + "max_peaks").c_str(), c.max_peaks);
  visit((prefix + "min_peak").c_str(), c.min_peak);
  visit((prefix + "lowpass_sigma").c_str(), c.lowpass_sigma);
  visit((prefix + "translation_peaks").c_str(), c.translation_peaks);
  visit((prefix + "free_weight").c_str(), c.free_weight);
  visit((prefix + "turns_per_bin").c_str(), c.turns_per_bin);
  visit((prefix + "kept_turns").c_str(), c.kept_turns);
  visit((prefix + "masked").c_str(), c.masked);
  visit((prefix + "min_overlap").c_str(), c.min_overlap);
}

/// Calls visit(name, field) for each setting. Fields that resolved() overwrites are not among them.
template <class C, class Visit>
void visit_settings(C& c, Visit&& visit) {
  visit("side", c.side);
  visit("cell_m", c.cell_m);
  visit("remembered_scans", c.remembered_scans);
  visit("screening_side", c.screening_side);
  visit("registration_side", c.registration_side);
  visit("class_side", c.class_side);
  visit("max_submaps", c.max_submaps);
  visit("max_sessions", c.max_sessions);
  visit("grid_slots", c.grid_slots);
  visit("seed", c.seed);
  visit("mapper.particles", c.mapper.particles);
  visit("mapper.count_once_a_scan", c.mapper.count_once_a_scan);
  visit("mapper.spare_scans", c.mapper.spare_scans);
  visit("mapper.take_distance_m", c.mapper.take_distance_m);
  visit("mapper.take_angle_rad", c.mapper.take_angle_rad);
  visit("mapper.resample_share", c.mapper.resample_share);
  visit("mapper.proposal_spread", c.mapper.proposal_spread);
  visit("mapper.noise.distance_base_m", c.mapper.noise.distance_base_m);
  visit("mapper.noise.distance_per_m", c.mapper.noise.distance_per_m);
  visit("mapper.noise.distance_per_rad", c.mapper.noise.distance_per_rad);
  visit("mapper.noise.angle_base_rad", c.mapper.noise.angle_base_rad);
  visit("mapper.noise.angle_per_m", c.mapper.noise.angle_per_m);
  visit("mapper.noise.angle_per_rad", c.mapper.noise.angle_per_rad);
  visit("mapper.odometry.learn_bias", c.mapper.odometry.learn_bias);
  visit("mapper.odometry.learn_noise", c.mapper.odometry.learn_noise);
  visit("mapper.odometry.scale_sigma", c.mapper.odometry.scale_sigma);
  visit("mapper.odometry.angle_per_m_sigma", c.mapper.odometry.angle_per_m_sigma);
  visit("mapper.odometry.angle_per_rad_sigma", c.mapper.odometry.angle_per_rad_sigma);
  visit("mapper.odometry.memory_scans", c.mapper.odometry.memory_scans);
  visit("mapper.odometry.least_noise", c.mapper.odometry.least_noise);
  visit("mapper.odometry.most_noise", c.mapper.odometry.most_noise);
  visit("matcher.search_points", c.mapper.matcher.search_points);
  visit("matcher.search_distance_m", c.mapper.matcher.search_distance_m);
  visit("matcher.search_angle_rad", c.mapper.matcher.search_angle_rad);
  visit("matcher.search_angle_step_rad", c.mapper.matcher.search_angle_step_rad);
  visit("matcher.max_iterations", c.mapper.matcher.max_iterations);
  visit("matcher.scan_weight", c.mapper.matcher.scan_weight);
  visit("matcher.search_gain", c.mapper.matcher.search_gain);
  visit("matcher.point_sigma_m", c.mapper.matcher.point_sigma_m);
  visit("matcher.independent_share", c.mapper.matcher.independent_share);
  visit("matcher.min_inlier_share", c.mapper.matcher.min_inlier_share);
  visit("matcher.recovery_distance_m", c.mapper.matcher.recovery_distance_m);
  visit("matcher.recovery_angle_rad", c.mapper.matcher.recovery_angle_rad);
  visit("matcher.recovery_angle_step_rad", c.mapper.matcher.recovery_angle_step_rad);
  visit("matcher.recovery_inlier_share", c.mapper.matcher.recovery_inlier_share);
  visit("matcher.recovery_gain", c.mapper.matcher.recovery_gain);
  visit("monitor.lost_scans", c.mapper.monitor.lost_scans);
  visit("monitor.conflict_share", c.mapper.monitor.conflict_share);
  visit("monitor.sure_share", c.mapper.monitor.sure_share);
  visit("monitor.suspect_share", c.mapper.monitor.suspect_share);
  visit("monitor.least_share", c.mapper.monitor.least_share);
  visit("submaps.max_path_m", c.submaps.max_path_m);
  visit("submaps.every_scans", c.submaps.every_scans);
  visit("submaps.every_path_m", c.submaps.every_path_m);
  visit("submaps.drift_share", c.submaps.drift_share);
  visit("submaps.smoother.iterations", c.submaps.smoother.iterations);
  visit("submaps.smoother.points", c.submaps.smoother.points);
  visit("submaps.smoother.partners", c.submaps.smoother.partners);
  visit("submaps.smoother.reach_m", c.submaps.smoother.reach_m);
  visit("submaps.smoother.point_sigma_m", c.submaps.smoother.point_sigma_m);
  visit("submaps.smoother.independent_share", c.submaps.smoother.independent_share);
  visit("submaps.smoother.step_sigma_m", c.submaps.smoother.step_sigma_m);
  visit("submaps.smoother.step_sigma_rad", c.submaps.smoother.step_sigma_rad);
  visit("submaps.max_drift_m", c.submaps.max_drift_m);
  visit("submaps.max_drift_rad", c.submaps.max_drift_rad);
  visit("submaps.min_scans", c.submaps.min_scans);
  visit("submaps.band_rows", c.submaps.band_rows);
  visit_matcher("screening.", c.screening.matcher, visit);
  visit("screening.coarse_peaks", c.screening.coarse_peaks);
  visit("screening.coarse_peak", c.screening.coarse_peak);
  visit("screening.coarse_agreement", c.screening.coarse_agreement);
  visit("screening.min_rotation_peak", c.screening.min_rotation_peak);
  visit("screening.first_peaks", c.screening.first_peaks);
  visit("screening.further_agreement", c.screening.further_agreement);
  visit("screening.verified", c.screening.verified);
  visit("screening.verified_share", c.screening.verified_share);
  visit("screening.cache_features", c.screening.cache_features);
  visit("screening.hold_digests", c.screening.hold_digests);
  visit_matcher("registration.", c.registration.matcher, visit);
  visit("registration.aligned", c.registration.aligned);
  visit("registration.aligned_share", c.registration.aligned_share);
  visit("registration.aligned_from", c.registration.aligned_from);
  visit("registration.alignment.max_iterations", c.registration.alignment.max_iterations);
  visit("registration.alignment.final_m", c.registration.alignment.final_m);
  visit("registration.alignment.point_sigma_m", c.registration.alignment.point_sigma_m);
  visit("registration.alignment.max_points", c.registration.alignment.max_points);
  visit("registration.alignment.keep_both", c.registration.alignment.keep_both);
  visit("collection.close_loops", c.collection.close_loops);
  visit("collection.candidates", c.collection.candidates);
  visit("collection.nearby_candidates", c.collection.nearby_candidates);
  visit("collection.nearby_m", c.collection.nearby_m);
  visit("collection.candidate_agreement", c.collection.candidate_agreement);
  visit("collection.odometry.base_m", c.collection.odometry.base_m);
  visit("collection.odometry.per_m", c.collection.odometry.per_m);
  visit("collection.odometry.base_rad", c.collection.odometry.base_rad);
  visit("collection.odometry.per_m_rad", c.collection.odometry.per_m_rad);
  visit("linker.pending", c.collection.linker.pending);
  visit("linker.graph_gate_chi2", c.collection.linker.graph_gate_chi2);
  visit("linker.pair_gate_chi2", c.collection.linker.pair_gate_chi2);
  visit("linker.loop_witnesses", c.collection.linker.loop_witnesses);
  visit("linker.merge_witnesses", c.collection.linker.merge_witnesses);
  visit("linker.single_sigma_m", c.collection.linker.single_sigma_m);
  visit("linker.single_sigma_rad", c.collection.linker.single_sigma_rad);
  visit("linker.single_agreement", c.collection.linker.single_agreement);
  visit("linker.min_agreement", c.collection.linker.min_agreement);
  visit("linker.min_overlap", c.collection.linker.min_overlap);
  visit("linker.max_sigma_m", c.collection.linker.max_sigma_m);
  visit("linker.max_sigma_rad", c.collection.linker.max_sigma_rad);
  visit("linker.warp_sigma_m", c.collection.linker.warp_sigma_m);
  visit("linker.warp_sigma_rad", c.collection.linker.warp_sigma_rad);
  visit("linker.min_gain_bits", c.collection.linker.min_gain_bits);
  visit("linker.information_share", c.collection.linker.information_share);
  visit("graph.max_edges", c.collection.graph.max_edges);
  visit("graph.max_fill", c.collection.graph.max_fill);
}

/// The names of an enumeration's values, in order.
std::vector<std::string> names_of(RotationMode) { return {"rings", "linear_polar", "log_polar", "log_polar_scale"}; }
std::vector<std::string> names_of(HighPass) { return {"none", "radius", "reddy"}; }
std::vector<std::string> names_of(PeakFit) { return {"centre_of_mass", "gaussian"}; }
std::vector<std::string> names_of(Preprocessing) { return {"none", "erosion", "blur"}; }

template <class T>
void parse(const std::string& key, const std::string& value, T& field) {
  const auto refuse = [&](const std::string& expected) {
    throw std::invalid_argument(key + ": expected " + expected + ", found '" + value + "'");
  };
  const char* const first = value.data();
  const char* const last = first + value.size();
  if constexpr (std::is_same_v<T, bool>) {
    if (value == "true" || value == "1" || value == "on") {
      field = true;
    } else if (value == "false" || value == "0" || value == "off") {
      field = false;
    } else {
      refuse("true or false");
    }
  } else if constexpr (std::is_enum_v<T>) {
    const std::vector<std::string> names = names_of(T{});
    const auto at = std::find(names.begin(), names.end(), value);
    if (at == names.end()) {
      std::string all;
      for (const std::string& name : names) {
        all += (all.empty() ? "" : ", ") + name;
      }
      refuse("one of " + all);
    }
    field = static_cast<T>(at - names.begin());
  } else if constexpr (std::is_integral_v<T>) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(first, last, number);
    if (error != std::errc{} || end != last || number > std::numeric_limits<T>::max()) {
      refuse("a whole number from 0 to " + std::to_string(std::numeric_limits<T>::max()));
    }
    field = static_cast<T>(number);
  } else {
    double number = 0.0;
    const auto [end, error] = std::from_chars(first, last, number);
    if (error != std::errc{} || end != last || !std::isfinite(number)) {
      refuse("a number");
    }
    field = static_cast<T>(number);
  }
}

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

}  // namespace

Config profile_named(const std::string& name) {
  if (name == "desktop") {
    return desktop_profile();
  }
  if (name == "micro") {
    return micro_profile();
  }
  if (name == "nano") {
    return nano_profile();
  }
  throw std::invalid_argument("profile: expected desktop, micro or nano, found '" + name + "'");
}

void apply_setting(Config& config, const std::string& key, const std::string& value) {
  bool found = false;
  visit_settings(config, [&](const char* name, auto& field) {
    if (key == name) {
      parse(key, value, field);
      found = true;
    }
  });
  if (!found) {
    std::string names;
    visit_settings(config,
                   [&](const char* name, const auto&) { names += std::string(names.empty() ? "" : ", ") + name; });
    throw std::invalid_argument("no setting is called '" + key + "'; there are: " + names);
  }
}

void apply_setting(Config& config, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos) {
    throw std::invalid_argument("expected key=value, found '" + assignment + "'");
  }
  apply_setting(config, trimmed(assignment.substr(0, equals)), trimmed(assignment.substr(equals + 1)));
}

void apply_settings_file(Config& config, const std::string& path) {
  std::ifstream in(path);
  if (!in) {
    throw std::runtime_error(path + ": cannot be opened");
  }
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string text = trimmed(line.substr(0, line.find('#')));
    if (text.empty()) {
      continue;
    }
    try {
      apply_setting(config, text);
    } catch (const std::exception& error) {
      throw std::runtime_error(path + ":" + std::to_string(number) + ": " + error.what());
    }
  }
}

std::vector<std::pair<std::string, ConfigValue>> list_settings(const Config& config) {
  std::vector<std::pair<std::string, ConfigValue>> out;
  visit_settings(config, [&](const char* name, const auto& field) {
    using T = std::decay_t<decltype(field)>;
    if constexpr (std::is_same_v<T, bool>) {
      out.emplace_back(name, field);
    } else if constexpr (std::is_enum_v<T>) {
      out.emplace_back(name, names_of(field).at(static_cast<std::size_t>(field)));
    } else if constexpr (std::is_integral_v<T>) {
      out.emplace_back(name, static_cast<std::int64_t>(field));
    } else {
      out.emplace_back(name, static_cast<double>(field));
    }
  });
  return out;
}

}  // namespace mellin::host
