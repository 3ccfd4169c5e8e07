// A grid of corridors that cross at right angles: their centre lines, their walls and the ways along them.
#pragma once

#include <vector>

#include "host/sim_floor.hpp"

namespace mellin::host {

class Streets {
 public:
  /// A corridor between two crossings.
  struct Span {
    int from = 0;  ///< node
    int to = 0;
    double length_m = 0.0;  ///< between the crossings' centres
  };

  /// A wall of a span, between the corners at the crossings. The frame has x along it and y away from the corridor.
  struct Wall {
    int span = 0;
    Pose2 frame;
    double length_m = 0.0;
    bool reversed = false;  ///< x runs against the span
    bool across = false;    ///< the span runs along the floor's x axis
    bool outside = false;   ///< no other corridor lies beyond
    double behind_m = 0.0;  ///< to the opposite wall of the block behind; only where not outside
  };

  /// Corridors along all lines x = xs[i] and y = ys[j], in increasing order; adds the nodes of the crossings, and the
  /// walls that close the crossings at the margin.
  Streets(Floor& floor, const std::vector<double>& xs, const std::vector<double>& ys, double half_width_m);

  const std::vector<Span>& spans() const { return spans_; }
  const std::vector<Wall>& walls() const { return walls_; }
  double half_width_m() const { return half_; }

  /// Where x of the wall's frame lies on the centre line of its span, m from the span's first node: origin + direction
  /// * x.
  double along_origin(const Wall& wall) const;
  static double along_direction(const Wall& wall) { return wall.reversed ? -1.0 : 1.0; }

  /// Ways along all spans, with nodes before the given doors and ways through them into the rooms. `door_spans` has
  /// the span of each of the floor's doors.
  void add_ways(Floor& floor, const std::vector<int>& door_spans, double slack_m) const;

 private:
  void add_span(const std::vector<double>& xs, const std::vector<double>& ys, std::size_t i, std::size_t j,
                bool across);
  void close_crossing(Floor& floor, const std::vector<double>& xs, const std::vector<double>& ys, std::size_t i,
                      std::size_t j) const;

  double half_;
  std::vector<Span> spans_;
  std::vector<Wall> walls_;
};

}  // namespace mellin::host
