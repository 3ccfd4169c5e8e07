#include "mellin/graph/optimiser.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "graph/edge_terms.hpp"

namespace mellin {
namespace {

using graph_detail::Direction;
using graph_detail::EdgeTerms;

/// A rise of the cost by this share is rounding, not a worse pose.
constexpr double kRounding = 1e-9;
constexpr double kFirstDamping = 1e-4;
constexpr double kDampingFactor = 10.0;
constexpr double kMaxDamping = 1e8;
/// Undamped steps in a row that may raise the cost over the best so far.
constexpr std::uint32_t kPatience = 4;

/// Graduated non-convexity: the factor of its control parameter (Yang et al. 2020), and where the surrogate is so close
/// to the truncated quadratic that the latter takes over.
constexpr double kControlFactor = 1.4;
constexpr double kControlEnd = 30.0;

bool positive(double x) { return is_finite(x) && x > 0.0; }

}  // namespace

Status Optimiser::init(const PoseGraphConfig& config, const Memory& memory) {
  if (const Status status = validate(config); status != Status::ok) {
    return status;
  }
  if (memory.pairs.size() < config.max_edges || memory.weights.size() < config.max_edges ||
      memory.poses.size() < config.max_nodes || memory.trial.size() < config.max_nodes ||
      memory.best.size() < config.max_nodes ||
      memory.vectors.size() < kVectors * 3 * static_cast<std::size_t>(config.max_nodes)) {
    return Status::insufficient_memory;
  }
  if (const Status status = cholesky_.init(limits(config), memory.cholesky); status != Status::ok) {
    return status;
  }
  memory_ = memory;
  config_ = config;
  graph_ = nullptr;
  phase_ = Phase::idle;
  factored_ = false;
  return Status::ok;
}

Span<double> Optimiser::vector(std::size_t which) const {
  const std::size_t size = 3 * static_cast<std::size_t>(nodes_);
  return memory_.vectors.subspan(which * size, size);
}

Status Optimiser::begin(PoseGraph& graph, const OptimiserOptions& options) {
  phase_ = Phase::idle;
  factored_ = false;
  report_ = OptimiserReport{};
  if (graph.node_count() > memory_.poses.size() || graph.edge_count() > memory_.weights.size() ||
      !positive(options.tolerance) || !positive(options.robust_chi2)) {
    return Status::invalid_argument;
  }
  graph_ = &graph;
  options_ = options;
  nodes_ = graph.node_count();
  edges_ = graph.edge_count();
  revision_ = graph.revision();
  direct_ = true;
  damping_ = 0.0;
  astray_ = false;
  patience_ = kPatience;
  restore();
  for (EdgeId id = 0; id < edges_; ++id) {
    memory_.weights[id] = 1.0;
  }
  chi2_ = cost(memory_.poses);
  report_.chi2_initial = report_.chi2_final = chi2_;
  connect_all();
  stage_ = options.start == Start::chordal && options.max_iterations > 0 ? Stage::rotations : Stage::poses;
  phase_ = Phase::order;
  return Status::ok;
}

bool Optimiser::step() {
  if (phase_ == Phase::idle) {
    return false;
  }
  if (graph_->revision() != revision_) {
    report_.status = Status::busy;
    phase_ = Phase::idle;
    return false;
  }
  switch (phase_) {
    case Phase::order:
      order();
      break;
    case Phase::assemble:
      assemble();
      break;
    case Phase::factorise:
      factorise();
      break;
    case Phase::gradients:
      phase_ = iterate_gradients() ? Phase::gradients : Phase::update;
      break;
    case Phase::update:
      update();
      break;
    default:
      write();
      break;
  }
  return phase_ != Phase::idle;
}

/// One pair for each enabled edge between two nodes that move.
void Optimiser::connect_all() {
  for (EdgeId id = 0; id < edges_; ++id) {
    const Edge& e = graph_->edge(id);
    const bool couples = e.enabled && !fixed(e.a) && !fixed(e.b);
    memory_.pairs[id] = couples ? BlockPair{e.a, e.b} : BlockPair{};
  }
  // The sizes were checked by begin().
  const Status status = cholesky_.ordering().begin(nodes_, memory_.pairs.first(edges_));
  assert(status == Status::ok);
  (void)status;
}

void Optimiser::order() {
  const Status status = cholesky_.ordering().analyse(config_.work_per_step);
  if (status == Status::busy) {
    return;
  }
  if (status == Status::full) {
    report_.fill_status = Status::full;
    direct_ = false;
    connect_tree();
    return;
  }
  report_.fill = cholesky_.ordering().fill();
  if (stage_ == Stage::poses) {
    begin_poses();
  }
  phase_ = Phase::assemble;
  if (stage_ == Stage::poses && options_.max_iterations == 0) {
    finish_poses();
  }
}

/// What an edge adds to the linear problem of the present stage.
EdgeTerms Optimiser::terms(EdgeId id) const {
  const Edge& e = graph_->edge(id);
  const Pose2& a = memory_.poses[e.a];
  const Pose2& b = memory_.poses[e.b];
  const double weight = memory_.weights[id];
  switch (stage_) {
    case Stage::rotations: {
      const SinCos r_a = sincos(a.theta);
      const SinCos r_b = sincos(b.theta);
      return graph_detail::rotation_terms(e, weight, fixed(e.a) ? Direction{r_a.cos, r_a.sin} : Direction{},
                                          fixed(e.b) ? Direction{r_b.cos, r_b.sin} : Direction{});
    }
    case Stage::translations:
      return graph_detail::translation_terms(e, weight, a, b);
    default:
      return graph_detail::pose_terms(e, weight, a, b);
  }
}

/// H and -g at the present poses; g into vector 0, the diagonal of H into vector 4.
void Optimiser::assemble() {
  cholesky_.clear();
  Span<double> right = vector(0);
  Span<double> diagonal = vector(4);
  std::fill(right.begin(), right.end(), 0.0);
  std::fill(diagonal.begin(), diagonal.end(), 0.0);
  for (NodeId node = 0; node < nodes_; ++node) {
    if (fixed(node)) {
      cholesky_.add_diagonal(node, Lower3{{1.0, 0.0, 1.0, 0.0, 0.0, 1.0}});
    }
  }
  for (EdgeId id = 0; id < edges_; ++id) {
    const Edge& e = graph_->edge(id);
    if (!in_system(e)) {
      continue;
    }
    const EdgeTerms t = terms(id);
    const std::size_t at_a = 3 * static_cast<std::size_t>(cholesky_.ordering().position(e.a));
    const std::size_t at_b = 3 * static_cast<std::size_t>(cholesky_.ordering().position(e.b));
    constexpr int kDiagonal[3] = {0, 2, 5};
    for (std::size_t i = 0; i < 3; ++i) {
      right[at_a + i] -= fixed(e.a) ? 0.0 : t.g_a[i];
      right[at_b + i] -= fixed(e.b) ? 0.0 : t.g_b[i];
      diagonal[at_a + i] += t.aa.m[kDiagonal[i]];
      diagonal[at_b + i] += t.bb.m[kDiagonal[i]];
    }
    if (direct_ || memory_.pairs[id].a != memory_.pairs[id].b || fixed(e.a) || fixed(e.b)) {
      add_to_matrix(id, t);
    }
  }
  cholesky_.damp(damping_);
  cholesky_.begin_factorise();
  phase_ = Phase::factorise;
}

void Optimiser::add_to_matrix(EdgeId id, const EdgeTerms& t) {
  const Edge& e = graph_->edge(id);
  if (!fixed(e.a)) {
    cholesky_.add_diagonal(e.a, t.aa);
  }
  if (!fixed(e.b)) {
    cholesky_.add_diagonal(e.b, t.bb);
  }
  if (!fixed(e.a) && !fixed(e.b)) {
    cholesky_.add_off_diagonal(id, {e.a, e.b}, t.ab);
  }
}

void Optimiser::factorise() {
  const Status status = cholesky_.factorise(config_.work_per_step);
  if (status == Status::busy) {
    return;
  }
  if (status != Status::ok) {
    give_way();
    return;
  }
  if (stage_ == Stage::marginals) {
    factored_ = true;
    phase_ = Phase::write;
    return;
  }
  if (direct_) {
    cholesky_.solve(vector(0));
    phase_ = Phase::update;
  } else {
    begin_gradients();
    phase_ = Phase::gradients;
  }
}

/// After a matrix that is not positive definite: damping, the given poses in place of the chordal start, no marginals.
void Optimiser::give_way() {
  switch (stage_) {
    case Stage::poses:
      ++report_.iterations;
      reject();
      break;
    case Stage::marginals:
      report_.status = Status::degenerate;
      phase_ = Phase::write;
      break;
    default:
      stage_ = Stage::poses;
      restore();
      begin_poses();
      phase_ = Phase::assemble;
      break;
  }
}

/// The poses as they were given.
void Optimiser::restore() {
  for (NodeId node = 0; node < nodes_; ++node) {
    memory_.poses[node] = graph_->pose(node);
  }
}

void Optimiser::update() {
  switch (stage_) {
    case Stage::rotations:
      set_rotations();
      stage_ = Stage::translations;
      phase_ = Phase::assemble;
      break;
    case Stage::translations:
      set_translations();
      stage_ = Stage::poses;
      begin_poses();
      phase_ = Phase::assemble;
      break;
    default:
      ++report_.iterations;
      try_step();
      break;
  }
}

/// Headings from the relaxed vectors; the translations start from zero.
void Optimiser::set_rotations() {
  const Span<double> x = vector(direct_ ? 0 : 1);
  for (NodeId node = 0; node < nodes_; ++node) {
    if (!fixed(node)) {
      const std::size_t at = 3 * static_cast<std::size_t>(cholesky_.ordering().position(node));
      memory_.poses[node] = {0.0, 0.0, mellin::atan2(x[at + 1], x[at])};
    }
  }
}

void Optimiser::set_translations() {
  const Span<double> x = vector(direct_ ? 0 : 1);
  for (NodeId node = 0; node < nodes_; ++node) {
    if (!fixed(node)) {
      const std::size_t at = 3 * static_cast<std::size_t>(cholesky_.ordering().position(node));
      memory_.poses[node].x = x[at];
      memory_.poses[node].y = x[at + 1];
    }
  }
}

/// The cost falls back on the given poses where the start has lost them.
void Optimiser::begin_poses() {
  chi2_ = cost(memory_.poses);
  if (!is_finite(chi2_)) {
    restore();
    chi2_ = cost(memory_.poses);
  }
  begin_kernel();
}

void Optimiser::try_step() {
  const Span<double> x = vector(direct_ ? 0 : 1);
  for (NodeId node = 0; node < nodes_; ++node) {
    const Pose2& p = memory_.poses[node];
    const std::size_t at = 3 * static_cast<std::size_t>(cholesky_.ordering().position(node));
    memory_.trial[node] = fixed(node) ? p : Pose2{p.x + x[at], p.y + x[at + 1], wrap_angle(p.theta + x[at + 2])};
  }
  const double chi2 = cost(memory_.trial);
  if (is_finite(chi2) && chi2 <= chi2_ * (1.0 + kRounding)) {
    accept(chi2);
  } else if (is_finite(chi2) && damping_ == 0.0 && patience_ > 0) {
    go_astray();
  } else {
    reject();
  }
}

void Optimiser::accept(double chi2) {
  std::swap(memory_.poses, memory_.trial);
  astray_ = false;
  patience_ = patience_ > 0 ? kPatience : 0;
  const bool small = chi2_ - chi2 <= options_.tolerance * chi2;
  const bool undamped = damping_ <= kFirstDamping;
  chi2_ = chi2;
  damping_ = undamped ? 0.0 : damping_ / kDampingFactor;
  const bool same_weights = weigh();
  report_.converged = small && undamped && same_weights;
  if (report_.converged || report_.iterations >= options_.max_iterations) {
    finish_poses();
  } else {
    phase_ = Phase::assemble;
  }
}

/// Goes on from a worse pose, as Gauss-Newton may have to cross a ridge; the best is kept (a watchdog: Chamberlain,
/// Powell, Lemarechal, Pedersen 1982).
void Optimiser::go_astray() {
  if (!astray_) {
    std::swap(memory_.best, memory_.poses);
    astray_ = true;
  }
  std::swap(memory_.poses, memory_.trial);
  --patience_;
  phase_ = Phase::assemble;
  if (report_.iterations >= options_.max_iterations) {
    finish_poses();
  }
}

/// Back to the best poses, with more damping.
void Optimiser::reject() {
  if (astray_) {
    std::swap(memory_.best, memory_.poses);
    astray_ = false;
  }
  patience_ = 0;
  damping_ = damping_ == 0.0 ? kFirstDamping : damping_ * kDampingFactor;
  phase_ = Phase::assemble;
  if (damping_ > kMaxDamping || report_.iterations >= options_.max_iterations) {
    report_.status = damping_ > kMaxDamping ? Status::degenerate : Status::ok;
    finish_poses();
  }
}

void Optimiser::finish_poses() {
  if (astray_) {
    std::swap(memory_.best, memory_.poses);
    astray_ = false;
  }
  report_.chi2_final = chi2_;
  damping_ = 0.0;
  stage_ = Stage::marginals;
  phase_ = options_.marginals ? Phase::assemble : Phase::write;
}

void Optimiser::write() {
  for (NodeId node = 0; node < nodes_; ++node) {
    if (!fixed(node) && graph_->set_pose(node, memory_.poses[node]) != Status::ok) {
      report_.status = Status::degenerate;
    }
  }
  for (EdgeId id = 0; id < edges_; ++id) {
    const Edge& e = graph_->edge(id);
    report_.rejected += under_kernel(e) && memory_.weights[id] < 0.5 ? 1U : 0U;
    if (graph_->set_weight(id, memory_.weights[id]) != Status::ok) {
      report_.status = Status::degenerate;
    }
  }
  revision_ = graph_->revision();
  phase_ = Phase::idle;
}

double Optimiser::edge_cost(EdgeId id, Span<const Pose2> poses) const {
  const Edge& e = graph_->edge(id);
  return edge_chi2(e, poses[e.a], poses[e.b]);
}

/// Weighted, with the weights held.
double Optimiser::cost(Span<const Pose2> poses) const {
  double sum = 0.0;
  for (EdgeId id = 0; id < edges_; ++id) {
    if (graph_->edge(id).enabled && memory_.weights[id] > 0.0) {
      sum += memory_.weights[id] * edge_cost(id, poses);
    }
  }
  return sum;
}

/// The control parameter starts where the surrogate is convex at the largest error.
void Optimiser::begin_kernel() {
  kernel_done_ = true;
  if (!options_.robust) {
    return;
  }
  double largest = 0.0;
  for (EdgeId id = 0; id < edges_; ++id) {
    if (under_kernel(graph_->edge(id))) {
      largest = std::max(largest, edge_cost(id, memory_.poses));
    }
  }
  const double spread = 2.0 * largest - options_.robust_chi2;
  kernel_done_ = !(spread > 0.0);
  control_ = kernel_done_ ? kControlEnd : options_.robust_chi2 / spread / kControlFactor;
  (void)weigh();
}

/// Weights of the truncated quadratic's surrogate at the present errors (Yang et al. 2020, eq. 14), one notch sharper.
/// Returns whether the kernel is sharp and the weights are those of the last call.
bool Optimiser::weigh() {
  if (!options_.robust) {
    return true;
  }
  bool same = kernel_done_;
  control_ *= kControlFactor;
  kernel_done_ = kernel_done_ || control_ >= kControlEnd;
  const double bar = options_.robust_chi2;
  const double inlier = kernel_done_ ? bar : bar * control_ / (control_ + 1.0);
  const double outlier = kernel_done_ ? bar : bar * (control_ + 1.0) / control_;
  for (EdgeId id = 0; id < edges_; ++id) {
    if (!under_kernel(graph_->edge(id))) {
      continue;
    }
    const double chi2 = edge_cost(id, memory_.poses);
    double weight = chi2 <= inlier ? 1.0 : 0.0;
    if (chi2 > inlier && chi2 < outlier) {
      weight = std::clamp(sqrt(bar / chi2 * control_ * (control_ + 1.0)) - control_, 0.0, 1.0);
    }
    same = same && weight == memory_.weights[id];
    memory_.weights[id] = weight;
  }
  chi2_ = cost(memory_.poses);
  return same;
}

}  // namespace mellin
