#include "host/sim_streets.hpp"

#include <algorithm>
#include <utility>

namespace mellin::host {

Streets::Streets(Floor& floor, const std::vector<double>& xs, const std::vector<double>& ys, double half_width_m)
    : half_(half_width_m) {
  for (const double y : ys) {
    for (const double x : xs) {
      add_node(floor, {x, y});
    }
  }
  for (std::size_t j = 0; j < ys.size(); ++j) {
    for (std::size_t i = 0; i < xs.size(); ++i) {
      if (i + 1 < xs.size()) {
        add_span(xs, ys, i, j, true);
      }
      if (j + 1 < ys.size()) {
        add_span(xs, ys, i, j, false);
      }
      close_crossing(floor, xs, ys, i, j);
    }
  }
}

/// The span from crossing (i, j) to the next in its direction, with its left wall and its right one.
void Streets::add_span(const std::vector<double>& xs, const std::vector<double>& ys, std::size_t i, std::size_t j,
                       bool across) {
  const std::vector<double>& on = across ? xs : ys;      // the coordinate along the span
  const std::vector<double>& beside = across ? ys : xs;  // the other one
  const std::size_t from = across ? i : j;
  const std::size_t line = across ? j : i;
  const double length = on[from + 1] - on[from];
  const auto node = static_cast<int>(j * xs.size() + i);
  const int span = static_cast<int>(spans_.size());
  spans_.push_back({node, node + (across ? 1 : static_cast<int>(xs.size())), length});
  const Pose2 start{xs[i], ys[j], across ? 0.0 : kHalfPi};
  for (const bool left : {true, false}) {
    Wall wall;
    wall.span = span;
    wall.length_m = length - 2.0 * half_;
    wall.reversed = !left;
    wall.across = across;
    wall.frame = left ? compose(start, {half_, half_, 0.0}) : compose(start, {length - half_, -half_, kPi});
    const bool upwards = left == across;  // whether away from the corridor is where `beside` grows
    wall.outside = upwards ? line + 1 == beside.size() : line == 0;
    if (!wall.outside) {
      const double next = upwards ? beside[line + 1] - beside[line] : beside[line] - beside[line - 1];
      wall.behind_m = next - 2.0 * half_;
    }
    walls_.push_back(wall);
  }
}

void Streets::close_crossing(Floor& floor, const std::vector<double>& xs, const std::vector<double>& ys, std::size_t i,
                             std::size_t j) const {
  const Pose2 crossing{xs[i], ys[j], 0.0};
  if (j == 0) {
    add_wall(floor, crossing, -half_, -half_, half_, -half_);
  }
  if (j + 1 == ys.size()) {
    add_wall(floor, crossing, -half_, half_, half_, half_);
  }
  if (i == 0) {
    add_wall(floor, crossing, -half_, -half_, -half_, half_);
  }
  if (i + 1 == xs.size()) {
    add_wall(floor, crossing, half_, -half_, half_, half_);
  }
}

double Streets::along_origin(const Wall& wall) const {
  return wall.reversed ? spans_[static_cast<std::size_t>(wall.span)].length_m - half_ : half_;
}

void Streets::add_ways(Floor& floor, const std::vector<int>& door_spans, double slack_m) const {
  const double clear = 0.6 * half_;
  for (std::size_t s = 0; s < spans_.size(); ++s) {
    const Span& span = spans_[s];
    std::vector<std::pair<double, int>> doors;
    for (std::size_t d = 0; d < door_spans.size(); ++d) {
      if (door_spans[d] == static_cast<int>(s)) {
        doors.emplace_back(floor.doors[d].along_m, static_cast<int>(d));
      }
    }
    std::sort(doors.begin(), doors.end());
    int last = span.from;
    for (const auto& [along, d] : doors) {
      const int before =
          add_node(floor, between_points(floor.nodes[static_cast<std::size_t>(span.from)],
                                         floor.nodes[static_cast<std::size_t>(span.to)], along / span.length_m));
      const int inside = add_node(floor, floor.doors[static_cast<std::size_t>(d)].inside);
      floor.ways.push_back({last, before, slack_m, clear, Way::kNoDoor});
      floor.ways.push_back({before, inside, 0.0, 0.0, d});
      last = before;
    }
    floor.ways.push_back({last, span.to, slack_m, clear, Way::kNoDoor});
  }
}

}  // namespace mellin::host
