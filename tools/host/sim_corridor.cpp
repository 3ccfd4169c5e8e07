// Very long corridors: two loops of some 300 m that share one side, with niches at uneven distances and bare stretches.
#include <algorithm>

#include "host/sim_kinds.hpp"
#include "host/sim_streets.hpp"

namespace mellin::host {
namespace {

constexpr double kHalfWidth_m = 1.2;
constexpr double kSlack_m = 0.3;
constexpr double kBareEvery_m = 40.0;  // about so far apart are the bare stretches of a span

struct Stretch {
  double from_m = 0.0;
  double to_m = 0.0;
};

/// Stretches of 10 to 20 m of a span that are bare on both sides.
std::vector<Stretch> bare_stretches(double length_m, Random& layout) {
  std::vector<Stretch> bare;
  double along = between_limits(layout, 5.0, kBareEvery_m);
  while (along < length_m) {
    bare.push_back({along, along + between_limits(layout, 10.0, 20.0)});
    along += between_limits(layout, 0.7, 1.3) * kBareEvery_m;
  }
  return bare;
}

/// A wall with niches (doors that stay closed) and pilasters, but for the bare stretches.
void add_long_wall(Floor& floor, const Streets& streets, const Streets::Wall& wall, const std::vector<Stretch>& bare,
                   Random& layout) {
  double plain_from = 0.0;
  double at = between_limits(layout, 0.5, 4.0);
  while (at < wall.length_m - 2.0) {
    const double width = layout.uniform() < 0.7 ? 0.95 : between_limits(layout, 0.3, 0.8);
    const double depth = layout.uniform() < 0.7 ? between_limits(layout, 0.1, 0.35) : -between_limits(layout, 0.1, 0.3);
    const double along = streets.along_origin(wall) + Streets::along_direction(wall) * at;
    const bool in_bare = std::any_of(
        bare.begin(), bare.end(), [along](const Stretch& s) { return along > s.from_m - 1.0 && along < s.to_m + 1.0; });
    if (!in_bare) {
      add_wall(floor, wall.frame, plain_from, 0.0, at, 0.0);
      add_wall(floor, wall.frame, at, 0.0, at, depth);
      add_wall(floor, wall.frame, at, depth, at + width, depth);
      add_wall(floor, wall.frame, at + width, depth, at + width, 0.0);
      plain_from = at + width;
    }
    at += width + between_limits(layout, 1.0, 7.0);
  }
  add_wall(floor, wall.frame, plain_from, 0.0, wall.length_m, 0.0);
}

}  // namespace

void build_corridor(Floor& floor, const SimOptions& options) {
  Random layout = random_stream(options, SimStream::rooms);
  const double middle = between_limits(layout, 85.0, 115.0);
  const std::vector<double> xs{0.0, middle, middle + between_limits(layout, 75.0, 105.0)};
  const std::vector<double> ys{0.0, between_limits(layout, 45.0, 75.0)};
  const Streets streets(floor, xs, ys, kHalfWidth_m);
  std::vector<std::vector<Stretch>> bare;
  for (const Streets::Span& span : streets.spans()) {
    bare.push_back(bare_stretches(span.length_m, layout));
  }
  for (const Streets::Wall& wall : streets.walls()) {
    add_long_wall(floor, streets, wall, bare[static_cast<std::size_t>(wall.span)], layout);
  }
  streets.add_ways(floor, {}, kSlack_m);
}

}  // namespace mellin::host
