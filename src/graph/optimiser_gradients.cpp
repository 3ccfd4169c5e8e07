// The optimiser's way for graphs whose factor does not fit: conjugate gradients, preconditioned with the factor of a
// spanning tree, and relative covariances by either way.
#include <algorithm>

#include "graph/edge_terms.hpp"
#include "mellin/graph/optimiser.hpp"

namespace mellin {
namespace {

using graph_detail::EdgeTerms;

/// The residual, in the preconditioner's norm, is to shrink by the square root of this.
constexpr double kResidualReduction = 1e-14;

double dot(Span<const double> a, Span<const double> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += a[i] * b[i];
  }
  return sum;
}

/// out += block x or block^T x
void add_product(const Block3& block, bool transposed, const double* x, double* out) {
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      out[row] += (transposed ? block.m[3 * col + row] : block.m[3 * row + col]) * x[col];
    }
  }
}

Block3 symmetric(const Lower3& l) { return {{l.m[0], l.m[1], l.m[3], l.m[1], l.m[2], l.m[4], l.m[3], l.m[4], l.m[5]}}; }

}  // namespace

/// Keeps the pairs of a spanning forest: odometry edges first, then the others, in the order in which they were added.
/// Its factor has no fill, since a tree's leaves are eliminated first.
void Optimiser::connect_tree() {
  // Union-find over the analysis' work space, which its begin() sets up anew.
  Span<std::uint32_t> parent = cholesky_.ordering().scratch(0);
  for (NodeId node = 0; node < nodes_; ++node) {
    parent[node] = node;
  }
  const auto root = [parent](NodeId node) {
    while (parent[node] != node) {
      parent[node] = parent[parent[node]];
      node = parent[node];
    }
    return node;
  };
  for (EdgeId id = 0; id < edges_; ++id) {
    memory_.pairs[id] = BlockPair{};
  }
  for (const bool odometry : {true, false}) {
    for (EdgeId id = 0; id < edges_; ++id) {
      const Edge& e = graph_->edge(id);
      if (!e.enabled || (e.kind == EdgeKind::odometry) != odometry || fixed(e.a) || fixed(e.b)) {
        continue;
      }
      const NodeId root_a = root(e.a);
      const NodeId root_b = root(e.b);
      if (root_a != root_b) {
        parent[root_b] = root_a;
        memory_.pairs[id] = BlockPair{e.a, e.b};
      }
    }
  }
  if (cholesky_.ordering().begin(nodes_, memory_.pairs.first(edges_)) != Status::ok) {
    report_.status = Status::degenerate;
    phase_ = Phase::write;
  }
}

/// out = H x, edge by edge, with the damping.
void Optimiser::multiply(Span<const double> x, Span<double> out) const {
  const Span<double> diagonal = vector(4);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = damping_ * diagonal[i] * x[i];
  }
  for (EdgeId id = 0; id < edges_; ++id) {
    const Edge& e = graph_->edge(id);
    if (!in_system(e)) {
      continue;
    }
    const EdgeTerms t = terms(id);
    const std::size_t at_a = 3 * static_cast<std::size_t>(cholesky_.ordering().position(e.a));
    const std::size_t at_b = 3 * static_cast<std::size_t>(cholesky_.ordering().position(e.b));
    const double* const x_a = x.data() + at_a;
    const double* const x_b = x.data() + at_b;
    if (!fixed(e.a)) {
      add_product(symmetric(t.aa), false, x_a, out.data() + at_a);
      if (!fixed(e.b)) {
        add_product(t.ab, false, x_b, out.data() + at_a);
        add_product(t.ab, true, x_a, out.data() + at_b);
      }
    }
    if (!fixed(e.b)) {
      add_product(symmetric(t.bb), false, x_b, out.data() + at_b);
    }
  }
}

/// z = M^-1 r into vector 3, where r is vector 0.
void Optimiser::precondition() {
  const Span<double> r = vector(0);
  const Span<double> z = vector(3);
  std::copy(r.begin(), r.end(), z.begin());
  cholesky_.solve(z);
}

/// Solves H x = vector 0; x is vector 1 (Shewchuk 1994, preconditioned conjugate gradients).
void Optimiser::begin_gradients() {
  const Span<double> x = vector(1);
  std::fill(x.begin(), x.end(), 0.0);
  precondition();
  const Span<double> z = vector(3);
  std::copy(z.begin(), z.end(), vector(2).begin());
  rho_ = dot(vector(0), z);
  rho_stop_ = rho_ * kResidualReduction;
  gradient_steps_ = 0;
}

