#include "host/trace_pictures.hpp"

#include <algorithm>
#include <cmath>

#include "mellin/core/math.hpp"
#include "mellin/grid/digest.hpp"

namespace mellin::host {
namespace {

constexpr Colour kYellow{255, 214, 0};
constexpr Colour kOrange{230, 110, 0};
constexpr std::size_t kZoom = 4;
constexpr std::size_t kOverlayPixels = 900;

std::uint8_t grey(double share) { return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(share, 0.0, 1.0))); }

/// A picture whose pixel (column, row), row 0 at the foot, is as light as value(column, row), 0 to 1.
template <class Value>
Picture draw(std::size_t width, std::size_t height, Value&& value) {
  Picture picture(width, height, 1, 0);
  for (std::size_t row = 0; row < height; ++row) {
    for (std::size_t column = 0; column < width; ++column) {
      *picture.at(column, height - 1 - row) = grey(value(column, row));
    }
  }
  return picture;
}

void draw_circle(Picture& picture, double x, double y, double radius, Colour colour) {
  constexpr int kSegments = 48;
  SinCos from = sincos(0.0);
  for (int i = 1; i <= kSegments; ++i) {
    const SinCos to = sincos(2.0 * kPi * i / kSegments);
    draw_line(picture, x + radius * from.cos, y + radius * from.sin, x + radius * to.cos, y + radius * to.sin, colour);
    from = to;
  }
}

double circle_radius(std::size_t side) { return std::max(4.0, static_cast<double>(side) / 40.0); }

/// Where both frames meet: a box in A's frame, m.
struct Box {
  double low_x = 0.0;
  double low_y = 0.0;
  double high_x = 0.0;
  double high_y = 0.0;
  bool empty = true;

  void add(double x, double y) {
    low_x = empty ? x : std::min(low_x, x);
    low_y = empty ? y : std::min(low_y, y);
    high_x = empty ? x : std::max(high_x, x);
    high_y = empty ? y : std::max(high_y, y);
    empty = false;
  }
};

/// What one grid shows at each pixel of the overlay.
enum class Shown : std::uint8_t { nothing, free, obstacle };

struct Canvas {
  Box box;
  double pixel_m = 1.0;
  std::size_t width = 1;
  std::size_t height = 1;

  explicit Canvas(const Box& bounds, double cell_m) : box(bounds) {
    const double extent = std::max({box.high_x - box.low_x, box.high_y - box.low_y, cell_m}) + 2.0 * cell_m;
    pixel_m = extent / static_cast<double>(kOverlayPixels);
    const auto pixels = [&](double low, double high) {
      return static_cast<std::size_t>(std::ceil((high - low + 2.0 * cell_m) / pixel_m));
    };
    width = std::clamp<std::size_t>(pixels(box.low_x, box.high_x), 1, kOverlayPixels);
    height = std::clamp<std::size_t>(pixels(box.low_y, box.high_y), 1, kOverlayPixels);
    box.low_x -= cell_m;
    box.low_y -= cell_m;
  }
};

template <class Each>
void each_observed(const OccupancyImage& grid, const Pose2& canvas_T_grid, double cell_m, Each&& each) {
  const SinCos turn = sincos(canvas_T_grid.theta);
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    if (grid.cells[i] != kUnobserved) {
      const std::size_t column = i % grid.width;
      const std::size_t row = i / grid.width;
      const double x = (static_cast<double>(column) + 0.5) * cell_m;
      const double y = (static_cast<double>(row) + 0.5) * cell_m;
      each(i, canvas_T_grid.x + turn.cos * x - turn.sin * y, canvas_T_grid.y + turn.sin * x + turn.cos * y);
    }
  }
}

bool is_obstacle(std::uint8_t cell) { return cell != kUnobserved && cell >= kFreeBelow; }

