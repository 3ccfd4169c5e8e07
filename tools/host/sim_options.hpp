// What is simulated: the building, the drive, the laser, the odometry and the disturbances.
#pragma once

#include <cstdint>

#include "mellin/core/random.hpp"

namespace mellin::host {

enum class SimKind {
  ring,      ///< an office floor round a core, with smooth bends that tell nothing of the way along them
  offices,   ///< corridors that cross at right angles, rooms on both sides
  hall,      ///< one large exhibition hall: pillars, stands, outer walls far away
  corridor,  ///< a few very long corridors with doors at uneven distances and bare stretches
  flat,      ///< small cluttered rooms
  cave,      ///< tunnels with irregular curved walls, nothing rectangular
};

/// The way is read too long or short, the heading drifts, and both are noisy: presets for those four numbers.
enum class SimOdometry { good, plain, poor, slipping };

struct SimOptions {
  SimKind kind = SimKind::ring;
  std::uint64_t seed = 1;
  int sessions = 1;             ///< logs of the same floor: each starts elsewhere, in an odometry frame of its own
  double change = 0.0;          ///< share of the furniture and the doors that is changed from each session to the next
  int bare_bends = 1;           ///< ring: bends with smooth walls, 0 to 4; the others have pilasters
  int loops = 5;                ///< ring: times round it in a session
  double path_m = 300.0;        ///< other kinds: way that a session drives, at least
  int beams = 180;              ///< 180 or 181 (1 degree apart), 360 or 361 (half a degree), the first at -90 degrees
  double range_m = 12.0;        ///< reach of the laser
  double spacing_m = 0.2;       ///< path between scans
  double turn_rad = 0.2;        ///< turn between scans, where the robot turns on the spot
  double range_noise_m = 0.01;  ///< deviation of a range
  double no_return_share = 0.005;        ///< beams that come back empty at random
  double outlier_share = 0.002;          ///< beams that end early at random
  double scale_error = -0.04;            ///< odometry: share by which a way is read too long
  double turn_error_rad_per_m = -0.005;  ///< odometry: bias of the heading, a metre driven
  double way_noise = 0.03;               ///< odometry: deviation of a step's length, share of it
  double turn_noise_rad = 0.002;         ///< odometry: deviation of a step's turn

  // Disturbances; without them the drive is the same.
  int people = 0;              ///< that walk through the field of view at any time
  double glass_share = 0.0;    ///< pieces of wall that are of glass: most beams pass, few return, the rest is lost
  double missing_share = 0.0;  ///< scans with a third of their beams missing in one block
  int stops = 0;               ///< stands of a minute in which scans go on
  int pushes = 0;              ///< shoves of half a metre to the side that the wheels do not see
  int slips = 0;               ///< wheels that turn 0.5 to 1 m without any motion
  int kidnaps = 0;             ///< times that the robot is carried 10 m or more, unseen by the wheels
};

/// The options that suit a kind of building: its reach and its way, as real logs of such places have them.
SimOptions options_for(SimKind kind);

/// Sets the four numbers of the odometry. The signs of its two systematic errors come from the seed, and the noise is
/// of a metre driven, so set seed and spacing before.
void set_odometry(SimOptions& options, SimOdometry quality);

/// Throws std::invalid_argument where an option is outside its limits.
void check_options(const SimOptions& options, int session);

/// Streams of random numbers: each part of the simulation has its own, so that one does not shift the others. Sessions
/// count on from a stream's number.
enum class SimStream : std::uint64_t {
  rooms = 1,
  furniture = 2,
  bends = 3,
  signs = 4,
  rock = 5,
  glass = 6,
  change = 1000,
  drive = 1'000'000,
  laser = 2'000'000,
  wheels = 3'000'000,
  frame = 4'000'000,
  disturbances = 5'000'000,
  people = 6'000'000,
  missing = 7'000'000,
  panes = 8'000'000,
};

inline Random random_stream(const SimOptions& options, SimStream stream, int session = 0) {
  return {options.seed, static_cast<std::uint64_t>(stream) + static_cast<std::uint64_t>(session)};
}

}  // namespace mellin::host
