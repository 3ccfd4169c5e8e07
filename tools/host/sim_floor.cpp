#include "host/sim_floor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/sim_kinds.hpp"
#include "host/sim_room.hpp"

namespace mellin::host {
namespace {

void build(Floor& floor, const SimOptions& options) {
  switch (options.kind) {
    case SimKind::ring:
      return build_ring(floor, options);
    case SimKind::offices:
      return build_offices(floor, options);
    case SimKind::hall:
      return build_hall(floor, options);
    case SimKind::corridor:
      return build_corridor(floor, options);
    case SimKind::flat:
      return build_flat(floor, options);
    case SimKind::cave:
      return build_cave(floor, options);
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
      place_furniture(floor, random, floor.furniture[i]);
    } else {
      Door& door = floor.doors[i - floor.furniture.size()];
      door.open = !door.open;
    }
  }
}

/// Whether the segments cross: the ends of each lie on both sides of the other.
bool cross(const WallSegment& p, const WallSegment& q) {
  const auto left = [](const WallSegment& line, Point2 point) {
    return (line.b.x - line.a.x) * (point.y - line.a.y) - (line.b.y - line.a.y) * (point.x - line.a.x) > 0.0;
  };
  return left(p, q.a) != left(p, q.b) && left(q, p.a) != left(q, p.b);
}

double distance(const WallSegment& p, const WallSegment& q) {
  if (cross(p, q)) {
    return 0.0;
  }
  return std::min({host::distance(p, q.a), host::distance(p, q.b), host::distance(q, p.a), host::distance(q, p.b)});
}

}  // namespace

void add_wall(Floor& floor, const Pose2& frame, double x0, double y0, double x1, double y1) {
  floor.walls.push_back({transform(frame, x0, y0), transform(frame, x1, y1)});
}

int add_node(Floor& floor, Point2 at) {
  floor.nodes.push_back(at);
  return static_cast<int>(floor.nodes.size()) - 1;
}

std::vector<WallSegment> sides_of(const Furniture& box) {
  const double x = box.length_m / 2.0;
  const double y = box.width_m / 2.0;
  const Point2 corners[4] = {transform(box.world_T_box, -x, -y), transform(box.world_T_box, x, -y),
                             transform(box.world_T_box, x, y), transform(box.world_T_box, -x, y)};
  return {{corners[0], corners[1]}, {corners[1], corners[2]}, {corners[2], corners[3]}, {corners[3], corners[0]}};
}

double distance(const Furniture& box, const WallSegment& way) {
  const Pose2 start = between(box.world_T_box, {way.a.x, way.a.y, 0.0});
  if (std::fabs(start.x) <= box.length_m / 2.0 && std::fabs(start.y) <= box.width_m / 2.0) {
    return 0.0;  // the way begins inside
  }
  double least = HUGE_VAL;
  for (const WallSegment& side : sides_of(box)) {
    least = std::min(least, distance(side, way));
  }
  return least;
}

Floor make_floor(const SimOptions& options, int session) {
  check_options(options, session);
  Floor floor;
  build(floor, options);
  for (int k = 1; k <= session; ++k) {
    change_floor(floor, options.change, random_stream(options, SimStream::change, k));
  }
  return floor;
}

std::vector<WallSegment> obstacles(const Floor& floor) {
  std::vector<WallSegment> segments = floor.walls;
  for (const Door& door : floor.doors) {
    segments.push_back({door.hinge, door.open ? door.leaf_open : door.latch});
  }
  for (const Furniture& box : floor.furniture) {
    for (const WallSegment& side : sides_of(box)) {
      segments.push_back(side);
    }
  }
  return segments;
}

}  // namespace mellin::host
