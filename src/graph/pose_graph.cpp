#include "mellin/graph/pose_graph.hpp"

#include <cassert>
#include <cmath>

namespace mellin {
namespace {

constexpr std::uint32_t kMaxCount = 1U << 24U;
constexpr std::uint32_t kMaxFill = 1U << 28U;
constexpr double kMaxMetres = 1e9;
constexpr double kMaxRadians = 1e5;

bool plausible(const Pose2& pose) {
  return std::fabs(pose.x) <= kMaxMetres && std::fabs(pose.y) <= kMaxMetres && std::fabs(pose.theta) <= kMaxRadians;
}

bool is_finite(const Sym3& m) {
  return mellin::is_finite(m.xx) && mellin::is_finite(m.xy) && mellin::is_finite(m.xt) && mellin::is_finite(m.yy) &&
         mellin::is_finite(m.yt) && mellin::is_finite(m.tt);
}

/// Whether a symmetric 2 x 2 matrix is positive semidefinite, but for the rounding of numbers printed with six digits.
bool semidefinite(double a, double b, double d) {
  constexpr double kPrinted = 1e-5;
  return a >= 0.0 && d >= 0.0 && b * b <= a * d * (1.0 + kPrinted);
}

/// Semidefinite with some information on position and heading. Scaled to a unit diagonal, so that units do not matter.
bool usable_information(const Sym3& m) {
  if (!is_finite(m) || !(m.tt > 0.0) || !(m.xx + m.yy > 0.0)) {
    return false;
  }
  if (!semidefinite(m.xx, m.xy, m.yy) || !semidefinite(m.xx, m.xt, m.tt) || !semidefinite(m.yy, m.yt, m.tt)) {
    return false;
  }
  const double sx = m.xx > 0.0 ? 1.0 / sqrt(m.xx) : 0.0;
  const double sy = m.yy > 0.0 ? 1.0 / sqrt(m.yy) : 0.0;
  const double st = 1.0 / sqrt(m.tt);
  const double xy = m.xy * sx * sy;
  const double xt = m.xt * sx * st;
  const double yt = m.yt * sy * st;
  const double determinant = 1.0 - xy * xy - xt * xt - yt * yt + 2.0 * xy * xt * yt;
  return mellin::is_finite(st) && determinant >= -1e-5;
}

}  // namespace

Status validate(const PoseGraphConfig& config) {
  const bool good = config.max_nodes >= 1 && config.max_nodes <= kMaxCount && config.max_edges <= kMaxCount &&
                    config.max_fill >= config.max_nodes && config.max_fill <= kMaxFill && config.work_per_step >= 1;
  return good ? Status::ok : Status::invalid_config;
}

Pose2 edge_error(const Pose2& a_T_b, const Pose2& w_T_a, const Pose2& w_T_b) {
  return between(a_T_b, between(w_T_a, w_T_b));
}

double edge_chi2(const Edge& edge, const Pose2& w_T_a, const Pose2& w_T_b) {
  return quadratic_form(edge.information, edge_error(edge.a_T_b, w_T_a, w_T_b));
}

bool information_from_covariance(const Pose2& a_T_b, const Sym3& covariance, Sym3& information) {
  return invert(rotate(covariance, -a_T_b.theta), information);
}

bool covariance_from_information(const Pose2& a_T_b, const Sym3& information, Sym3& covariance) {
  Sym3 in_b;
  if (!invert(information, in_b)) {
    return false;
  }
  covariance = rotate(in_b, a_T_b.theta);
  return true;
}

Status PoseGraph::init(const PoseGraphConfig& config, const Memory& memory) {
  if (const Status status = validate(config); status != Status::ok) {
    return status;
  }
  if (memory.poses.size() < config.max_nodes || memory.components.size() < config.max_nodes ||
      memory.edges.size() < config.max_edges) {
    return Status::insufficient_memory;
  }
  memory_ = memory;
  clear();
  return Status::ok;
}

void PoseGraph::clear() {
  node_count_ = 0;
  edge_count_ = 0;
  ++revision_;
}

Result<NodeId> PoseGraph::add_node(const Pose2& frame_T_node) {
  if (!plausible(frame_T_node)) {
    return Status::bad_data;
  }
  if (node_count_ == memory_.poses.size()) {
    return Status::full;
  }
  const NodeId id = node_count_++;
  memory_.poses[id] = {frame_T_node.x, frame_T_node.y, wrap_angle(frame_T_node.theta)};
  memory_.components[id] = id;
  ++revision_;
  return id;
}

Result<EdgeId> PoseGraph::add_edge(NodeId a, NodeId b, EdgeKind kind, const Pose2& a_T_b, const Sym3& information) {
  if (a == b || a >= node_count_ || b >= node_count_) {
    return Status::invalid_argument;
  }
  if (!plausible(a_T_b) || !usable_information(information)) {
    return Status::bad_data;
  }
  if (edge_count_ == memory_.edges.size()) {
    return Status::full;
  }
  const EdgeId id = edge_count_++;
  Edge& edge = memory_.edges[id];
  edge = Edge{};
  edge.a = a;
  edge.b = b;
  edge.kind = kind;
  edge.a_T_b = {a_T_b.x, a_T_b.y, wrap_angle(a_T_b.theta)};
  edge.information = information;
  link(edge);
  ++revision_;
  return id;
}

Status PoseGraph::disable_edge(EdgeId edge) {
  if (edge >= edge_count_) {
    return Status::not_found;
  }
  if (memory_.edges[edge].enabled) {
    memory_.edges[edge].enabled = false;
    relabel();
    ++revision_;
  }
  return Status::ok;
}

Status PoseGraph::enable_edge(EdgeId edge) {
  if (edge >= edge_count_) {
    return Status::not_found;
  }
  if (!memory_.edges[edge].enabled) {
    memory_.edges[edge].enabled = true;
    link(memory_.edges[edge]);
    ++revision_;
  }
  return Status::ok;
}

std::uint32_t PoseGraph::component_count() const {
  std::uint32_t count = 0;
  for (NodeId node = 0; node < node_count_; ++node) {
    count += component(node) == node ? 1U : 0U;
  }
  return count;
}

double PoseGraph::chi2() const {
  double sum = 0.0;
  for (EdgeId id = 0; id < edge_count_; ++id) {
    const Edge& e = memory_.edges[id];
    if (e.enabled) {
      sum += edge_chi2(e, memory_.poses[e.a], memory_.poses[e.b]);
    }
  }
  return sum;
}

Status PoseGraph::set_pose(NodeId node, const Pose2& frame_T_node) {
  if (node >= node_count_) {
    return Status::not_found;
  }
  if (!plausible(frame_T_node)) {
    return Status::bad_data;
  }
  memory_.poses[node] = {frame_T_node.x, frame_T_node.y, wrap_angle(frame_T_node.theta)};
  ++revision_;
  return Status::ok;
}

Status PoseGraph::set_weight(EdgeId edge, double weight) {
  if (edge >= edge_count_) {
    return Status::not_found;
  }
  if (!(weight >= 0.0 && weight <= 1.0)) {
    return Status::bad_data;
  }
  memory_.edges[edge].weight = weight;
  ++revision_;
  return Status::ok;
}

/// Moves the component with the larger id so that the edge fits, and gives it the smaller id.
void PoseGraph::link(const Edge& edge) {
  const NodeId component_a = component(edge.a);
  const NodeId component_b = component(edge.b);
  if (component_a == component_b) {
    return;
  }
  const bool move_b = component_b > component_a;
  const NodeId moved = move_b ? component_b : component_a;
  const NodeId kept = move_b ? component_a : component_b;
  const Pose2 before = pose(move_b ? edge.b : edge.a);
  const Pose2 after = move_b ? compose(pose(edge.a), edge.a_T_b) : compose(pose(edge.b), inverse(edge.a_T_b));
  const Pose2 kept_T_moved = compose(after, inverse(before));
  for (NodeId node = moved; node < node_count_; ++node) {  // none of its nodes is smaller than its id
    if (memory_.components[node] == moved) {
      memory_.poses[node] = compose(kept_T_moved, memory_.poses[node]);
      memory_.components[node] = kept;
    }
  }
}

/// Root of a node in the forest that relabel() builds in the component array, halving the path to it on the way.
NodeId PoseGraph::find_root(NodeId node) {
  Span<NodeId> parent = memory_.components;
  while (parent[node] != node) {
    parent[node] = parent[parent[node]];
    node = parent[node];
  }
  return node;
}

void PoseGraph::relabel() {
  for (NodeId node = 0; node < node_count_; ++node) {
    memory_.components[node] = node;
  }
  for (EdgeId id = 0; id < edge_count_; ++id) {
    const Edge& e = memory_.edges[id];
    if (!e.enabled) {
      continue;
    }
    const NodeId root_a = find_root(e.a);
    const NodeId root_b = find_root(e.b);
    if (root_a < root_b) {
      memory_.components[root_b] = root_a;
    } else {
      memory_.components[root_a] = root_b;
    }
  }
  // A parent is smaller than its child, so it is final when the child is reached.
  for (NodeId node = 0; node < node_count_; ++node) {
    memory_.components[node] = memory_.components[memory_.components[node]];
  }
}

}  // namespace mellin
