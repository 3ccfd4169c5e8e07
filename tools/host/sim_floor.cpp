// The floor: ring, rooms, doors, furniture, and what changes from session to session.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "host/sim_ring.hpp"
#include "host/simulator.hpp"
#include "mellin/core/random.hpp"

namespace mellin::host {
namespace {

constexpr double kDoor_m = 0.95;
constexpr double kLane_m = 0.7;      // half of the free way into a room
constexpr double kWallStep_m = 0.4;  // of a bend's polygon: its corners stand out by 1.5 mm
constexpr double kWallBox_m = 0.35;  // depth of what stands at a corridor's wall

/// Streams of random numbers: each part of the floor has its own, so that one does not shift the others.
enum Stream : std::uint64_t { kRooms = 1, kFurniture = 2, kBends = 3, kChange = 1000 };

double between_limits(Random& random, double low, double high) { return low + (high - low) * random.uniform(); }

Point2 transform(const Pose2& a_T_b, double x, double y) {
  const Pose2 p = compose(a_T_b, {x, y, 0.0});
  return {p.x, p.y};
}

void add_wall(Floor& floor, const Pose2& frame, double x0, double y0, double x1, double y1) {
  floor.walls.push_back({transform(frame, x0, y0), transform(frame, x1, y1)});
}

/// Both walls of a bend.
void add_bend(Floor& floor, int side) {
  const double from = ring::side_start(side) + ring::side_length(side);
  const int steps = static_cast<int>(std::ceil(ring::kBend_m / kWallStep_m));
  for (const double y : {-ring::kHalfWidth_m, ring::kHalfWidth_m}) {
    for (int i = 0; i < steps; ++i) {
      const Pose2 a = ring::centre_line(from + ring::kBend_m * i / steps);
      const Pose2 b = ring::centre_line(from + ring::kBend_m * (i + 1) / steps);
      floor.walls.push_back({transform(a, 0.0, y), transform(b, 0.0, y)});
    }
  }
}

/// What makes a bend's walls more than bare: pilasters at uneven distances, so that every place looks its own way.
void add_pilasters(Floor& floor, int side, Random& random) {
  const double from = ring::side_start(side) + ring::side_length(side);
  for (const double wall : {-ring::kHalfWidth_m, ring::kHalfWidth_m}) {
    const double inwards = wall < 0.0 ? 1.0 : -1.0;
    double way = between_limits(random, 0.5, 2.0);
    while (way < ring::kBend_m - 1.1) {
      const Pose2 frame = ring::centre_line(from + way);
      const double width = between_limits(random, 0.5, 1.0);
      const double top = wall + inwards * between_limits(random, 0.3, 0.6);
      add_wall(floor, frame, 0.0, wall, 0.0, top);
      add_wall(floor, frame, 0.0, top, width, top);
      add_wall(floor, frame, width, top, width, wall);
      way += between_limits(random, 1.8, 3.5);
    }
  }
}

/// Puts a box of the given size at random into its place; false where it found no free spot.
bool place_furniture(const Place& place, Random& random, Furniture& box) {
  constexpr int kTries = 50;
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
      box.world_T_box = compose(place.world_T_place, {x, y, turn});
      return true;
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
    if (place_furniture(floor.places[static_cast<std::size_t>(place)], random, box)) {
      floor.furniture.push_back(box);
    }
  }
}

/// A room beside a stretch: its walls, its door, its furniture and what stands before it in the corridor. The frame
/// has x along the corridor's wall and y into the room; ring_at(x) is the way on the ring beside it.
struct RoomPlan {
  Pose2 frame;
  double length_m = 0.0;
  double ring_origin_m = 0.0;   ///< way on the ring at x = 0
  double ring_direction = 1.0;  ///< whether x runs with the ring
};

void add_door(Floor& floor, const RoomPlan& room, double centre, double depth, Random& random) {
  const bool hinge_first = random.uniform() < 0.5;
  const double hinge = centre + (hinge_first ? -0.5 : 0.5) * kDoor_m;
  const double latch = centre + (hinge_first ? 0.5 : -0.5) * kDoor_m;
  const SinCos leaf = sincos(kHalfPi + between_limits(random, -0.2, 0.2));
  Door door;
  door.ring_m = room.ring_origin_m + room.ring_direction * centre;
  door.hinge = transform(room.frame, hinge, 0.0);
  door.latch = transform(room.frame, latch, 0.0);
  door.leaf_open = transform(room.frame, hinge + kDoor_m * leaf.cos, kDoor_m * leaf.sin);
  door.inside = transform(room.frame, centre, std::min(depth - 1.0, 2.8));
  door.open = random.uniform() < 0.8;
  floor.doors.push_back(door);
}

void add_room(Floor& floor, const RoomPlan& room, Random& layout, Random& furniture) {
  const double depth = between_limits(layout, 3.5, 6.0);
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

/// The rooms of one wall of a stretch, of random widths.
void add_rooms(Floor& floor, int side, bool core, Random& layout, Random& furniture) {
  const double length = ring::side_length(side);
  const int count = side % 2 == 0 ? 3 : 2;
  const double start = ring::side_start(side);
  std::vector<double> cuts{0.0};
  for (int i = 1; i < count; ++i) {
    cuts.push_back(length * (i + between_limits(layout, -0.2, 0.2)) / count);
  }
  cuts.push_back(length);
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    RoomPlan room;
    room.length_m = cuts[i + 1] - cuts[i];
    room.ring_direction = core ? 1.0 : -1.0;
    const double along = core ? cuts[i] : cuts[i + 1];
    room.ring_origin_m = start + along;
    // centre_line() at the end of a stretch still has the stretch's heading.
    room.frame =
        compose(ring::centre_line(start), {along, core ? ring::kHalfWidth_m : -ring::kHalfWidth_m, core ? 0.0 : kPi});
    add_room(floor, room, layout, furniture);
  }
}

/// Moves a share of the furniture and turns a share of the doors (open to closed and back), chosen at random.
void change_floor(Floor& floor, double share, Random random) {
  const std::size_t count = floor.furniture.size() + floor.doors.size();
  std::vector<std::pair<std::uint64_t, std::size_t>> order;
  for (std::size_t i = 0; i < count; ++i) {
    order.emplace_back(random.bits(), i);
  }
  std::sort(order.begin(), order.end());
  order.resize(static_cast<std::size_t>(std::floor(share * static_cast<double>(count) + 0.5)));
  for (const auto& [key, i] : order) {
    if (i < floor.furniture.size()) {
      Furniture& box = floor.furniture[i];
      place_furniture(floor.places[static_cast<std::size_t>(box.place)], random, box);
    } else {
      Door& door = floor.doors[i - floor.furniture.size()];
      door.open = !door.open;
    }
  }
}

void check(bool good, const char* what) {
  if (!good) {
    throw std::invalid_argument(std::string("simulator: ") + what);
  }
}

void check_options(const SimOptions& o, int session) {
  check(o.sessions >= 1 && o.sessions <= 100, "expected 1 to 100 sessions");
  check(session >= 0 && session < o.sessions, "expected a session below the number of sessions");
  check(o.change >= 0.0 && o.change <= 1.0, "expected a share of change of 0 to 1");
  check(o.loops >= 1 && o.loops <= 50, "expected 1 to 50 loops");
  check(o.beams == 180 || o.beams == 360, "expected 180 or 360 beams");
  check(o.range_m >= 1.0 && o.range_m <= 79.0, "expected a range of 1 to 79 m");
  check(o.spacing_m >= 0.01 && o.spacing_m <= 2.0, "expected 0.01 to 2 m between scans");
  check(o.turn_rad >= 0.01 && o.turn_rad <= 1.0, "expected turns of 0.01 to 1 rad between scans");
  for (const double share : {o.no_return_share, o.outlier_share, o.way_noise}) {
    check(share >= 0.0 && share <= 1.0, "expected shares of 0 to 1");
  }
  check(o.bare_bends >= 0 && o.bare_bends <= ring::kSides, "expected 0 to 4 bare bends");
  check(o.range_noise_m >= 0.0 && o.range_noise_m <= 1.0, "expected a range noise of 0 to 1 m");
  check(o.turn_noise_rad >= 0.0 && o.turn_noise_rad <= 1.0, "expected a turn noise of 0 to 1 rad");
  check(std::fabs(o.scale_error) <= 0.5, "expected a scale error of -0.5 to 0.5");
  check(std::fabs(o.turn_error_rad_per_m) <= 0.5, "expected a turn error of -0.5 to 0.5 rad/m");
}

}  // namespace

