// The floor of a simulated building: walls, rooms, doors, furniture, and the ways on which a robot can drive.
#pragma once

#include <vector>

#include "host/sim_geometry.hpp"
#include "host/sim_options.hpp"

namespace mellin::host {

/// A box in a room or at a corridor's wall.
struct Furniture {
  Pose2 world_T_box;      ///< its centre
  double length_m = 0.0;  ///< along its x axis
  double width_m = 0.0;
  int place = 0;  ///< index into Floor::places: what it may not leave when it is moved
};

/// Where furniture can stand: a rectangle; a strip across it, in line with the door, is kept free.
struct Place {
  Pose2 world_T_place;  ///< corner; along a corridor, x runs along its wall and y away from it
  double length_m = 0.0;
  double depth_m = 0.0;
  double lane_m = 0.0;  ///< half the width of the free strip in the line of the door
  double lane_centre_m = 0.0;
};

struct Door {
  double along_m = 0.0;  ///< where on the centre line of its corridor it lies
  Point2 hinge;          ///< on the corridor's wall
  Point2 latch;          ///< the other end of the opening
  Point2 leaf_open;      ///< end of the leaf when it is open, inside the room
  Point2 inside;         ///< where a visitor stops in the room
  bool open = true;
};

/// A straight way between two nodes that a robot can drive.
struct Way {
  static constexpr int kNoDoor = -1;

  int from = 0;
  int to = 0;
  double slack_m = 0.0;  ///< how far the robot may stray to either side
  double clear_m = 0.0;  ///< to either side, kept free of furniture
  int door = kNoDoor;    ///< index of the door that it goes through: it ends in that door's room
};

struct Floor {
  std::vector<WallSegment> walls;  ///< what never changes
  std::vector<Place> places;
  std::vector<Furniture> furniture;
  std::vector<Door> doors;
  std::vector<Point2> nodes;  ///< where ways meet; none on the ring, whose way is its centre line
  std::vector<Way> ways;
};

/// The floor of session 0, or what it has become by a later one. Throws std::invalid_argument where an option is
/// outside its limits.
Floor make_floor(const SimOptions& options, int session);

/// Everything that a laser can hit now: walls, closed doors, leaves of open ones, furniture.
std::vector<WallSegment> obstacles(const Floor& floor);

/// A piece of wall, from (x0, y0) to (x1, y1) of a frame.
void add_wall(Floor& floor, const Pose2& world_T_frame, double x0, double y0, double x1, double y1);

/// Adds a node; returns its index.
int add_node(Floor& floor, Point2 at);

/// The four sides of a box.
std::vector<WallSegment> sides_of(const Furniture& box);

/// Distance between a box and a way's centre line, m; 0 where the way crosses it.
double distance(const Furniture& box, const WallSegment& way);

}  // namespace mellin::host
