// A flat: small rooms full of furniture, with open doorways from room to room.
#include <algorithm>
#include <numeric>
#include <utility>

#include "host/sim_kinds.hpp"
#include "host/sim_room.hpp"

namespace mellin::host {
namespace {

constexpr double kDoorway_m = 0.95;
constexpr double kJamb_m = 0.6;   // before and behind a doorway the robot drives straight
constexpr double kClear_m = 0.5;  // of a way, to either side
constexpr double kSlack_m = 0.1;
constexpr double kMoreDoorways = 0.3;  // of the walls that the way to every room does not need

/// A wall between two rooms; x of the frame runs along it, y out of room a into room b.
struct Partition {
  int a = 0;
  int b = 0;
  Pose2 frame;
  double length_m = 0.0;
};

/// Walls between rooms that lie side by side: rooms[j * columns + i] lies between xs[i], xs[i + 1], ys[j], ys[j + 1].
std::vector<Partition> partitions(const std::vector<double>& xs, const std::vector<double>& ys) {
  std::vector<Partition> walls;
  const std::size_t columns = xs.size() - 1;
  for (std::size_t j = 0; j + 1 < ys.size(); ++j) {
    for (std::size_t i = 0; i < columns; ++i) {
      const int room = static_cast<int>(j * columns + i);
      if (i > 0) {
        walls.push_back({room - 1, room, {xs[i], ys[j + 1], -kHalfPi}, ys[j + 1] - ys[j]});
      }
      if (j > 0) {
        walls.push_back({room - static_cast<int>(columns), room, {xs[i], ys[j], 0.0}, xs[i + 1] - xs[i]});
      }
    }
  }
  return walls;
}

void add_doorway(Floor& floor, const Partition& wall, Random& layout) {
  const double at = between_limits(layout, 0.3, 0.7) * wall.length_m;
  add_wall(floor, wall.frame, 0.0, 0.0, at - kDoorway_m / 2.0, 0.0);
  add_wall(floor, wall.frame, at + kDoorway_m / 2.0, 0.0, wall.length_m, 0.0);
  const int before = add_node(floor, transform(wall.frame, at, -kJamb_m));
  const int behind = add_node(floor, transform(wall.frame, at, kJamb_m));
  floor.ways.push_back({wall.a, before, kSlack_m, kClear_m, Way::kNoDoor});
  floor.ways.push_back({before, behind, kSlack_m, kClear_m, Way::kNoDoor});
  floor.ways.push_back({behind, wall.b, kSlack_m, kClear_m, Way::kNoDoor});
}

/// Doorways in random walls, so that each room can be reached from each (Kruskal 1956), and in some more.
void add_partitions(Floor& floor, std::vector<Partition> walls, int rooms, Random& layout) {
  std::vector<std::pair<std::uint64_t, std::size_t>> order;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    order.emplace_back(layout.bits(), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<int> group(static_cast<std::size_t>(rooms));
  std::iota(group.begin(), group.end(), 0);
  for (const auto& [key, i] : order) {
    const Partition& wall = walls[i];
    const int joined = group[static_cast<std::size_t>(wall.b)];
    const int into = group[static_cast<std::size_t>(wall.a)];
    const bool more = layout.uniform() < kMoreDoorways;
    if (joined != into || more) {
      add_doorway(floor, wall, layout);
      std::replace(group.begin(), group.end(), joined, into);
    } else {
      add_wall(floor, wall.frame, 0.0, 0.0, wall.length_m, 0.0);
    }
  }
}

std::vector<double> lines(int rooms, Random& layout) {
  std::vector<double> at{0.0};
  for (int i = 0; i < rooms; ++i) {
    at.push_back(at.back() + between_limits(layout, 3.0, 4.8));
  }
  return at;
}

}  // namespace

void build_flat(Floor& floor, const SimOptions& options) {
  Random layout = random_stream(options, SimStream::rooms);
  Random furniture = random_stream(options, SimStream::furniture);
  const std::vector<double> xs = lines(3 + static_cast<int>(2.0 * layout.uniform()), layout);
  const std::vector<double> ys = lines(3, layout);
  const Pose2 origin;
  add_wall(floor, origin, 0.0, 0.0, xs.back(), 0.0);
  add_wall(floor, origin, xs.back(), 0.0, xs.back(), ys.back());
  add_wall(floor, origin, xs.back(), ys.back(), 0.0, ys.back());
  add_wall(floor, origin, 0.0, ys.back(), 0.0, 0.0);
  for (std::size_t j = 0; j + 1 < ys.size(); ++j) {
    for (std::size_t i = 0; i + 1 < xs.size(); ++i) {
      const double x = 0.5 * (xs[i] + xs[i + 1]) + between_limits(layout, -0.3, 0.3);
      const double y = 0.5 * (ys[j] + ys[j + 1]) + between_limits(layout, -0.3, 0.3);
      add_node(floor, {x, y});
      const double length = xs[i + 1] - xs[i];
      floor.places.push_back({{xs[i], ys[j], 0.0}, length, ys[j + 1] - ys[j], 0.0, -length});
    }
  }
  const int rooms = static_cast<int>(floor.places.size());
  add_partitions(floor, partitions(xs, ys), rooms, layout);
  for (int room = 0; room < rooms; ++room) {
    furnish(floor, room, 5 + static_cast<int>(5.0 * furniture.uniform()), 0.3, 1.4, furniture);
  }
}

}  // namespace mellin::host
