// Line charts as SVG: panels side by side, each with axes, ticks, a grid and a legend.
#pragma once

#include <string>
#include <vector>

namespace mellin::host {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
};

struct PlotSeries {
  std::string label;  ///< in the legend; none where empty
  std::vector<PlotPoint> points;
  std::size_t colour = 0;  ///< by number; equal numbers are drawn alike
  bool dashed = false;
};

/// An axis runs from `from` to `to`; an axis that falls has the larger number on the left or at the foot.
struct PlotAxis {
  std::string label;
  double from = 0.0;
  double to = 1.0;
};

struct PlotPanel {
  std::string title;
  PlotAxis x;
  PlotAxis y;
  std::vector<PlotSeries> series;
  std::vector<double> guides;  ///< grey horizontal lines at these y
};

/// One row of panels under a title. Lines are cut at the axes' limits; points that are not finite are left out.
std::string to_svg(const std::string& title, const std::vector<PlotPanel>& panels);

}  // namespace mellin::host
