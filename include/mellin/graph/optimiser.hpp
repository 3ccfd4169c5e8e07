// Least squares on a pose graph: minimises the sum of e^T information e over the enabled edges, the first node of each
// component held (Grisetti, Kuemmerle, Stachniss, Burgard 2010). In double and in fixed memory, in bounded slices.
//
// Start. Either the graph's current poses (right after an incremental change) or the chordal initialisation (Carlone,
// Tron, Daniilidis, Dellaert 2015): rotations as unit vectors by one linear solve, then translations by a second. From
// bad odometry damped descent gets lost; from the chordal start Gauss-Newton finds the optimum.
//
// Iteration. Gauss-Newton, which may pass through a few worse poses on its way (on INTEL it does); where that does not
// lead below the best, back to the best with Marquardt's damping.
//
// Robust kernel: truncated least squares by graduated non-convexity (Yang, Antonante, Tzoumas, Carlone 2020), on loop
// and merge edges only, since odometry edges are known inliers. Truncated, because its weights end at 0 or 1: what is
// kept has no bias, what is not is named (Edge::weight). Graduated, because dynamic covariance scaling and plain Cauchy
// or Geman-McClure kernels depend on a start that is already right, which a closing loop does not give.
//
// Starting from the current poses, it has found every false loop of a simulated grid world where half of the loops were
// false; false loops bend the chordal start, so do not combine the two (tests/optimiser_world_test.cpp).
//
// Solver. Block Cholesky (graph/block_cholesky.hpp). A graph whose factor does not fit into max_fill is solved by
// conjugate gradients, preconditioned with the Cholesky factor of a spanning tree, which always fits (subgraph
// preconditioning: Dellaert, Carlson, Ila, Ni, Thorpe 2010). Then report().fill_status is full.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/graph/block_cholesky.hpp"
#include "mellin/graph/pose_graph.hpp"

namespace mellin {

namespace graph_detail {
struct EdgeTerms;
}

enum class Start : std::uint8_t {
  current,  ///< from the graph's poses
  chordal,  ///< from the edges alone
};

struct OptimiserOptions {
  Start start = Start::current;
  std::uint32_t max_iterations = 100;  ///< linear solves; 0 with `marginals`: only factorise at the current poses
  double tolerance = 1e-6;             ///< converged when a step reduces chi2 by less than this share of it
  bool robust = false;                 ///< truncated least squares on loop and merge edges
  /// Errors whose chi2 is over this are outliers; 11.34 is the 99 % quantile with three degrees of freedom.
  double robust_chi2 = 11.345;
  bool marginals = false;  ///< factorise once more at the final poses, for relative_covariance()
};

struct OptimiserReport {
  Status status = Status::ok;       ///< degenerate: the equations have no unique solution, the poses are the best so
                                    ///< far; busy: the graph was changed meanwhile, nothing was written to it
  Status fill_status = Status::ok;  ///< full: the factor did not fit, conjugate gradients were used
  bool converged = false;
  std::uint32_t iterations = 0;  ///< linear solves, those of rejected steps included, without the chordal start's two
  std::uint32_t fill = 0;        ///< blocks of the factor below the diagonal
  std::uint32_t rejected = 0;    ///< loop and merge edges with a weight under one half
  double chi2_initial = 0.0;     ///< of the graph as given, all weights one
  double chi2_final = 0.0;       ///< with the final weights
};

class Optimiser {
 public:
  struct Memory {
    BlockCholesky::Memory cholesky;
    Span<BlockPair> pairs;
    Span<double> weights;
    Span<Pose2> poses;
    Span<Pose2> trial;
    Span<Pose2> best;
    Span<double> vectors;
  };

  template <class A>
  static constexpr Memory carve(A& arena, const PoseGraphConfig& config) {
    Memory memory;
    memory.cholesky = BlockCholesky::carve(arena, limits(config));
    memory.pairs = arena.template take<BlockPair>(config.max_edges, Part::graph);
    memory.weights = arena.template take<double>(config.max_edges, Part::graph);
    memory.poses = arena.template take<Pose2>(config.max_nodes, Part::graph);
    memory.trial = arena.template take<Pose2>(config.max_nodes, Part::graph);
    memory.best = arena.template take<Pose2>(config.max_nodes, Part::graph);
    memory.vectors =
        arena.template take<double>(kVectors * 3 * static_cast<std::size_t>(config.max_nodes), Part::graph);
    return memory;
  }

