// Fixed-lag smoothing: the poses of the scans that a submap is made of, aligned all with all before they are frozen.
// The local mapper places a scan once, against what came before it; here each also answers to what came after, and
// loops within the scan memory close. Scans are compared pair by pair, points to lines (Censi 2008), and all poses are
// solved for at once by Gauss-Newton (Lu and Milios 1997), so that an error spreads over the whole way.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/mapping/scan_memory.hpp"

namespace mellin {

struct ScanSmootherConfig {
  std::uint8_t iterations = 3;  ///< of Gauss-Newton; 0: poses stay as they are, and no memory is taken
  std::uint16_t max_scans = 0;  ///< in a submap
  std::uint16_t max_beams = 0;  ///< of any laser
  std::uint16_t points = 90;    ///< of a scan at most, evenly chosen among its beams
  std::uint8_t partners =
      8;  ///< earlier scans that each is compared with: near ones closely, far ones sparsely; 10 at most
  float reach_m = 0.12F;           ///< a point and the line it belongs to are at most so far apart
  float point_sigma_m = 0.03F;     ///< deviation of a point from its line …
  float independent_share = 0.1F;  ///< … and the share of the points that count as independent
  /// What keeps each scan where the local mapper saw it relative to the one before, where no other scan tells better.
  float step_sigma_m = 0.02F;
  float step_sigma_rad = 0.006F;
};

class ScanSmoother {
 public:
  static constexpr std::uint8_t kMostPartners = 10;

  /// A beam's end and the line through it.
  struct LinePoint {
    float x = 0.0F;  ///< m, in the base frame
    float y = 0.0F;
    float normal_x = 0.0F;  ///< unit; (0, 0): the beam measured nothing, or no line is evident
    float normal_y = 0.0F;
  };
  struct Memory {
    Span<Point2f> ends;      ///< of one scan's beams
    Span<LinePoint> points;  ///< scan by scan
    Span<Pose2> steps;       ///< from each scan to the next, as the local mapper saw them
    Span<float> hessian;     ///< lower triangle, row by row, which Eigen cannot factorise in place; its factor follows
    Span<float> gradient;
  };
  template <class A>
  static constexpr Memory carve(A& arena, const ScanSmootherConfig& config) {
    const std::size_t scans = config.iterations == 0 ? 0 : config.max_scans;
    const std::size_t n = 3 * scans;
    return {arena.template take<Point2f>(scans == 0 ? 0 : config.max_beams, Part::submaps),
            arena.template take<LinePoint>(scans * config.points, Part::submaps),
            arena.template take<Pose2>(scans, Part::submaps),
            arena.template take<float>(n * (n + 1) / 2, Part::submaps), arena.template take<float>(n, Part::submaps)};
  }

  ScanSmoother() = default;
  ScanSmoother(const ScanSmootherConfig& config, const Memory& memory) : config_(config), memory_(memory) {}

  /// Starts on the scans first_scan … first_scan + poses.size() - 1, whose poses (of the base, in any one frame) it
  /// improves in place; the one in the middle stays. The poses stay the caller's. Requires at most max_scans of them.
  void begin(std::uint32_t first_scan, Span<Pose2> poses);
  /// One slice: a scan's points, or one scan against its partners, or a solution. Returns whether there is more. The
  /// scans must be in memory until it returns false. Cost: partners x points x 7 distances, or (3 max_scans)^3 / 6.
  bool step(const ScanMemory& scans);
  void abort() { stage_ = Stage::idle; }

 private:
  enum class Stage : std::uint8_t { idle, points, pairs, solve };
  struct Placed;
  /// Derivatives of a residual by x, y and heading of a scan.
  struct Row {
    float of[3];
  };

  void collect(const ScanMemory& scans, std::size_t scan);
  void clear_system();
  void add_step(std::size_t scan);
  void add_row(std::size_t i, const Row& by_i, std::size_t j, const Row& by_j, float residual, float weight);
  void add_pair(const ScanMemory& scans, std::size_t i, std::size_t j);
  const LinePoint* nearest(const ScanMemory& scans, std::size_t scan, float x, float y) const;
  float& hessian(std::size_t row, std::size_t column) { return memory_.hessian[row * (row + 1) / 2 + column]; }
  bool factorise();
  bool move();

  ScanSmootherConfig config_;
  Memory memory_;
  Span<Pose2> poses_;
  std::uint32_t first_scan_ = 0;
  Stage stage_ = Stage::idle;
  std::size_t next_ = 0;
  std::uint8_t iteration_ = 0;
};

}  // namespace mellin