/// Returns whether another step is needed.
bool Optimiser::iterate_gradients() {
  const std::uint32_t most = 3 * nodes_ + 10;
  if (!(rho_ > rho_stop_) || gradient_steps_++ >= most) {
    return false;
  }
  const Span<double> r = vector(0);
  const Span<double> x = vector(1);
  const Span<double> p = vector(2);
  const Span<double> q = vector(3);
  multiply(p, q);
  const double curvature = dot(p, q);
  if (!(curvature > 0.0)) {
    return false;
  }
  const double alpha = rho_ / curvature;
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] += alpha * p[i];
    r[i] -= alpha * q[i];
  }
  precondition();
  const double rho = dot(r, q);
  const double beta = rho / rho_;
  rho_ = rho;
  for (std::size_t i = 0; i < p.size(); ++i) {
    p[i] = q[i] + beta * p[i];
  }
  return rho_ > rho_stop_;
}

Result<Sym3> Optimiser::relative_covariance(NodeId a, NodeId b) {
  if (phase_ != Phase::idle) {
    return Status::busy;
  }
  if (graph_ == nullptr || !factored_ || graph_->revision() != revision_) {
    return Status::invalid_argument;
  }
  if (a >= nodes_ || b >= nodes_) {
    return Status::not_found;
  }
  if (graph_->component(a) != graph_->component(b)) {
    return Status::degenerate;
  }
  if (a == b) {
    return Sym3{};
  }
  // Derivatives of Xa^-1 Xb by the two poses, transposed.
  const SinCos r = sincos(memory_.poses[a].theta);
  const Pose2 z = between(memory_.poses[a], memory_.poses[b]);
  const Block3 by_a = {{-r.cos, r.sin, 0.0, -r.sin, -r.cos, 0.0, z.y, -z.x, -1.0}};
  const Block3 by_b = {{r.cos, -r.sin, 0.0, r.sin, r.cos, 0.0, 0.0, 0.0, 1.0}};
  if (!direct_) {
    return covariance_by_gradients(a, by_a, b, by_b);
  }
  Block3 c;
  cholesky_.project(cholesky_.ordering().position(a), fixed(a) ? nullptr : &by_a, cholesky_.ordering().position(b),
                    fixed(b) ? nullptr : &by_b, memory_.vectors, c);
  const Sym3 covariance = {c.m[0], c.m[1], c.m[2], c.m[4], c.m[5], c.m[8]};
  if (!is_finite(covariance.xx + covariance.yy + covariance.tt)) {
    return Status::degenerate;
  }
  return covariance;
}

/// B^T H^-1 B, a column of B at a time.
Result<Sym3> Optimiser::covariance_by_gradients(NodeId a, const Block3& by_a, NodeId b, const Block3& by_b) {
  const std::size_t at_a = 3 * static_cast<std::size_t>(cholesky_.ordering().position(a));
  const std::size_t at_b = 3 * static_cast<std::size_t>(cholesky_.ordering().position(b));
  double c[3][3] = {};
  for (std::size_t col = 0; col < 3; ++col) {
    const Span<double> right = vector(0);
    std::fill(right.begin(), right.end(), 0.0);
    for (std::size_t i = 0; i < 3; ++i) {
      right[at_a + i] += fixed(a) ? 0.0 : by_a.m[3 * i + col];
      right[at_b + i] += fixed(b) ? 0.0 : by_b.m[3 * i + col];
    }
    begin_gradients();
    while (iterate_gradients()) {
    }
    const Span<double> x = vector(1);
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t i = 0; i < 3; ++i) {
        c[row][col] +=
            (fixed(a) ? 0.0 : by_a.m[3 * i + row] * x[at_a + i]) + (fixed(b) ? 0.0 : by_b.m[3 * i + row] * x[at_b + i]);
      }
    }
  }
  if (!is_finite(c[0][0] + c[1][1] + c[2][2])) {
    return Status::degenerate;
  }
  return Sym3{c[0][0], c[1][0], c[2][0], c[1][1], c[2][1], c[2][2]};
}

}  // namespace mellin