/// Each pixel from the cell under its centre; obstacles that fall between the centres are added.
std::vector<Shown> show(const OccupancyImage& grid, const Pose2& a_T_grid, double cell_m, const Canvas& canvas) {
  std::vector<Shown> shown(canvas.width * canvas.height, Shown::nothing);
  const Pose2 grid_T_a = inverse(a_T_grid);
  const SinCos turn = sincos(grid_T_a.theta);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::size_t right = i % canvas.width;
    const std::size_t up = i / canvas.width;
    const double x = canvas.box.low_x + (static_cast<double>(right) + 0.5) * canvas.pixel_m;
    const double y = canvas.box.low_y + (static_cast<double>(up) + 0.5) * canvas.pixel_m;
    const double column = (grid_T_a.x + turn.cos * x - turn.sin * y) / cell_m;
    const double row = (grid_T_a.y + turn.sin * x + turn.cos * y) / cell_m;
    if (column >= 0.0 && row >= 0.0 && column < static_cast<double>(grid.width) &&
        row < static_cast<double>(grid.height)) {
      const std::uint8_t cell =
          grid.cells[static_cast<std::size_t>(row) * grid.width + static_cast<std::size_t>(column)];
      shown[i] = cell == kUnobserved ? Shown::nothing : is_obstacle(cell) ? Shown::obstacle : Shown::free;
    }
  }
  each_observed(grid, a_T_grid, cell_m, [&](std::size_t i, double x, double y) {
    const double column = (x - canvas.box.low_x) / canvas.pixel_m;
    const double row = (y - canvas.box.low_y) / canvas.pixel_m;
    if (is_obstacle(grid.cells[i]) && column >= 0.0 && row >= 0.0 && column < static_cast<double>(canvas.width) &&
        row < static_cast<double>(canvas.height)) {
      shown[static_cast<std::size_t>(row) * canvas.width + static_cast<std::size_t>(column)] = Shown::obstacle;
    }
  });
  return shown;
}

Colour overlay_colour(Shown a, Shown b) {
  constexpr Colour kBoth{40, 20, 60};
  constexpr Colour kOnlyA{20, 90, 200};
  constexpr Colour kOnlyB{235, 100, 10};
  constexpr Colour kBothFree{255, 255, 255};
  constexpr Colour kFreeOfA{222, 232, 246};
  constexpr Colour kFreeOfB{250, 234, 216};
  constexpr Colour kUnknown{196, 196, 196};
  if (a == Shown::obstacle || b == Shown::obstacle) {
    return a == b ? kBoth : a == Shown::obstacle ? kOnlyA : kOnlyB;
  }
  if (a == Shown::free) {
    return b == Shown::free ? kBothFree : kFreeOfA;
  }
  return b == Shown::free ? kFreeOfB : kUnknown;
}

}  // namespace

Picture draw_grid(const OccupancyImage& grid) {
  return draw(grid.width, grid.height, [&](std::size_t column, std::size_t row) {
    const std::uint8_t cell = grid.cells[row * grid.width + column];
    return cell == kUnobserved ? 205.0 / 255.0 : static_cast<double>(254 - cell) / 255.0;
  });
}

Picture draw_matched(const std::vector<float>& image, std::size_t side) {
  float most = 0.0F;
  for (const float value : image) {
    most = std::max(most, std::fabs(value));
  }
  const double scale = most > 0.0F ? 0.5 / static_cast<double>(most) : 0.0;
  return draw(side, side, [&](std::size_t column, std::size_t row) {
    return 0.5 - scale * static_cast<double>(image[row * side + column]);
  });
}

Picture draw_spectrum(const std::vector<float>& magnitudes, std::size_t side) {
  double sum = 0.0;
  double most = 0.0;
  for (const float m : magnitudes) {
    sum += static_cast<double>(m);
    most = std::max(most, static_cast<double>(m));
  }
  const double mean = sum / static_cast<double>(magnitudes.size());
  const double scale = mean > 0.0 ? 1.0 / std::log1p(most / mean) : 0.0;
  return draw(side, side, [&](std::size_t column, std::size_t row) {
    // The half plane of negative horizontal frequencies is the other one turned by 180 degrees.
    const bool stored = column >= side / 2;
    const std::size_t kx = stored ? column - side / 2 : side / 2 - column;
    const std::size_t fy = stored ? row + side - side / 2 : side / 2 + side - row;
    const auto magnitude = static_cast<double>(magnitudes[kx * side + fy % side]);
    return mean > 0.0 ? scale * std::log1p(magnitude / mean) : 0.0;
  });
}

Picture draw_polar(const std::vector<float>& polar, std::size_t side) {
  double sum = 0.0;
  double squares = 0.0;
  for (const float value : polar) {
    sum += static_cast<double>(value);
    squares += static_cast<double>(value) * static_cast<double>(value);
  }
  const auto n = static_cast<double>(polar.size());
  const double mean = sum / n;
  const double deviation = std::sqrt(std::max(0.0, squares / n - mean * mean));
  const double scale = deviation > 0.0 ? 1.0 / (6.0 * deviation) : 0.0;
  return draw(side, polar.size() / side, [&](std::size_t column, std::size_t row) {
    return 0.5 + scale * (static_cast<double>(polar[row * side + column]) - mean);
  });
}

