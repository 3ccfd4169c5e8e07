// Alignment of a registered pair: moves the hypothesis a_T_b, good to a few pixels, until the occupied cells of b lie
// on the obstacles of a. Registration by phase correlation is good to about a cell; the pose graph's edges deserve
// better.
//
// Gauss-Newton on a truncated distance field of a (distance_field.hpp): residual of a point is its distance to the
// nearest obstacle, its gradient the obstacle's normal. Truncation makes it robust and narrows from capture_m to
// final_m (coarse to fine). Fields and points are of a grid alone, whatever the pose: they are made once for all
// hypotheses about a pair, and those of b for all pairs it takes part in.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/submap.hpp"
#include "mellin/spectral/distance_field.hpp"

namespace mellin {

struct AlignmentConfig {
  std::uint16_t max_side = 768;       ///< cells; the largest grid that begin() takes (a byte each)
  std::uint16_t max_points = 2048;    ///< obstacle points used, spread evenly when there are more (16 bytes each)
  std::uint16_t rows_per_step = 32;   ///< grid rows that one step() works on while it builds the field or the points
  std::uint16_t max_iterations = 64;  ///< each way
  std::uint8_t occupied_from = 64;    ///< a cell is an obstacle from this many 254ths of hits per observation on
  bool both_ways = true;              ///< then align a on b as well and take the mean: more exact, and a check
  bool keep_both = true;  ///< memory for field and points of both grids, so that neither is made twice; twice the bytes
  float capture_m = 1.0F;       ///< reach of the distance field: points further from any obstacle exert no pull
  float final_m = 0.15F;        ///< reach in the last stage: points further away are outliers
  float point_sigma_m = 0.05F;  ///< deviation of a point from its obstacle where the pose is right …
  float correlation_m = 0.5F;   ///< … correlated over this length of wall: as many points are one witness
  /// Deviation of a wall's normal as the cells show it. It lets walls seem to hold the pose along themselves, which is
  /// taken off again: along a corridor or round a bend nothing is left.
  float normal_sigma_rad = 0.15F;
  float floor_xy_m = 0.02F;        ///< deviation that no number of points gets below: submaps are not quite rigid …
  float floor_theta_rad = 0.004F;  ///< … the same of the heading
};

/// An obstacle point in the frame of its submap.
struct AlignmentPoint {
  float x = 0.0F;  ///< m, to a fraction of a cell: centre of mass of the hits round it
  float y = 0.0F;
  float normal_x = 0.0F;  ///< unit normal of the wall through it; (0, 0) where no wall direction is evident
  float normal_y = 0.0F;
};

struct AlignmentResult {
  Pose2 a_T_b;
  /// Information of the measurement Z = a_T_b over e = (x, y, theta) of Z^-1 (w_T_a^-1 w_T_b), in Z's own frame (axes
  /// of b), as EDGE_SE2 of g2o has it. Along a corridor its stiffness goes to zero: it is positive semidefinite.
  Sym3 information;
  bool converged = false;        ///< the last step (of each way) was below 1 mm and 0.2 mrad in the last stage
  std::uint16_t iterations = 0;  ///< of both ways
  std::uint16_t points = 0;      ///< that took part, of both ways
  float inlier_share = 0.0F;  ///< of the points that fall where the other observed: closer than final_m to an obstacle
  float rms_m = 0.0F;         ///< distance of the inliers to their obstacles
  float disagreement_m = 0.0F;  ///< between the results of both ways; large where the minimum is false or not unique
  float disagreement_rad = 0.0F;
};

/// One alignment at a time in memory given once. begin(), then step() until it returns false, then result().
class Alignment {
 public:
  /// What is made of a grid.
  struct SideMemory {
    Span<std::uint8_t> field;     ///< distance to the nearest obstacle, max_side^2
    Span<AlignmentPoint> points;  ///< max_points
  };
  struct Memory {
    SideMemory a;
    SideMemory b;  ///< the same as a, unless both are kept
    DistanceField::Memory field;
  };

  template <class A>
  static constexpr SideMemory carve_side(A& arena, const AlignmentConfig& config) {
    SideMemory side;
    side.field =
        arena.template take<std::uint8_t>(static_cast<std::size_t>(config.max_side) * config.max_side, Part::spectral);
    side.points = arena.template take<AlignmentPoint>(config.max_points, Part::spectral);
    return side;
  }
  template <class A>
  static constexpr Memory carve(A& arena, const AlignmentConfig& config) {
    Memory memory;
    memory.a = carve_side(arena, config);
    memory.b = config.keep_both ? carve_side(arena, config) : memory.a;
    memory.field = DistanceField::carve(arena, config.max_side);
    return memory;
  }

