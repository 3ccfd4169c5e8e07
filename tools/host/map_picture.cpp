#include "host/map_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "host/file.hpp"

namespace mellin::host {
namespace {

constexpr double kMostCells = 4e8;
/// Keeps the log odds of shares 0 and 1 finite: a submap alone is never certain.
constexpr double kSoftening = 0.05;
constexpr double kOccupiedThreshold = 0.65;  // map_server's defaults
constexpr double kFreeThreshold = 0.196;

double log_odds(double share) { return std::log((share + kSoftening) / (1.0 - share + kSoftening)); }

std::uint8_t grey_of(float evidence) {
  return std::isnan(evidence) ? kMapUnobserved : map_grey(1.0 / (1.0 + std::exp(-static_cast<double>(evidence))));
}

/// A submap's cells by positions in the map.
class GridSampler {
 public:
  GridSampler(const GridView& grid, const Pose2& map_T_submap)
      : grid_(grid), submap_T_map_(inverse(map_T_submap)), rotation_(sincos(submap_T_map_.theta)) {}

  /// The cell at a point of the map; kUnobserved outside the grid.
  std::uint8_t at(double x, double y) const {
    const double cell_m = static_cast<double>(grid_.cell_m);
    const double half = grid_.side / 2.0;
    const double column = (rotation_.cos * x - rotation_.sin * y + submap_T_map_.x) / cell_m + half;
    const double row = (rotation_.sin * x + rotation_.cos * y + submap_T_map_.y) / cell_m + half;
    const bool inside = column >= 0.0 && row >= 0.0 && column < grid_.side && row < grid_.side;
    return inside ? grid_.at(static_cast<std::uint16_t>(column), static_cast<std::uint16_t>(row)) : kUnobserved;
  }