Floor make_floor(const SimOptions& options, int session) {
  check_options(options, session);
  Floor floor;
  Random layout(options.seed, kRooms);
  Random furniture(options.seed, kFurniture);
  Random bends(options.seed, kBends);
  for (int side = 0; side < ring::kSides; ++side) {
    add_bend(floor, side);
    if (side >= options.bare_bends) {
      add_pilasters(floor, side, bends);
    }
    for (const bool core : {false, true}) {
      add_rooms(floor, side, core, layout, furniture);
    }
  }
  for (int k = 1; k <= session; ++k) {
    change_floor(floor, options.change, Random(options.seed, kChange + static_cast<std::uint64_t>(k)));
  }
  return floor;
}

std::vector<WallSegment> obstacles(const Floor& floor) {
  std::vector<WallSegment> segments = floor.walls;
  for (const Door& door : floor.doors) {
    segments.push_back({door.hinge, door.open ? door.leaf_open : door.latch});
  }
  for (const Furniture& box : floor.furniture) {
    const double x = box.length_m / 2.0;
    const double y = box.width_m / 2.0;
    const Point2 corners[4] = {transform(box.world_T_box, -x, -y), transform(box.world_T_box, x, -y),
                               transform(box.world_T_box, x, y), transform(box.world_T_box, -x, y)};
    for (int i = 0; i < 4; ++i) {
      segments.push_back({corners[i], corners[(i + 1) % 4]});
    }
  }
  return segments;
}

}  // namespace mellin::host
