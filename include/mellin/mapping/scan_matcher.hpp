// Scan matching on the endpoint model (Grisetti, Stachniss, Burgard 2007, Section III): a pose is good where the ends
// of the beams lie on what the live grid holds for solid. Two steps: a correlative search over the poses that the
// odometry leaves open (Olson 2009), then Gauss-Newton on the likelihood field with the odometry as prior, so that
// directions which the scan does not determine (along a corridor) are left to the odometry.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/mapping/live_grid.hpp"

namespace mellin {

struct ScanMatcherConfig {
  std::uint16_t max_points = 0;      ///< beams of any laser
  std::uint16_t search_points = 72;  ///< beams used by the correlative search, evenly chosen
  float search_distance_m = 0.5F;    ///< half-width of the search along x and y
  float search_angle_rad = 0.35F;    ///< half-width of the search in heading
  float search_angle_step_rad = 0.0174532925F;
  std::uint16_t max_iterations = 12;  ///< of Gauss-Newton
  /// Weight of the whole scan: what it costs, in units of one half chi-squared, if every beam ends in free space. Beams
  /// of one scan share their errors, so it is far below the number of beams.
  float scan_weight = 120.0F;
  /// By how much (units of half chi-squared, as scan_weight) what the search found has to be better than what is found
  /// from the odometry by itself. Along a corridor every pose is as good as the next but for the roughness of the map,
  /// and the best of many rough ones lies more often behind, where the scans before were taken: the map came out short.
  float search_gain = 4.0F;
  /// What scan_information() takes a beam to be worth: deviation of its end from the wall it meets, and the share of
  /// the beams that count as independent (neighbours share the errors of the map that they are compared with).
  float point_sigma_m = 0.03F;
  float independent_share = 0.2F;
  float min_inlier_share = 0.35F;  ///< of the beams must end near something solid for a match to count
  /// Where the ordinary search fails (a wheel slipped, a hand pushed the robot): half-widths and step of the wider and
  /// coarser one that follows; a distance of 0: none does.
  float recovery_distance_m = 1.2F;
  float recovery_angle_rad = 0.7F;
  float recovery_angle_step_rad = 0.0349065850F;
  /// What it finds must be clearer than an ordinary match, since chance has more poses to choose from: so many of the
  /// beams end near something solid, and the score is better by so much.
  float recovery_inlier_share = 0.9F;
  float recovery_gain = 0.1F;
};

struct MatchResult {
  Pose2 pose;          ///< of the base, in the frame of the grid
  Sym3 information;    ///< of the pose in its own frame (m, m, rad), prior included
  float score = 0.0F;  ///< mean of the field at the beams' ends, 0 to 1
  float inlier_share = 0.0F;
  bool converged = false;  ///< whether the last step was below a tenth of a millimetre and of a milliradian
  bool good = false;       ///< inlier_share suffices
  bool recovered = false;  ///< by recover(): the odometry says little about it
};

/// How a scan at a pose goes with what the live map has observed, over a sample of its beams.
struct MapAgreement {
  std::uint16_t beams = 0;     ///< looked at
  std::uint16_t agreeing = 0;  ///< end near something solid
  std::uint16_t short_of = 0;  ///< end where the map has observed free space only: something new, or somebody, is there
  std::uint16_t through = 0;   ///< went through something solid
  std::uint16_t conflicts() const { return static_cast<std::uint16_t>(short_of + through); }
};

class ScanMatcher {
 public:
  /// A search point's cell for one heading, relative to the robot's.
  struct CellOffset {
    std::int16_t column = 0;
    std::int16_t row = 0;
  };
  struct Memory {
    Span<Point2f> points;
    Span<Point2f> normals;  ///< of the surface at each point, (0, 0) where none is evident
    Span<CellOffset> offsets;
    Span<std::uint32_t> indices;  ///< where those cells lie in memory that can be reached without looking
  };
  template <class A>
  static constexpr Memory carve(A& arena, const ScanMatcherConfig& config) {
    return {arena.template take<Point2f>(config.max_points, Part::mapper, Region::fast),
            arena.template take<Point2f>(config.max_points, Part::mapper, Region::fast),
            arena.template take<CellOffset>(config.search_points, Part::mapper, Region::fast),
            arena.template take<std::uint32_t>(config.search_points, Part::mapper, Region::fast)};
  }