PlotPanel plot_rotation(const RegistrationTrace& trace) {
  const std::vector<float>& curve = trace.rotation_correlation;
  constexpr double kHalfTurn_deg = 180.0;
  PlotPanel panel;
  panel.title = "Correlation over the angle; the rotations that are tried are dashed";
  panel.x = {"B turned by, degrees (or 180 more)", 0.0, kHalfTurn_deg};
  panel.y = {"correlation", 0.0, 1e-3};
  PlotSeries series;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const auto value = static_cast<double>(curve[i]);
    series.points.push_back({kHalfTurn_deg * static_cast<double>(i) / static_cast<double>(curve.size()), value});
    panel.y.from = std::min(panel.y.from, value);
    panel.y.to = std::max(panel.y.to, 1.05 * value);
  }
  if (!curve.empty()) {
    series.points.push_back({kHalfTurn_deg, series.points.front().y});
  }
  panel.series.push_back(series);
  for (const RotationPeak& peak : trace.rotations) {
    const double degrees = std::fmod(peak.angle_rad * kHalfTurn_deg / kPi + kHalfTurn_deg, kHalfTurn_deg);
    PlotSeries mark;
    mark.points = {{degrees, panel.y.from}, {degrees, static_cast<double>(peak.strength)}};
    mark.colour = 1;
    mark.dashed = true;
    panel.series.push_back(mark);
  }
  if (!trace.rotations.empty()) {
    panel.guides.push_back(static_cast<double>(trace.pair.config.matcher.peak_share * trace.rotations[0].strength));
  }
  return panel;
}

Picture draw_surface(const RegistrationTrace& trace, const TracedCandidate& candidate, float brightest) {
  const std::size_t side = trace.side();
  const std::size_t half = side / 2;
  const double scale = brightest > 0.0F ? 1.0 / static_cast<double>(brightest) : 0.0;
  Picture picture = to_rgb(draw(side, side, [&](std::size_t column, std::size_t row) {
    const std::size_t at = (row + side - half) % side * side + (column + side - half) % side;
    return scale * static_cast<double>(candidate.surface[at]);
  }));
  for (std::size_t i = candidate.peaks.size(); i-- > 0;) {
    const Fft2::Peak& peak = candidate.peaks[i];
    const double x = static_cast<double>((peak.column + half) % side) + 0.5;
    const double y = static_cast<double>(side - 1 - (peak.row + half) % side) + 0.5;
    draw_circle(picture, x, y, circle_radius(side), i == 0 ? kYellow : kOrange);
  }
  return picture;
}

Picture draw_peak(const RegistrationTrace& trace, const TracedCandidate& candidate, float brightest) {
  const std::size_t side = trace.side();
  const double scale = brightest > 0.0F ? 1.0 / static_cast<double>(brightest) : 0.0;
  const Fft2::Peak peak = candidate.peaks.empty() ? Fft2::Peak{} : candidate.peaks[0];
  // Source pixel of the middle: the peak. Half the picture shows side / 8 pixels of the surface.
  const std::size_t reach = side / (2 * kZoom);
  Picture picture = to_rgb(draw(side, side, [&](std::size_t column, std::size_t row) {
    const std::size_t c = (peak.column + column / kZoom + side - reach) % side;
    const std::size_t r = (peak.row + row / kZoom + side - reach) % side;
    return scale * static_cast<double>(candidate.surface[r * side + c]);
  }));
  const double middle = static_cast<double>(reach * kZoom) + 0.5 * static_cast<double>(kZoom);
  draw_circle(picture, middle, static_cast<double>(side) - middle, circle_radius(side), kYellow);
  return picture;
}

Picture draw_overlay(const OccupancyImage& a, const OccupancyImage& b, const Pose2& a_T_b, double resolution_m) {
  Box box;
  const auto add = [&](std::size_t, double x, double y) { box.add(x, y); };
  each_observed(a, {}, resolution_m, add);
  each_observed(b, a_T_b, resolution_m, add);
  const Canvas canvas(box, resolution_m);
  const std::vector<Shown> of_a = show(a, {}, resolution_m, canvas);
  const std::vector<Shown> of_b = show(b, a_T_b, resolution_m, canvas);
  Picture picture(canvas.width, canvas.height, 3, 0);
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    const Colour colour = overlay_colour(of_a[i], of_b[i]);
    std::copy(colour.begin(), colour.end(), picture.at(i % canvas.width, canvas.height - 1 - i / canvas.width));
  }
  return picture;
}

}  // namespace mellin::host