  Alignment() = default;
  Alignment(const Alignment&) = delete;
  Alignment& operator=(const Alignment&) = delete;

  /// invalid_config: a zero or non-finite field, final_m over capture_m; insufficient_memory: `memory` is not what
  /// carve() makes of `config`.
  Status init(const AlignmentConfig& config, const Memory& memory);

  /// Names the grids to align; what was made of the one before is forgotten. A grid stays the caller's and must neither
  /// go nor change as long as it is aligned. invalid_argument: larger than max_side, or a size that does not fit its
  /// cells.
  /// Unless both are kept (keep_both), what was made of the other one is forgotten too: field and points may be lent
  /// to others between the end of one alignment and here.
  Status set_a(const GridView& a) { return set_side(a_, a); }
  Status set_b(const GridView& b) { return set_side(b_, b); }

  /// Starts aligning them; may be called again with another hypothesis. invalid_argument: a grid is missing, a pose
  /// that is not finite.
  Status begin(const Pose2& a_T_b);

  /// Both at once, for a pair that is aligned once. Statuses of the three.
  Status begin(const GridView& a, const GridView& b, const Pose2& a_T_b);

  /// One slice: rows_per_step rows of one of the two sweeps that make a field, or as many of the points, or one
  /// iteration over the points. Returns whether there is more to do.
  bool step();

  /// The outcome once step() has returned false. busy: not yet; degenerate: too few points of b fall on what a observed
  /// to say anything (fewer than 30 inliers).
  Result<AlignmentResult> result() const;

 private:
  enum class Stage : std::uint8_t { idle, field, count, points, iterate, done };

  /// A grid, and what has been made of it so far.
  struct Side {
    GridView grid;
    SideMemory memory;
    bool has_field = false;
    bool has_points = false;
    std::uint32_t obstacles = 0;
    std::size_t point_count = 0;
  };

  struct Sample {
    bool observed = false;  ///< by a
    bool near = false;      ///< within capture_m of an obstacle; the rest is valid only then
    float distance_m = 0.0F;
    float gradient_x = 0.0F;
    float gradient_y = 0.0F;
  };

  /// Gauss-Newton system over e = (x, y, theta) on the right of onto_T_from.
  struct System {
    double cost = 0.0;  ///< robust: 0 a point on an obstacle, 1 a point out of reach
    Sym3 stiffness;
    Pose2 pull;
  };

  struct Evidence {
    std::uint32_t shared = 0;  ///< points that fall where the other submap observed
    std::uint32_t inliers = 0;
    double squares = 0.0;  ///< of the inliers' distances, m^2
    Sym3 across;           ///< stiffness of the walls across themselves, over e on the right of a_T_b
    Sym3 along;            ///< the same of the walls if they held along themselves
  };

  Status set_side(Side& side, const GridView& grid);
  void start_way(Side& onto, Side& from, const Pose2& onto_T_from, float reach_m);
  void next_stage();
  void begin_field();
  void begin_points();
  int slice_end() const;
  void count_obstacles();
  void collect_points();
  Sample sample(float x_m, float y_m) const;
  System linearise(const Pose2& onto_T_from) const;
  void iterate();
  void finish_way(bool converged);
  void add_evidence();
  void summarise();

  AlignmentConfig config_;
  DistanceField::Memory field_memory_;
  Side a_;
  Side b_;
  Side* onto_ = nullptr;  ///< whose field is slid on: a on the first way …
  Side* from_ = nullptr;  ///< … and whose points slide: b
  DistanceField field_;   ///< under way
  bool backward_ = false;
  Stage stage_ = Stage::idle;
  int row_ = 0;             ///< next row of the points
  std::uint32_t seen_ = 0;  ///< obstacles that collect_points() has passed
  Pose2 onto_T_from_;       ///< best so far …
  System best_;             ///< … and the system there
  Pose2 trial_;             ///< to be tried next
  float reach_m_ = 0.0F;    ///< of the residuals
  double damping_ = 0.0;
  bool settled_ = false;  ///< best_ belongs to the last stage
  std::uint16_t iterations_ = 0;
  Evidence evidence_;
  AlignmentResult result_;
};

}  // namespace mellin