  ScanMatcher() = default;
  ScanMatcher(const ScanMatcherConfig& config, const Memory& memory) : config_(config), memory_(memory) {}

  /// Takes the points of a scan, in the base frame. Ranges as the scan memory stores them, one a direction (unit
  /// vectors in the base frame); `base_T_laser` is where the beams start. Returns how many beams measured something.
  std::size_t set_scan(Span<const StoredRange> ranges, Span<const Point2f> directions, const Pose2& base_T_laser,
                       float cell_m);
  /// How many.
  std::size_t points() const { return count_; }

  /// Gauss-Newton from `start`. A point pulls along the normal of its surface only: where a surface comes into view
  /// from behind another, its new points would else be drawn along it to what of it is in the map, and every scan
  /// forward. `prior` is the predicted pose, `prior_information` its information in its own frame. Cost: max_iterations
  /// x points x 4 cells.
  MatchResult refine(const LiveGrid& grid, const Pose2& start, const Pose2& prior, const Sym3& prior_information) const;

  /// What the scan alone says about a pose at which it was matched, in the pose's own frame (m, m, rad): each beam that
  /// meets the map holds the pose along the normal of its wall, and not along the wall (Censi 2007). Along a plain
  /// corridor or round a plain bend it says nothing. Normals come from the neighbouring beams, since the field's own
  /// slope also sees the roughness of cells. Cost: points x 16.
  Sym3 scan_information(const LiveGrid& grid, const Pose2& pose) const;

  /// Correlative search round the prior, then refine() from the best pose found and from the prior itself; the better
  /// one counts. Cost: (2 search_distance / (2 cells))^2 x angles x search_points cells.
  MatchResult search(const LiveGrid& grid, const Pose2& prior, const Sym3& prior_information) const;

  /// search() over recovery_distance_m and recovery_angle_rad, by steps of three cells and then of one: for an odometry
  /// that has erred beyond what its noise says, which only keeps a weak say between poses that the scan fits equally.
  /// Good where it is clearer than `ordinary`, as the configuration says, and not where few beams measured anything.
  /// Cost: (2 recovery_distance / (3 cells))^2 x angles x search_points cells.
  MatchResult recover(const LiveGrid& grid, const Pose2& prior, const MatchResult& ordinary) const;

  /// What the map says against the scan at a pose, and what for it. A beam that ends in a cell that was never observed,
  /// on a way on which nothing solid is known, says nothing: that is new space. Where nearly all beams agree, conflicts
  /// are not looked for. Cost: search_points beams, walked cell by cell within the window.
  MapAgreement compare(const LiveGrid& grid, const Pose2& pose) const;

 private:
  struct Linearised;
  Linearised linearise(const LiveGrid& grid, const GridPose& at, float x, float y, float theta) const;
  struct SearchPoints;
  SearchPoints place_points(const LiveGrid& grid, const GridPose& at, float theta, std::size_t stride,
                            std::int32_t reach_cells) const;
  /// The poses of a correlative search: half-widths and steps.
  struct SearchWindow {
    std::int32_t reach = 0;  ///< steps along x and y
    std::int32_t step = 1;   ///< cells
    std::int32_t turns = 0;  ///< steps in heading
    float turn_rad = 0.0F;
  };
  std::size_t search_stride() const { return (count_ + config_.search_points - 1) / config_.search_points; }
  Pose2 correlate(const LiveGrid& grid, const SearchWindow& window, const Pose2& centre, const Pose2& prior,
                  const Sym3& prior_information) const;
  bool goes_through(const LiveGrid& grid, const Ray& beam) const;
  bool ends_in_free(const LiveGrid& grid, const Ray& beam) const;

  ScanMatcherConfig config_;
  Memory memory_;
  std::size_t count_ = 0;  ///< points of the scan, in cells
  Point2f origin_;         ///< of its beams, in cells
};

}  // namespace mellin
