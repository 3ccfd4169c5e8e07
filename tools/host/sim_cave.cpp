// A cave: winding tunnels that meet, with walls of irregular width and not one straight line.
#include <algorithm>
#include <cmath>

#include "host/sim_kinds.hpp"

namespace mellin::host {
namespace {

constexpr int kMeetings = 4;          // of tunnels, along each side
constexpr double kPitch_m = 11.0;     // from one to the next, about
constexpr double kPiece_m = 1.0;      // of a tunnel's polygon
constexpr double kBend_m = 1.6;       // how far a tunnel winds to the side
constexpr double kLeastHalf_m = 1.1;  // half of the narrowest tunnel
constexpr double kMoreHalf_m = 1.7;
constexpr double kSlack_m = 0.25;
constexpr double kRock_m = 2.2;   // size of the walls' bulges
constexpr double kCell_m = 0.3;   // of the grid on which the walls are found
constexpr double kTunnels = 0.8;  // share of the neighbouring meetings that have a tunnel between them

/// Smooth noise in [0, 1]: random values at the corners of a grid, with smooth steps between them (value noise).
class Rock {
 public:
  explicit Rock(std::uint64_t seed) : seed_(seed) {}

  double at(Point2 p) const {
    const double x = p.x / kRock_m;
    const double y = p.y / kRock_m;
    const double i = std::floor(x);
    const double j = std::floor(y);
    const double u = smooth(x - i);
    const double v = smooth(y - j);
    const double low = corner(i, j) + u * (corner(i + 1.0, j) - corner(i, j));
    const double high = corner(i, j + 1.0) + u * (corner(i + 1.0, j + 1.0) - corner(i, j + 1.0));
    return low + v * (high - low);
  }

 private:
  static double smooth(double t) { return t * t * (3.0 - 2.0 * t); }

  double corner(double i, double j) const {
    const auto column = static_cast<std::uint64_t>(static_cast<std::int64_t>(i));
    const auto row = static_cast<std::uint64_t>(static_cast<std::int64_t>(j));
    return Random(seed_ ^ mix64(column), row).uniform();
  }

  std::uint64_t seed_;
};

/// Winds from one node to another.
void add_tunnel(Floor& floor, int from, int to, Random& layout) {
  const Point2 a = floor.nodes[static_cast<std::size_t>(from)];
  const Point2 b = floor.nodes[static_cast<std::size_t>(to)];
  const double length = distance(a, b);
  const int pieces = static_cast<int>(length / kPiece_m);
  const double bend = between_limits(layout, -kBend_m, kBend_m);
  const double turns = layout.uniform() < 0.5 ? 1.0 : 2.0;
  int last = from;
  for (int i = 1; i <= pieces; ++i) {
    const double share = static_cast<double>(i) / pieces;
    const double aside = bend * sincos(turns * kPi * share).sin;
    const Point2 at = between_points(a, b, share);
    const int next =
        i == pieces ? to : add_node(floor, {at.x - aside * (b.y - a.y) / length, at.y + aside * (b.x - a.x) / length});
    floor.ways.push_back({last, next, kSlack_m, kLeastHalf_m, Way::kNoDoor});
    last = next;
  }
}

/// The tunnels between neighbouring meetings: all along the first row and up each column, so that none is cut off, and
/// some of the others.
void add_tunnels(Floor& floor, Random& layout) {
  for (int j = 0; j < kMeetings; ++j) {
    for (int i = 0; i < kMeetings; ++i) {
      add_node(floor,
               {kPitch_m * i + between_limits(layout, -2.0, 2.0), kPitch_m * j + between_limits(layout, -2.0, 2.0)});
    }
  }
  for (int j = 0; j < kMeetings; ++j) {
    for (int i = 0; i < kMeetings; ++i) {
      const int node = j * kMeetings + i;
      if (i > 0 && (j == 0 || layout.uniform() < kTunnels)) {
        add_tunnel(floor, node - 1, node, layout);
      }
      if (j > 0) {
        add_tunnel(floor, node - kMeetings, node, layout);
      }
    }
  }
}

/// How deep a point lies in the rock, m; negative in the open.
double depth_in_rock(const Floor& floor, const Rock& rock, Point2 p) {
  double least = HUGE_VAL;
  for (const Way& way : floor.ways) {
    const WallSegment line{floor.nodes[static_cast<std::size_t>(way.from)],
                           floor.nodes[static_cast<std::size_t>(way.to)]};
    least = std::min(least, distance(line, p));
  }
  return least - kLeastHalf_m - kMoreHalf_m * rock.at(p);
}

struct Sample {
  Point2 at;
  double depth = 0.0;
};

/// Where the depth is zero between two samples, one in the rock and one in the open; the same bits for either order,
/// so that the walls of neighbouring cells meet.
Point2 surface(const Sample& a, const Sample& b) {
  return a.depth > b.depth ? between_points(a.at, b.at, a.depth / (a.depth - b.depth)) : surface(b, a);
}

/// The walls in one cell (marching squares, Lorensen and Cline 1987 in the plane), corners in turn round it.
void add_cell_walls(Floor& floor, const Sample (&corners)[4]) {
  Point2 ends[4];
  int count = 0;
  for (int i = 0; i < 4; ++i) {
    const Sample& a = corners[i];
    const Sample& b = corners[(i + 1) % 4];
    if ((a.depth > 0.0) != (b.depth > 0.0)) {
      ends[count++] = surface(a, b);
    }
  }
  for (int i = 0; i + 1 < count; i += 2) {
    floor.walls.push_back({ends[i], ends[i + 1]});
  }
}

}  // namespace

void build_cave(Floor& floor, const SimOptions& options) {
  Random layout = random_stream(options, SimStream::rooms);
  const Rock rock(random_stream(options, SimStream::rock).bits());
  add_tunnels(floor, layout);
  constexpr double kMargin_m = 2.0 + kBend_m + kLeastHalf_m + kMoreHalf_m + 2.0 * kCell_m;
  const int cells = static_cast<int>(((kMeetings - 1) * kPitch_m + 2.0 * kMargin_m) / kCell_m);
  std::vector<Sample> below;
  for (int j = 0; j <= cells; ++j) {
    std::vector<Sample> row;
    for (int i = 0; i <= cells; ++i) {
      const Point2 at{kCell_m * i - kMargin_m, kCell_m * j - kMargin_m};
      row.push_back({at, depth_in_rock(floor, rock, at)});
    }
    for (std::size_t i = 0; j > 0 && i < static_cast<std::size_t>(cells); ++i) {
      add_cell_walls(floor, {below[i], below[i + 1], row[i + 1], row[i]});
    }
    below = row;
  }
}

}  // namespace mellin::host
