// The ring floor: four stretches with rooms on both sides, four bends.
#include <cmath>

#include "host/sim_kinds.hpp"
#include "host/sim_ring.hpp"
#include "host/sim_room.hpp"

namespace mellin::host {
namespace {

constexpr double kWallStep_m = 0.4;  // of a bend's polygon: its corners stand out by 1.5 mm

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

/// The rooms of one wall of a stretch, of random widths.
void add_rooms(Floor& floor, int side, bool core, Random& layout, Random& furniture) {
  const double length = ring::side_length(side);
  const int count = side % 2 == 0 ? 3 : 2;
  const double start = ring::side_start(side);
  const std::vector<double> cuts = cut_wall(length, count, layout);
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    RoomPlan room;
    room.length_m = cuts[i + 1] - cuts[i];
    room.along_direction = core ? 1.0 : -1.0;
    const double along = core ? cuts[i] : cuts[i + 1];
    room.along_origin_m = start + along;
    // centre_line() at the end of a stretch still has the stretch's heading.
    room.frame =
        compose(ring::centre_line(start), {along, core ? ring::kHalfWidth_m : -ring::kHalfWidth_m, core ? 0.0 : kPi});
    const double depth = between_limits(layout, 3.5, 6.0);
    add_room(floor, room, depth, layout, furniture);
  }
}

}  // namespace

void build_ring(Floor& floor, const SimOptions& options) {
  Random layout = random_stream(options, SimStream::rooms);
  Random furniture = random_stream(options, SimStream::furniture);
  Random bends = random_stream(options, SimStream::bends);
  for (int side = 0; side < ring::kSides; ++side) {
    add_bend(floor, side);
    if (side >= options.bare_bends) {
      add_pilasters(floor, side, bends);
    }
    for (const bool core : {false, true}) {
      add_rooms(floor, side, core, layout, furniture);
    }
  }
}

}  // namespace mellin::host
