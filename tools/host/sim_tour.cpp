// A tour over the ways of a floor.
#include <algorithm>
#include <cmath>

#include "host/sim_drive.hpp"

namespace mellin::host {
namespace {

constexpr double kRoomWeight = 0.2;   // of a door, beside a way ahead that was driven as often
constexpr double kStray_m = 5.0;      // on long ways the robot strays to another side so often
constexpr double kCorner_m = 0.5;     // before and after a corner it is rounded
constexpr int kCornerPieces = 16;     // of a rounded corner: at most 10 degrees each
constexpr double kRoundedCos = -0.2;  // corners up to 100 degrees are rounded

/// A way as it is driven.
struct Leg {
  int way = 0;
  bool back = false;
};

int start_of(const Way& way, bool back) { return back ? way.to : way.from; }

/// Whether a robot can drive it now.
bool passable(const Floor& floor, const Way& way) {
  return way.door == Way::kNoDoor || floor.doors[static_cast<std::size_t>(way.door)].open;
}

class Tour {
 public:
  Tour(const Floor& floor, Random& random)
      : floor_(floor), random_(random), legs_of_(floor.nodes.size()), driven_(floor.ways.size(), 0) {
    for (std::size_t i = 0; i < floor.ways.size(); ++i) {
      for (const bool back : {false, true}) {
        if (passable(floor, floor.ways[i])) {
          legs_of_[static_cast<std::size_t>(start_of(floor.ways[i], back))].push_back({static_cast<int>(i), back});
        }
      }
    }
  }

  std::vector<Leg> plan(double path_m) {
    std::vector<Leg> legs;
    double length = 0.0;
    Leg leg = first();
    while (true) {
      legs.push_back(leg);
      const Way& way = floor_.ways[static_cast<std::size_t>(leg.way)];
      ++driven_[static_cast<std::size_t>(leg.way)];
      length +=
          distance(floor_.nodes[static_cast<std::size_t>(way.from)], floor_.nodes[static_cast<std::size_t>(way.to)]);
      if (length >= path_m) {
        return legs;
      }
      leg = after(leg);
    }
  }

 private:
  /// Anywhere but in a room.
  Leg first() {
    while (true) {
      const int way = static_cast<int>(random_.bits() % floor_.ways.size());
      if (floor_.ways[static_cast<std::size_t>(way)].door == Way::kNoDoor) {
        return {way, random_.uniform() < 0.5};
      }
    }
  }

  double weight(const Leg& leg) const {
    const double driven = 1.0 + driven_[static_cast<std::size_t>(leg.way)];
    return (floor_.ways[static_cast<std::size_t>(leg.way)].door == Way::kNoDoor ? 1.0 : kRoomWeight) /
           (driven * driven);
  }

  Leg after(const Leg& last) {
    const Way& way = floor_.ways[static_cast<std::size_t>(last.way)];
    const std::vector<Leg>& legs = legs_of_[static_cast<std::size_t>(start_of(way, !last.back))];
    double total = 0.0;
    for (const Leg& leg : legs) {
      total += leg.way != last.way ? weight(leg) : 0.0;
    }
    double drawn = total * random_.uniform();
    Leg chosen{last.way, !last.back};  // a dead end
    for (const Leg& leg : legs) {
      if (leg.way != last.way) {
        chosen = leg;
        drawn -= weight(leg);
        if (drawn < 0.0) {
          break;
        }
      }
    }
    return chosen;
  }

  const Floor& floor_;
  Random& random_;
  std::vector<std::vector<Leg>> legs_of_;
  std::vector<int> driven_;
};

/// A point that strays to either side of the way by its slack at most.
Point2 stray(Point2 from, Point2 to, double share, double slack_m, Random& random) {
  const Point2 at = between_points(from, to, share);
  const double length = distance(from, to);
  const double aside = between_limits(random, -slack_m, slack_m);
  return {at.x - aside * (to.y - from.y) / length, at.y + aside * (to.x - from.x) / length};
}

/// The legs as a line. It passes exactly through nodes at doors.
std::vector<Point2> line_of(const Floor& floor, const std::vector<Leg>& legs, Random& random) {
  std::vector<Point2> line;
  double last_slack = HUGE_VAL;
  Point2 end;
  for (const Leg& leg : legs) {
    const Way& way = floor.ways[static_cast<std::size_t>(leg.way)];
    const Point2 from = floor.nodes[static_cast<std::size_t>(leg.back ? way.to : way.from)];
    end = floor.nodes[static_cast<std::size_t>(leg.back ? way.from : way.to)];
    line.push_back(stray(from, end, 0.0, std::min(last_slack, way.slack_m), random));
    const int pieces = static_cast<int>(distance(from, end) / kStray_m);
    for (int i = 1; i <= pieces; ++i) {
      line.push_back(stray(from, end, static_cast<double>(i) / (pieces + 1), way.slack_m, random));
    }
    last_slack = way.slack_m;
  }
  line.push_back(end);
  return line;
}

/// Rounds the corners by quadratic Bézier curves, which stay inside the triangle of the corner.
std::vector<Point2> rounded(const std::vector<Point2>& line) {
  std::vector<Point2> out{line.front()};
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    const Point2 corner = line[i];
    const double before = distance(line[i - 1], corner);
    const double after = distance(corner, line[i + 1]);
    const double cos = ((corner.x - line[i - 1].x) * (line[i + 1].x - corner.x) +
                        (corner.y - line[i - 1].y) * (line[i + 1].y - corner.y)) /
                       (before * after);
    if (!(cos > kRoundedCos)) {
      out.push_back(corner);
      continue;
    }
    const double cut = std::min({kCorner_m, 0.45 * before, 0.45 * after});
    const Point2 first = between_points(corner, line[i - 1], cut / before);
    const Point2 last = between_points(corner, line[i + 1], cut / after);
    for (int k = 0; k <= kCornerPieces; ++k) {
      const double share = static_cast<double>(k) / kCornerPieces;
      out.push_back(between_points(between_points(first, corner, share), between_points(corner, last, share), share));
    }
  }
  out.push_back(line.back());
  return out;
}

}  // namespace

std::vector<Point2> plan_tour(const Floor& floor, double path_m, Random& random) {
  const std::vector<Leg> legs = Tour(floor, random).plan(path_m);
  return rounded(line_of(floor, legs, random));
}

}  // namespace mellin::host