  /// ok; invalid_config; insufficient_memory where the spans are smaller than carve() takes.
  Status init(const PoseGraphConfig& config, const Memory& memory);

  /// Starts a run on `graph`, which must outlive it and must not be changed before its end. Ends a run under way,
  /// leaving its graph as it was. ok; invalid_argument where the graph has more nodes or edges than this optimiser's
  /// config, or an option is not finite or not positive. O(nodes + edges).
  Status begin(PoseGraph& graph, const OptimiserOptions& options);

  /// One slice: a part of the ordering, one linearisation, some columns of the factorisation, one conjugate gradient
  /// step, or one evaluation of the cost. Returns whether there is more to do; the last slice writes poses and weights
  /// to the graph at once. Bound, from the config alone: O(max_nodes + max_edges + max_fill + work_per_step) block
  /// operations.
  bool step();

  /// Valid after begin(); final when step() has returned false.
  const OptimiserReport& report() const { return report_; }

  /// Blocks below the diagonal that the factor may have.
  std::uint32_t fill_capacity() const { return config_.max_fill; }

  /// Covariance of a_T_b = Xa^-1 Xb over its own parameters (x, y in frame a, theta), at the poses and weights of the
  /// last run, which must have had `marginals` set (Kaess and Dellaert 2009). The covariance; busy while a run is under
  /// way; not_found where a node does not exist; invalid_argument where the last run left no factor of the graph as it
  /// is now; degenerate where the nodes lie in different components or the solver fails. Cost: a sparse forward
  /// substitution with three columns along the elimination tree's two paths, at worst O(fill); three full solves with
  /// conjugate gradients.
  Result<Sym3> relative_covariance(NodeId a, NodeId b);

 private:
  /// Vectors of three doubles a node: right-hand side and residual, solution, search direction, its image, diagonal.
  static constexpr std::size_t kVectors = 5;
  enum class Stage : std::uint8_t { rotations, translations, poses, marginals };
  enum class Phase : std::uint8_t { idle, order, assemble, factorise, gradients, update, write };

  static constexpr BlockCholeskyLimits limits(const PoseGraphConfig& config) {
    return {config.max_nodes, config.max_edges, config.max_fill};
  }
  bool fixed(NodeId node) const { return graph_->component(node) == node; }
  bool in_system(const Edge& edge) const { return edge.enabled && !(fixed(edge.a) && fixed(edge.b)); }
  bool under_kernel(const Edge& edge) const { return edge.enabled && edge.kind != EdgeKind::odometry; }
  Span<double> vector(std::size_t which) const;
  graph_detail::EdgeTerms terms(EdgeId id) const;
  double edge_cost(EdgeId id, Span<const Pose2> poses) const;
  double cost(Span<const Pose2> poses) const;

  void connect_all();
  void connect_tree();
  void order();
  void assemble();
  void add_to_matrix(EdgeId id, const graph_detail::EdgeTerms& t);
  void factorise();
  void give_way();
  void restore();
  void update();
  void set_rotations();
  void set_translations();
  void try_step();
  void accept(double chi2);
  void go_astray();
  void reject();
  void begin_poses();
  void finish_poses();
  void write();

  void multiply(Span<const double> x, Span<double> out) const;
  void precondition();
  void begin_gradients();
  bool iterate_gradients();
  Result<Sym3> covariance_by_gradients(NodeId a, const Block3& by_a, NodeId b, const Block3& by_b);

  void begin_kernel();
  bool weigh();

  Memory memory_;
  PoseGraphConfig config_;
  OptimiserOptions options_;
  OptimiserReport report_;
  PoseGraph* graph_ = nullptr;
  BlockCholesky cholesky_;
  Phase phase_ = Phase::idle;
  Stage stage_ = Stage::poses;
  std::uint32_t nodes_ = 0;
  std::uint32_t edges_ = 0;
  std::uint32_t revision_ = 0;
  std::uint32_t gradient_steps_ = 0;
  std::uint32_t patience_ = 0;
  double chi2_ = 0.0;
  double damping_ = 0.0;
  double control_ = 0.0;
  double rho_ = 0.0;
  double rho_stop_ = 0.0;
  bool kernel_done_ = true;
  bool direct_ = true;
  bool factored_ = false;
  bool astray_ = false;
};

}  // namespace mellin