 private:
  const GridView& grid_;
  Pose2 submap_T_map_;
  SinCos rotation_;
};

void check(bool good, const std::string& what) {
  if (!good) {
    throw std::invalid_argument("map picture: " + what);
  }
}

}  // namespace

std::uint8_t map_grey(double occupied) {
  const auto grey = static_cast<std::uint8_t>(std::floor(kMapFree * (1.0 - occupied) + 0.5));
  return grey == kMapUnobserved ? kMapUnobserved + 1 : grey;  // that grey is taken
}

void MapBounds::include(double x, double y) {
  if (empty()) {
    *this = {x, y, x, y};
    return;
  }
  min_x = std::min(min_x, x);
  min_y = std::min(min_y, y);
  max_x = std::max(max_x, x);
  max_y = std::max(max_y, y);
}

void MapBounds::include_submap(double side_m, const Pose2& map_T_submap) {
  for (const double x : {-side_m / 2.0, side_m / 2.0}) {
    for (const double y : {-side_m / 2.0, side_m / 2.0}) {
      const Pose2 corner = compose(map_T_submap, {x, y, 0.0});
      include(corner.x, corner.y);
    }
  }
}

/// Map cells from first to end - 1.
struct MapPicture::CellBox {
  std::size_t column = 0;
  std::size_t row = 0;
  std::size_t column_end = 0;
  std::size_t row_end = 0;
};

MapPicture::MapPicture(const MapBounds& bounds, const MapPictureOptions& options) : options_(options) {
  const bool finite = std::isfinite(bounds.min_x) && std::isfinite(bounds.min_y) && std::isfinite(bounds.max_x) &&
                      std::isfinite(bounds.max_y);
  check(finite && !bounds.empty(), "expected bounds that hold something");
  check(options.cell_m > 0.0 && std::isfinite(options.cell_m), "expected a positive cell size");
  check(options.occupied_share > 0.0 && options.occupied_share < 1.0, "expected a share of hits between 0 and 1");
  check(options.margin_m >= 0.0 && options.margin_m < 1000.0, "expected a margin of 0 to 1000 m");
  // Whole cells from the map's origin on, so that pictures of one map fit onto each other.
  const double first_column = std::floor(bounds.min_x / options.cell_m);
  const double first_row = std::floor(bounds.min_y / options.cell_m);
  const double columns = std::floor(bounds.max_x / options.cell_m) + 1.0 - first_column;
  const double rows = std::floor(bounds.max_y / options.cell_m) + 1.0 - first_row;
  check(columns * rows <= kMostCells, "bounds of " + std::to_string(bounds.max_x - bounds.min_x) + " m by " +
                                          std::to_string(bounds.max_y - bounds.min_y) +
                                          " m are over 400 million cells");
  origin_x_ = first_column * options.cell_m;
  origin_y_ = first_row * options.cell_m;
  width_ = static_cast<std::size_t>(columns);
  height_ = static_cast<std::size_t>(rows);
  for (std::size_t cell = 0; cell < cell_evidence_.size(); ++cell) {
    const double share = static_cast<double>(cell) / kCertainlyOccupied;
    cell_evidence_[cell] = cell == kUnobserved ? std::numeric_limits<float>::quiet_NaN()
                                               : static_cast<float>(log_odds(share) - log_odds(options.occupied_share));
  }
  log_odds_.assign(width_ * height_, std::numeric_limits<float>::quiet_NaN());
}

MapPicture::CellBox MapPicture::cells_under(const GridView& grid, const Pose2& map_T_submap) const {
  MapBounds under;
  under.include_submap(grid.side * static_cast<double>(grid.cell_m), map_T_submap);
  const auto index = [this](double position, double origin, std::size_t size) {
    const double cells = std::floor((position - origin) / options_.cell_m);
    return static_cast<std::size_t>(std::clamp(cells, 0.0, static_cast<double>(size)));
  };
  return {index(under.min_x, origin_x_, width_), index(under.min_y, origin_y_, height_),
          index(under.max_x + options_.cell_m, origin_x_, width_),
          index(under.max_y + options_.cell_m, origin_y_, height_)};
}

void MapPicture::add(const GridView& grid, const Pose2& map_T_submap) {
  check(grid.side > 0 && grid.cells.size() == static_cast<std::size_t>(grid.side) * grid.side && grid.cell_m > 0.0F,
        "expected a square grid with its cells");
  check(is_finite(map_T_submap), "expected a finite pose");
  const double cell_m = static_cast<double>(grid.cell_m);
  // A finer submap has several cells under a map cell: all are asked.
  const int samples = std::clamp(static_cast<int>(std::ceil(options_.cell_m / cell_m - 0.01)), 1, 16);
  const GridSampler sampler(grid, map_T_submap);
  const CellBox box = cells_under(grid, map_T_submap);
  for (std::size_t row = box.row; row < box.row_end; ++row) {
    for (std::size_t column = box.column; column < box.column_end; ++column) {
      float sum = 0.0F;
      int count = 0;
      for (int i = 0; i < samples; ++i) {
        const double y = (static_cast<double>(row) + (i + 0.5) / samples) * options_.cell_m + origin_y_;
        for (int k = 0; k < samples; ++k) {
          const double x = (static_cast<double>(column) + (k + 0.5) / samples) * options_.cell_m + origin_x_;
          const float evidence = cell_evidence_[sampler.at(x, y)];
          if (!std::isnan(evidence)) {
            sum += evidence;
            ++count;
          }
        }
      }
      if (count > 0) {
        float& cell = log_odds_[row * width_ + column];
        cell = (std::isnan(cell) ? 0.0F : cell) + sum / static_cast<float>(count);
      }
    }
  }
}

MapImage MapPicture::finish() const {
  CellBox box{width_, height_, 0, 0};
  for (std::size_t i = 0; i < log_odds_.size(); ++i) {
    if (!std::isnan(log_odds_[i])) {
      box.column = std::min(box.column, i % width_);
      box.row = std::min(box.row, i / width_);
      box.column_end = std::max(box.column_end, i % width_ + 1);
      box.row_end = std::max(box.row_end, i / width_ + 1);
    }
  }
  if (box.column_end == 0) {
    return {Picture(1, 1, 1, kMapUnobserved), options_.cell_m, origin_x_, origin_y_};
  }
  const auto margin = static_cast<std::size_t>(std::ceil(options_.margin_m / options_.cell_m));
  const std::size_t observed_width = box.column_end - box.column;
  const std::size_t observed_height = box.row_end - box.row;
  MapImage map{Picture(observed_width + 2 * margin, observed_height + 2 * margin, 1, kMapUnobserved), options_.cell_m,
               origin_x_ + (static_cast<double>(box.column) - static_cast<double>(margin)) * options_.cell_m,
               origin_y_ + (static_cast<double>(box.row) - static_cast<double>(margin)) * options_.cell_m};
  for (std::size_t row = 0; row < observed_height; ++row) {
    for (std::size_t column = 0; column < observed_width; ++column) {
      *map.grey.at(margin + column, margin + observed_height - 1 - row) =
          grey_of(log_odds_[(box.row + row) * width_ + box.column + column]);
    }
  }
  return map;
}

void write_map(const MapImage& map, const std::string& directory, const std::string& stem) {
  char yaml[512];
  (void)std::snprintf(yaml, sizeof(yaml),
                      "resolution: %.9g\norigin: [%.6f, %.6f, 0.0]\nnegate: 0\noccupied_thresh: %g\nfree_thresh: %g\n",
                      map.cell_m, map.origin_x, map.origin_y, kOccupiedThreshold, kFreeThreshold);
  const std::string path = directory + "/" + stem;
  write_file(path + ".pgm", encode_pgm(map.grey));
  write_file(path + ".png", encode_png(map.grey));
  write_file(path + ".yaml", "image: " + stem + ".pgm\n" + yaml);
}

Picture draw_overlay(const MapImage& map, std::span<const std::vector<Pose2>> trajectories,
                     std::span<const MapEdge> edges) {
  constexpr Colour kColours[] = {{130, 130, 130}, {0, 150, 60}, {230, 120, 0}};
  constexpr Colour kTrajectory{40, 90, 220};
  constexpr Colour kNode{200, 30, 30};
  Picture picture = to_rgb(map.grey);
  const auto line = [&](const Pose2& a, const Pose2& b, Colour colour, int thickness) {
    draw_line(picture, map.pixel_x(a.x), map.pixel_y(a.y), map.pixel_x(b.x), map.pixel_y(b.y), colour, thickness);
  };
  for (const std::vector<Pose2>& trajectory : trajectories) {
    for (std::size_t i = 1; i < trajectory.size(); ++i) {
      line(trajectory[i - 1], trajectory[i], kTrajectory, 2);
    }
  }
  for (const MapEdge& edge : edges) {
    line(edge.a, edge.b, kColours[static_cast<std::size_t>(edge.kind)], edge.kind == EdgeKind::odometry ? 1 : 2);
  }
  for (const MapEdge& edge : edges) {
    draw_disc(picture, map.pixel_x(edge.a.x), map.pixel_y(edge.a.y), 2.5, kNode);
    draw_disc(picture, map.pixel_x(edge.b.x), map.pixel_y(edge.b.y), 2.5, kNode);
  }
  return picture;
}

}  // namespace mellin::host
