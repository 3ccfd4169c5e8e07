// Composes the picture of a map from the grids of its submaps, one at a time: begin with the box that holds them, add
// each with its pose, finish. Writes it as ROS's map_server reads it.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host/png_image.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin::host {

/// A box in map coordinates, m. Empty until something is included.
struct MapBounds {
  double min_x = 1.0;
  double min_y = 1.0;
  double max_x = 0.0;
  double max_y = 0.0;

  bool empty() const { return min_x > max_x; }
  void include(double x, double y);
  /// The four corners of a square grid whose centre lies at the pose.
  void include_submap(double side_m, const Pose2& map_T_submap);
};

struct MapPictureOptions {
  double cell_m = 0.05;
  /// A cell whose share of hits is over this speaks for an obstacle, under it for free space. A quarter, since beams
  /// that graze a wall pass through its cells: walls rarely reach a half.
  double occupied_share = 0.25;
  double margin_m = 0.5;  ///< kept round what was observed
};

/// The finished map: dark occupied, light free, kMapUnobserved where nothing was observed; row 0 is the top (largest
/// y).
struct MapImage {
  Picture grey;
  double cell_m = 0.0;
  double origin_x = 0.0;  ///< lower left corner of the picture in the map's frame, m
  double origin_y = 0.0;

  /// Position in pixels, from the left and from the top.
  double pixel_x(double x) const { return (x - origin_x) / cell_m; }
  double pixel_y(double y) const { return static_cast<double>(grey.height) - (y - origin_y) / cell_m; }
};
inline constexpr std::uint8_t kMapUnobserved = 205;
inline constexpr std::uint8_t kMapFree = 254;
/// The grey of an observed cell that is occupied with this probability; never kMapUnobserved.
std::uint8_t map_grey(double occupied);

class MapPicture {
 public:
  /// Throws std::invalid_argument where the bounds or the options are not usable (empty, not finite, or over 400
  /// million cells). Memory: 4 bytes a cell.
  explicit MapPicture(const MapBounds& bounds, const MapPictureOptions& options = {});

  /// Adds the evidence of a submap: for each map cell the log odds of the submap's cell there. Cells that the submap
  /// did not observe, or that lie outside the bounds, stay as they are. Throws std::invalid_argument where the grid
  /// contradicts itself or the pose is not finite. Cost: the map cells under the submap.
  void add(const GridView& grid, const Pose2& map_T_submap);

  /// The picture of what was added, cut to what was observed. A 1 x 1 unobserved picture where nothing was.
  MapImage finish() const;

 private:
  struct CellBox;
  CellBox cells_under(const GridView& grid, const Pose2& map_T_submap) const;

  MapPictureOptions options_;
  double origin_x_ = 0.0;
  double origin_y_ = 0.0;
  std::size_t width_ = 0;
  std::size_t height_ = 0;
  std::array<float, 256> cell_evidence_{};  ///< of each value of a submap cell; NaN: unobserved
  std::vector<float> log_odds_;             ///< NaN: unobserved. Row 0 has the smallest y
};

/// Writes DIRECTORY/STEM.pgm, STEM.yaml and STEM.png (map_server's convention). Throws where a file cannot be written.
void write_map(const MapImage& map, const std::string& directory, const std::string& stem);

enum class EdgeKind { odometry, loop, merge };

/// A line of the graph in map coordinates.
struct MapEdge {
  Pose2 a;
  Pose2 b;
  EdgeKind kind = EdgeKind::odometry;
};

/// The map in colour with trajectories (blue) and graph edges (odometry grey, loop green, merge orange) drawn over it.
Picture draw_overlay(const MapImage& map, std::span<const std::vector<Pose2>> trajectories,
                     std::span<const MapEdge> edges);

}  // namespace mellin::host
