// An exhibition hall: outer walls far apart, and pillars and stands between the aisles.
#include <cmath>

#include "host/sim_kinds.hpp"
#include "host/sim_room.hpp"

namespace mellin::host {
namespace {

constexpr double kPitch_m = 7.0;  // from an aisle to the next
constexpr double kClear_m = 1.0;  // of an aisle, to either side
constexpr double kSlack_m = 0.5;
constexpr double kGate_m = 4.0;

/// The outer wall, with gates that stand back at random places.
void add_outer_wall(Floor& floor, const Pose2& corner, double length_m, Random& layout) {
  double from = 0.0;
  double at = between_limits(layout, 3.0, 12.0);
  while (at < length_m - kGate_m - 1.0) {
    const double depth = between_limits(layout, 0.3, 1.2);
    add_wall(floor, corner, from, 0.0, at, 0.0);
    add_wall(floor, corner, at, 0.0, at, -depth);
    add_wall(floor, corner, at, -depth, at + kGate_m, -depth);
    add_wall(floor, corner, at + kGate_m, -depth, at + kGate_m, 0.0);
    from = at + kGate_m;
    at = from + between_limits(layout, 4.0, 20.0);
  }
  add_wall(floor, corner, from, 0.0, length_m, 0.0);
}

/// A stand with an open front and a desk in it.
void add_booth(Floor& floor, const Pose2& centre, double half_m) {
  add_wall(floor, centre, -half_m, -half_m, half_m, -half_m);
  add_wall(floor, centre, -half_m, -half_m, -half_m, half_m);
  add_wall(floor, centre, half_m, -half_m, half_m, 0.3 * half_m);
  add_wall(floor, centre, -0.4 * half_m, 0.0, 0.3 * half_m, 0.0);
}

void add_pillar(Floor& floor, const Pose2& centre, double half_m) {
  add_wall(floor, centre, -half_m, -half_m, half_m, -half_m);
  add_wall(floor, centre, half_m, -half_m, half_m, half_m);
  add_wall(floor, centre, half_m, half_m, -half_m, half_m);
  add_wall(floor, centre, -half_m, half_m, -half_m, -half_m);
}

/// What stands in a block between four aisles.
void fill_block(Floor& floor, Point2 corner, Random& layout, Random& furniture) {
  const double kind = layout.uniform();
  const double quarter = std::floor(4.0 * layout.uniform()) * kHalfPi;
  const Pose2 centre{corner.x + kPitch_m / 2.0 + between_limits(layout, -0.4, 0.4),
                     corner.y + kPitch_m / 2.0 + between_limits(layout, -0.4, 0.4), wrap_angle(quarter)};
  if (kind < 0.3) {
    add_booth(floor, centre, between_limits(layout, 1.2, 1.9));
  } else if (kind < 0.5) {
    add_pillar(floor, centre, between_limits(layout, 0.25, 0.45));
  } else if (kind < 0.75) {
    floor.places.push_back({{corner.x + kClear_m, corner.y + kClear_m, 0.0},
                            kPitch_m - 2.0 * kClear_m,
                            kPitch_m - 2.0 * kClear_m,
                            0.0,
                            -kPitch_m});
    furnish(floor, static_cast<int>(floor.places.size()) - 1, 3, 0.6, 2.2, furniture);
  }
}

}  // namespace

void build_hall(Floor& floor, const SimOptions& options) {
  Random layout = random_stream(options, SimStream::rooms);
  Random furniture = random_stream(options, SimStream::furniture);
  const int columns = 7 + static_cast<int>(4.0 * layout.uniform());
  const int rows = 4 + static_cast<int>(3.0 * layout.uniform());
  const double length = columns * kPitch_m;
  const double width = rows * kPitch_m;
  add_outer_wall(floor, {0.0, 0.0, 0.0}, length, layout);
  add_outer_wall(floor, {length, 0.0, kHalfPi}, width, layout);
  add_outer_wall(floor, {length, width, kPi}, length, layout);
  add_outer_wall(floor, {0.0, width, -kHalfPi}, width, layout);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int node = add_node(floor, {(i + 0.5) * kPitch_m, (j + 0.5) * kPitch_m});
      if (i > 0) {
        floor.ways.push_back({node - 1, node, kSlack_m, kClear_m, Way::kNoDoor});
      }
      if (j > 0) {
        floor.ways.push_back({node - columns, node, kSlack_m, kClear_m, Way::kNoDoor});
      }
    }
  }
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      fill_block(floor, {(i + 0.5) * kPitch_m, (j + 0.5) * kPitch_m}, layout, furniture);
    }
  }
}

}  // namespace mellin::host
