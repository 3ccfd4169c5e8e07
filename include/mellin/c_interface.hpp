// Where the C interface (mellin.h) and the C++ one meet: for the one C++ file of a C firmware that sizes its memory at
// compile time, or sets what mellin_config does not name. Memory of the size that it takes, for `extern unsigned char
// slam_memory[];` in C:
//
//   constexpr mellin_config configuration() {
//     mellin_config config = mellin::c_config(MELLIN_PROFILE_MICRO);
//     config.lasers[0].beams = 180;
//     return config;
//   }
//   extern "C" {
//   extern const mellin_config slam_config = configuration();
//   alignas(MELLIN_ARENA_ALIGNMENT) unsigned char
//   slam_memory[mellin::required_bytes(mellin::config_of(configuration()))]; extern const std::size_t slam_memory_bytes
//   = sizeof slam_memory;
//   }
//
// And any setting at all: config_of(), then a field of mellin::Config, then Slam::create() and handle_of().
#pragma once

#include <cstddef>

#include "mellin/mellin.h"
#include "mellin/slam.hpp"

namespace mellin {

constexpr mellin_pose2 c_pose(const Pose2& pose) { return {pose.x, pose.y, pose.theta}; }
constexpr Pose2 pose_of(const mellin_pose2& pose) { return {pose.x, pose.y, pose.theta}; }

constexpr bool is_profile(mellin_profile profile) {
  return profile == MELLIN_PROFILE_DESKTOP || profile == MELLIN_PROFILE_MICRO || profile == MELLIN_PROFILE_NANO;
}

/// The profile of that name; the default configuration, which has no laser, where there is none.
constexpr Config profile_of(mellin_profile profile) {
  switch (profile) {
    case MELLIN_PROFILE_DESKTOP:
      return desktop_profile();
    case MELLIN_PROFILE_MICRO:
      return micro_profile();
    case MELLIN_PROFILE_NANO:
      return nano_profile();
    default:
      return {};
  }
}

constexpr mellin_laser c_laser(const LaserConfig& laser) {
  return {laser.beams,       laser.angle_min_rad, laser.angle_increment_rad,
          laser.min_range_m, laser.max_range_m,   c_pose(laser.base_T_laser)};
}
constexpr LaserConfig laser_of(const mellin_laser& laser) {
  return {laser.beams,       laser.angle_min_rad, laser.angle_increment_rad,
          laser.min_range_m, laser.max_range_m,   pose_of(laser.base_T_laser)};
}

/// What mellin_config_init() fills in.
constexpr mellin_config c_config(mellin_profile profile) {
  const Config p = profile_of(profile);
  const MotionNoise& noise = p.mapper.noise;
  mellin_config c = {};
  c.profile = profile;
  for (std::size_t i = 0; i < kMaxLasers; ++i) {
    c.lasers[i] = c_laser(p.lasers[i]);
  }
  c.noise = {noise.distance_base_m, noise.distance_per_m, noise.distance_per_rad,
             noise.angle_base_rad,  noise.angle_per_m,    noise.angle_per_rad};
  const OdometryModelConfig& odometry = p.mapper.odometry;
  c.odometry = {odometry.learn_bias,        odometry.learn_noise,         odometry.memory_scans, odometry.scale_sigma,
                odometry.angle_per_m_sigma, odometry.angle_per_rad_sigma, odometry.least_noise,  odometry.most_noise};
  c.seed = p.seed;
  c.cell_m = p.cell_m;
  c.side = p.side;
  c.screening_side = p.screening_side;
  c.registration_side = p.registration_side;
  c.class_side = p.class_side;
  c.particles = p.mapper.particles;
  c.remembered_scans = p.remembered_scans;
  c.spare_scans = p.mapper.spare_scans;
  c.take_distance_m = p.mapper.take_distance_m;
  c.take_angle_rad = p.mapper.take_angle_rad;
  c.submap_every_scans = p.submaps.every_scans;
  c.submap_every_path_m = p.submaps.every_path_m;
  c.submap_max_path_m = p.submaps.max_path_m;
  c.max_submaps = p.max_submaps;
  c.max_edges = p.collection.graph.max_edges;
  c.max_fill = p.collection.graph.max_fill;
  c.max_sessions = p.max_sessions;
  c.grid_slots = p.grid_slots;
  c.pending_hypotheses = p.collection.linker.pending;
  c.candidates = p.collection.candidates;
  c.cache_features = p.screening.cache_features;
  c.close_loops = p.collection.close_loops;
  return c;
}

/// The configuration that mellin_create() uses: the profile, and what `c` says over it.
constexpr Config config_of(const mellin_config& c) {
  Config p = profile_of(c.profile);
  if (!is_profile(c.profile)) {
    return p;
  }
  for (std::size_t i = 0; i < kMaxLasers; ++i) {
    p.lasers[i] = laser_of(c.lasers[i]);
  }
  p.mapper.noise = {c.noise.distance_base_m, c.noise.distance_per_m, c.noise.distance_per_rad,
                    c.noise.angle_base_rad,  c.noise.angle_per_m,    c.noise.angle_per_rad};
  p.mapper.odometry = {c.odometry.learn_bias,        c.odometry.learn_noise,         c.odometry.scale_sigma,
                       c.odometry.angle_per_m_sigma, c.odometry.angle_per_rad_sigma, c.odometry.memory_scans,
                       c.odometry.least_noise,       c.odometry.most_noise};
  p.seed = c.seed;
  p.cell_m = c.cell_m;
  p.side = c.side;
  p.screening_side = c.screening_side;
  p.registration_side = c.registration_side;
  p.class_side = c.class_side;
  p.mapper.particles = c.particles;
  p.remembered_scans = c.remembered_scans;
  p.mapper.spare_scans = c.spare_scans;
  p.mapper.take_distance_m = c.take_distance_m;
  p.mapper.take_angle_rad = c.take_angle_rad;
  p.submaps.every_scans = c.submap_every_scans;
  p.submaps.every_path_m = c.submap_every_path_m;
  p.submaps.max_path_m = c.submap_max_path_m;
  p.max_submaps = c.max_submaps;
  p.collection.graph.max_edges = c.max_edges;
  p.collection.graph.max_fill = c.max_fill;
  p.max_sessions = c.max_sessions;
  p.grid_slots = c.grid_slots;
  p.collection.linker.pending = c.pending_hypotheses;
  p.collection.candidates = c.candidates;
  p.screening.cache_features = c.cache_features;
  p.collection.close_loops = c.close_loops;
  return p;
}

/// A system as its handle in C, and back: the same object, so that either interface may be used on it at any time.
inline mellin_slam* handle_of(Slam& slam) { return reinterpret_cast<mellin_slam*>(&slam); }
inline Slam& slam_of(mellin_slam& slam) { return reinterpret_cast<Slam&>(slam); }
inline const Slam& slam_of(const mellin_slam& slam) { return reinterpret_cast<const Slam&>(slam); }

}  // namespace mellin
