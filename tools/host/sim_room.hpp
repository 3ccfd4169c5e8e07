// Rooms beside a corridor, with a door and furniture.
#pragma once

#include "host/sim_floor.hpp"

namespace mellin::host {

/// A room beside a corridor. The frame has x along the corridor's wall and y into the room.
struct RoomPlan {
  Pose2 frame;
  double length_m = 0.0;
  double along_origin_m = 0.0;   ///< on the corridor's centre line, at x = 0
  double along_direction = 1.0;  ///< whether x runs with the centre line
};

/// Its walls, its door, its furniture and what stands before it in the corridor.
void add_room(Floor& floor, const RoomPlan& room, double depth_m, Random& layout, Random& furniture);

/// Cuts a wall of this length into `count` rooms of random widths: where they begin and end.
std::vector<double> cut_wall(double length_m, int count, Random& layout);

/// Puts a box of the given size at random into its place and off the ways; false where it found no free spot.
bool place_furniture(const Floor& floor, Random& random, Furniture& box);

/// Tries `count` boxes with sides between the limits; what finds no spot is left out.
void furnish(Floor& floor, int place, int count, double least_m, double most_m, Random& random);

}  // namespace mellin::host
