// Offices: corridors that cross at right angles, with rooms on both sides.
#include "host/sim_kinds.hpp"
#include "host/sim_room.hpp"
#include "host/sim_streets.hpp"

namespace mellin::host {
namespace {

constexpr double kHalfWidth_m = 1.1;
constexpr double kRoom_m = 5.0;  // width of a room, about
constexpr double kSlack_m = 0.15;

/// Where parallel corridors run.
std::vector<double> lines(int count, Random& layout) {
  std::vector<double> at{0.0};
  for (int i = 1; i < count; ++i) {
    at.push_back(at.back() + between_limits(layout, 10.5, 16.0));
  }
  return at;
}

}  // namespace

void build_offices(Floor& floor, const SimOptions& options) {
  Random layout = random_stream(options, SimStream::rooms);
  Random furniture = random_stream(options, SimStream::furniture);
  const std::vector<double> xs = lines(layout.uniform() < 0.5 ? 3 : 2, layout);
  const std::vector<double> ys = lines(3, layout);
  const Streets streets(floor, xs, ys, kHalfWidth_m);
  std::vector<int> door_spans;
  for (const Streets::Wall& wall : streets.walls()) {
    if (!wall.outside && !wall.across) {
      continue;  // the blocks' other walls are the side walls of these rooms
    }
    const int count = static_cast<int>(wall.length_m / kRoom_m + 0.5);
    const std::vector<double> cuts = cut_wall(wall.length_m, count, layout);
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
      RoomPlan room;
      room.frame = compose(wall.frame, {cuts[i], 0.0, 0.0});
      room.length_m = cuts[i + 1] - cuts[i];
      room.along_direction = Streets::along_direction(wall);
      room.along_origin_m = streets.along_origin(wall) + room.along_direction * cuts[i];
      const double depth = wall.outside ? between_limits(layout, 3.5, 6.0) : wall.behind_m / 2.0;
      add_room(floor, room, depth, layout, furniture);
      door_spans.push_back(wall.span);
    }
  }
  streets.add_ways(floor, door_spans, kSlack_m);
}

}  // namespace mellin::host
