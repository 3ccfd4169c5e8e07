// A simulated office floor, a robot that drives through it, its laser and its bad odometry: logs with exact truth.
//
// The floor is a ring corridor round a core. Four wide bends join four straight stretches with rooms, doors and
// furniture on both sides. One bend or more have smooth, bare walls. In such a bend a laser cannot tell how far along
// the robot is (an annulus looks the same everywhere), and moving along it turns the robot, so that the odometry's
// scale error becomes an error of heading there that no scan matcher corrects: only recognising a place does.
//
// The same options give the same bytes on every machine (mellin::Random, mellin::sincos, no libm).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mellin/core/se2.hpp"

namespace mellin::host {

struct SimOptions {
  std::uint64_t seed = 1;
  int sessions = 1;             ///< logs of the same floor: each starts elsewhere, in an odometry frame of its own
  double change = 0.0;          ///< share of the furniture and the doors that is changed from each session to the next
  int bare_bends = 1;           ///< bends with smooth walls, 0 to 4; the others have pilasters
  int loops = 5;                ///< times round the ring in a session
  int beams = 180;              ///< 180 (1 degree apart) or 360 (half a degree), the first at -90 degrees
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
};

struct Point2 {
  double x = 0.0;
  double y = 0.0;
};

/// A piece of wall.
struct WallSegment {
  Point2 a;
  Point2 b;
};

/// A box in a room or at a corridor's wall.
struct Furniture {
  Pose2 world_T_box;      ///< its centre
  double length_m = 0.0;  ///< along its x axis
  double width_m = 0.0;
  int place = 0;  ///< index into Floor::places: what it may not leave when it is moved
};

/// Where furniture can stand: a rectangle along a straight stretch of the ring; `lane`s are kept free.
struct Place {
  Pose2 world_T_place;  ///< corner; x along the stretch, y away from the ring's centre line
  double length_m = 0.0;
  double depth_m = 0.0;
  double lane_m = 0.0;  ///< half the width of the free strip in the line of the door
  double lane_centre_m = 0.0;
};

struct Door {
  double ring_m = 0.0;  ///< where on the ring's centre line it lies
  Point2 hinge;         ///< on the corridor's wall
  Point2 latch;         ///< the other end of the opening
  Point2 leaf_open;     ///< end of the leaf when it is open, inside the room
  Point2 inside;        ///< where a visitor stops in the room
  bool open = true;
};

struct Floor {
  std::vector<WallSegment> walls;  ///< what never changes
  std::vector<Place> places;
  std::vector<Furniture> furniture;
  std::vector<Door> doors;
};

struct SimScan {
  double seconds = 0.0;
  Pose2 world_T_base;         ///< truth
  Pose2 odometry_T_base;      ///< what the wheels say
  std::vector<float> ranges;  ///< m, rounded to centimetres; no_return_value() where nothing was hit
};

struct SimSession {
  std::vector<SimScan> scans;
  double path_m = 0.0;  ///< true way driven
};

/// The floor of session 0, or what it has become by a later one. Throws std::invalid_argument where an option is
/// outside its limits.
Floor make_floor(const SimOptions& options, int session);

/// Everything that a laser can hit now: walls, closed doors, leaves of open ones, furniture.
std::vector<WallSegment> obstacles(const Floor& floor);

/// Distance [m] from (x, y) along `angle_rad` to the first of the segments; reach_m where none is nearer.
double cast_ray(const std::vector<WallSegment>& segments, Point2 from, double angle_rad, double reach_m);

/// What a log says where a beam hit nothing: a little beyond the reach, as real sensors do, in whole centimetres.
double no_return_value(const SimOptions& options);

/// Drives one session. Deterministic in (options, session).
SimSession simulate(const SimOptions& options, int session);

/// Writes DIRECTORY/sim-K.log (CARMEN FLASER lines) and DIRECTORY/sim-K.tum (the truth of every scan, in the frame of
/// the floor, the same for all sessions) for K = 0 … sessions - 1; returns the paths of the logs. Throws
/// std::runtime_error where a file cannot be written.
std::vector<std::string> write_simulation(const SimOptions& options, const std::string& directory);

}  // namespace mellin::host
