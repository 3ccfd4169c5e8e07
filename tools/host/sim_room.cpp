#include "host/sim_room.hpp"

#include <algorithm>
#include <cmath>

namespace mellin::host {
namespace {

constexpr double kDoor_m = 0.95;
constexpr double kLane_m = 0.7;      // half of the free way into a room
constexpr double kWallBox_m = 0.35;  // depth of what stands at a corridor's wall

bool clear_of_ways(const Floor& floor, const Furniture& box) {
  return std::all_of(floor.ways.begin(), floor.ways.end(), [&](const Way& way) {
    const WallSegment line{floor.nodes[static_cast<std::size_t>(way.from)],
                           floor.nodes[static_cast<std::size_t>(way.to)]};
    return distance(box, line) >= way.clear_m;
  });
}

void add_door(Floor& floor, const RoomPlan& room, double centre, double depth, Random& random) {
  const bool hinge_first = random.uniform() < 0.5;
  const double hinge = centre + (hinge_first ? -0.5 : 0.5) * kDoor_m;
  const double latch = centre + (hinge_first ? 0.5 : -0.5) * kDoor_m;
  const SinCos leaf = sincos(kHalfPi + between_limits(random, -0.2, 0.2));
  Door door;
  door.along_m = room.along_origin_m + room.along_direction * centre;
  door.hinge = transform(room.frame, hinge, 0.0);
  door.latch = transform(room.frame, latch, 0.0);
  door.leaf_open = transform(room.frame, hinge + kDoor_m * leaf.cos, kDoor_m * leaf.sin);
  door.inside = transform(room.frame, centre, std::min(depth - 1.0, 2.8));
  door.open = random.uniform() < 0.8;
  floor.doors.push_back(door);
}

}  // namespace

bool place_furniture(const Floor& floor, Random& random, Furniture& box) {
  constexpr int kTries = 50;
  const Place& place = floor.places[static_cast<std::size_t>(box.place)];
  for (int i = 0; i < kTries; ++i) {
    double turn = random.uniform() < 0.5 ? 0.0 : kHalfPi;
    turn += random.uniform() < 0.3 ? between_limits(random, -0.5, 0.5) : 0.0;
    const SinCos r = sincos(turn);
    const double half_x = (std::fabs(box.length_m * r.cos) + std::fabs(box.width_m * r.sin)) / 2.0;
    const double half_y = (std::fabs(box.length_m * r.sin) + std::fabs(box.width_m * r.cos)) / 2.0;
    const double x = half_x + random.uniform() * (place.length_m - 2.0 * half_x);
    const double y = half_y + random.uniform() * (place.depth_m - 2.0 * half_y);
    const bool inside = half_x * 2.0 <= place.length_m && half_y * 2.0 <= place.depth_m;
    if (inside && std::fabs(x - place.lane_centre_m) >= place.lane_m + half_x) {
      Furniture moved = box;
      moved.world_T_box = compose(place.world_T_place, {x, y, turn});
      if (clear_of_ways(floor, moved)) {
        box = moved;
        return true;
      }
    }
  }
  return false;
}

void furnish(Floor& floor, int place, int count, double least_m, double most_m, Random& random) {
  for (int i = 0; i < count; ++i) {
    Furniture box;
    box.place = place;
    box.length_m = between_limits(random, least_m, most_m);
    box.width_m = between_limits(random, least_m, 0.5 * (least_m + most_m));
    if (place_furniture(floor, random, box)) {
      floor.furniture.push_back(box);
    }
  }
}

void add_room(Floor& floor, const RoomPlan& room, double depth, Random& layout, Random& furniture) {
  const double door = between_limits(layout, 0.25, 0.75) * room.length_m;
  add_wall(floor, room.frame, 0.0, 0.0, door - kDoor_m / 2.0, 0.0);
  add_wall(floor, room.frame, door + kDoor_m / 2.0, 0.0, room.length_m, 0.0);
  add_wall(floor, room.frame, 0.0, 0.0, 0.0, depth);
  add_wall(floor, room.frame, 0.0, depth, room.length_m, depth);
  add_wall(floor, room.frame, room.length_m, 0.0, room.length_m, depth);
  add_door(floor, room, door, depth, layout);
  if (layout.uniform() < 0.4) {  // a pilaster on the corridor's wall
    const double at = door + (layout.uniform() < 0.5 ? -1.2 : 0.9);
    add_wall(floor, room.frame, at, 0.0, at, -0.2);
    add_wall(floor, room.frame, at, -0.2, at + 0.3, -0.2);
    add_wall(floor, room.frame, at + 0.3, -0.2, at + 0.3, 0.0);
  }
  floor.places.push_back({room.frame, room.length_m, depth, kLane_m, door});
  furnish(floor, static_cast<int>(floor.places.size()) - 1, 3 + static_cast<int>(4.0 * furniture.uniform()), 0.4, 1.4,
          furniture);
  const double strip = room.length_m - door - 1.5;
  if (strip > 0.8 && furniture.uniform() < 0.5) {
    floor.places.push_back({compose(room.frame, {door + 1.4, -kWallBox_m, 0.0}), strip, kWallBox_m, 0.0, -strip});
    furnish(floor, static_cast<int>(floor.places.size()) - 1, 1, 0.2, 0.34, furniture);
  }
}

std::vector<double> cut_wall(double length_m, int count, Random& layout) {
  std::vector<double> cuts{0.0};
  for (int i = 1; i < count; ++i) {
    cuts.push_back(length_m * (i + between_limits(layout, -0.2, 0.2)) / count);
  }
  cuts.push_back(length_m);
  return cuts;
}

}  // namespace mellin::host
