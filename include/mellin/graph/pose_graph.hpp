// The pose graph: nodes are poses (of submaps, or of anything else), edges are relative poses measured between them
// (paper, Section III-D). Mathematics only: it knows no grids and no storage, and is useful alone together with
// graph/optimiser.hpp.
//
// Sessions that have not been linked yet are components: sets of nodes connected by enabled edges. Each component has
// a frame of its own. Its identifier is its smallest node, and that node is its gauge: the optimiser leaves it where
// it is. An edge that links two components moves the one with the larger identifier onto the frame of the other.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"

namespace mellin {

using NodeId = std::uint32_t;  ///< nodes count from 0 in the order in which they were added
using EdgeId = std::uint32_t;  ///< likewise
inline constexpr std::uint32_t kNoId = 0xFFFFFFFFU;

/// Sizes of the graph and of its optimiser; the defaults suit the profile `micro`.
struct PoseGraphConfig {
  std::uint32_t max_nodes = 256;  ///< at least 1, at most 2^24
  std::uint32_t max_edges = 768;  ///< at most 2^24
  /// Blocks of 3 x 3 below the diagonal that the optimiser's Cholesky factor may have, 76 bytes each; at least
  /// max_nodes, at most 2^28. A graph that needs more is solved by conjugate gradients: slower, the same answer.
  std::uint32_t max_fill = 2048;
  /// Bound of one Optimiser::step() in block operations (one product of two 3 x 3 matrices, or one visit of an index
  /// while ordering); at least 1.
  std::uint32_t work_per_step = 4096;
};

/// ok, or invalid_config where a limit stated above is broken.
Status validate(const PoseGraphConfig& config);

enum class EdgeKind : std::uint8_t {
  odometry,  ///< consecutive nodes of a session: a known inlier, never under the robust kernel
  loop,      ///< both ends in one session
  merge,     ///< links two sessions
};

/// A measured relative pose. The error is that of g2o's EDGE_SE2: e = (x, y, theta) of Z^-1 (Xa^-1 Xb) with Z = a_T_b
/// and theta in [-pi, pi); chi2 = e^T information e. The information is therefore given in Z's frame, that of b as
/// measured.
struct Edge {
  Pose2 a_T_b;
  Sym3 information;
  double weight = 1.0;  ///< of the robust kernel, 0 to 1, from the last optimisation; 0: rejected as an outlier
  NodeId a = kNoId;
  NodeId b = kNoId;
  EdgeKind kind = EdgeKind::odometry;
  bool enabled = true;
};

/// Z^-1 (Xa^-1 Xb), theta in [-pi, pi).
Pose2 edge_error(const Pose2& a_T_b, const Pose2& w_T_a, const Pose2& w_T_b);

/// e^T information e of the edge between two poses, without its robust weight.
double edge_chi2(const Edge& edge, const Pose2& w_T_a, const Pose2& w_T_b);

/// The information of Z = a_T_b in the frame that Edge asks for, from a covariance over Z's own parameters
/// (x, y in frame a, theta), as core/se2.hpp and the matchers give them. False where the covariance is not positive
/// definite.
bool information_from_covariance(const Pose2& a_T_b, const Sym3& covariance, Sym3& information);

/// The covariance over Z's own parameters (x, y in frame a, theta) of an edge; the inverse of the above. False where
/// the information is not positive definite.
bool covariance_from_information(const Pose2& a_T_b, const Sym3& information, Sym3& covariance);

class PoseGraph {
 public:
  struct Memory {
    Span<Pose2> poses;
    Span<NodeId> components;
    Span<Edge> edges;
  };

  template <class A>
  static constexpr Memory carve(A& arena, const PoseGraphConfig& config) {
    Memory memory;
    memory.poses = arena.template take<Pose2>(config.max_nodes, Part::graph);
    memory.components = arena.template take<NodeId>(config.max_nodes, Part::graph);
    memory.edges = arena.template take<Edge>(config.max_edges, Part::graph);
    return memory;
  }

  /// An empty graph over the memory carved for `config`. ok, invalid_config, or insufficient_memory where the spans
  /// are smaller than carve() takes.
  Status init(const PoseGraphConfig& config, const Memory& memory);

  /// Forgets all nodes and edges.
  void clear();

  /// A node, in a component of its own until an edge links it. Returns its id; full; bad_data where the pose is not
  /// finite or farther than 1e9 m or 1e5 rad from zero. O(1).
  Result<NodeId> add_node(const Pose2& frame_T_node);

  /// An edge, enabled. Where it links two components, the poses of the one with the larger id are moved so that the
  /// edge's error is zero. Returns its id; full; invalid_argument where a == b or a node does not exist; bad_data
  /// where a number is not finite or beyond add_node()'s limits, or the information is not positive semidefinite with
  /// both its translation's and its heading's part positive. O(nodes) when it links, else O(1).
  Result<EdgeId> add_edge(NodeId a, NodeId b, EdgeKind kind, const Pose2& a_T_b, const Sym3& information);

  /// Takes an edge out of the graph without forgetting it. Where it held two parts together they become two components;
  /// their poses stay. Nothing changes where it is disabled already. ok; not_found. O(nodes + edges).
  Status disable_edge(EdgeId edge);

  /// Puts it back, moving a component as add_edge() does where it links two. ok; not_found. O(nodes) when it links.
  Status enable_edge(EdgeId edge);

  std::uint32_t node_count() const { return node_count_; }
  std::uint32_t edge_count() const { return edge_count_; }
  std::uint32_t node_capacity() const { return static_cast<std::uint32_t>(memory_.poses.size()); }
  std::uint32_t edge_capacity() const { return static_cast<std::uint32_t>(memory_.edges.size()); }

  /// Pose of a node in the frame of its component. Requires node < node_count().
  const Pose2& pose(NodeId node) const { return memory_.poses.first(node_count_)[node]; }

  /// Requires edge < edge_count().
  const Edge& edge(EdgeId edge) const { return memory_.edges.first(edge_count_)[edge]; }

  /// The component of a node: the smallest node id in it, which is its gauge. Requires node < node_count().
  NodeId component(NodeId node) const { return memory_.components.first(node_count_)[node]; }

  /// O(nodes).
  std::uint32_t component_count() const;

  /// Sum of e^T information e over the enabled edges, without robust weights. O(edges).
  double chi2() const;

  /// Overwrites a pose (an estimate from elsewhere). ok; not_found; bad_data as add_node().
  Status set_pose(NodeId node, const Pose2& frame_T_node);

  /// Overwrites the robust weight of an edge. ok; not_found; bad_data outside 0 to 1.
  Status set_weight(EdgeId edge, double weight);

  /// Counts the changes of nodes, edges and poses, so that who works in slices notices them.
  std::uint32_t revision() const { return revision_; }

 private:
  void link(const Edge& edge);
  void relabel();
  NodeId find_root(NodeId node);

  Memory memory_;
  std::uint32_t node_count_ = 0;
  std::uint32_t edge_count_ = 0;
  std::uint32_t revision_ = 0;
};

}  // namespace mellin
