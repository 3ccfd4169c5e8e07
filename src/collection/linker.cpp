#include "mellin/collection/linker.hpp"

namespace mellin {

const char* to_string(LinkReason reason) {
  switch (reason) {
    case LinkReason::none:
      return "";
    case LinkReason::weak:
      return "weak or undetermined match";
    case LinkReason::waiting:
      return "waiting for a second witness";
    case LinkReason::contradicts_map:
      return "contradicts the graph";
    case LinkReason::confirmed_by_map:
      return "confirmed by the graph";
    case LinkReason::confirmed_by_set:
      return "confirmed by other hypotheses";
    case LinkReason::outlier:
      return "rejected by the robust optimisation";
    case LinkReason::forgotten:
      return "dropped for lack of room";
    case LinkReason::redundant:
      return "the graph knows as much without it";
    case LinkReason::coarse_mismatch:
      return "coarse digests do not match";
    case LinkReason::no_rotation:
      return "no rotation stands out";
  }
  return "unknown";
}

bool share_scans(const NodeScans& a, const NodeScans& b) {
  return a.session == b.session && a.first < std::uint64_t{b.first} + b.count &&
         b.first < std::uint64_t{a.first} + a.count && a.count > 0 && b.count > 0;
}

Status Linker::relative(void* context, NodeId from, NodeId to, RelativePose& out) {
  const Case& self = *static_cast<const Case*>(context);
  if (self.graph->component(from) != self.graph->component(to)) {
    return Status::degenerate;
  }
  out.a_T_b = between(self.graph->pose(from), self.graph->pose(to));
  if (from == to) {
    out.covariance = Sym3{};
    return Status::ok;
  }
  const Result<Sym3> covariance = self.optimiser->relative_covariance(from, to);
  if (!covariance.ok()) {
    return covariance.status();
  }
  out.covariance = covariance.value();
  return Status::ok;
}

bool Linker::shared(void* context, const LoopHypothesis& first, const LoopHypothesis& second) {
  const Case& self = *static_cast<const Case*>(context);
  return share_scans(self.scans[first.a], self.scans[second.a]) ||
         share_scans(self.scans[first.b], self.scans[second.b]);
}

namespace {

/// What an edge must tell grows by this many times as the graph fills …
constexpr double kDemandGrowth = 3.0;
/// … and beyond this share of the room is so many times what it was at first: that room is for the loop that closes
/// late and mends much.
constexpr double kReserveFrom = 0.9;
constexpr double kReserveDemand = 8.0;
/// Nodes of the search for a set, which bounds a slice. Sets that decide anything are found within far fewer.
constexpr std::uint32_t kSearchLimit = 500;
constexpr double kLn2 = 0.69314718055994530942;

/// Each node that may still come needs room for its odometry edge.
bool has_room(const PoseGraph& graph) {
  return graph.edge_capacity() - graph.edge_count() > graph.node_capacity() - graph.node_count();
}

double share(double used, double of) { return of > 0.0 ? used / of : 1.0; }

/// Share of the room for loop and merge edges that is taken, in the list of edges or in the factor, whichever is more.
/// What odometry edges take, a block of fill each among it, is theirs.
double room_taken(const PoseGraph& graph, const Optimiser& optimiser) {
  const double nodes = graph.node_count();
  const double node_room = graph.node_capacity();
  const double edges = share(graph.edge_count() - nodes, graph.edge_capacity() - node_room);
  const double fill = share(optimiser.report().fill - nodes, optimiser.fill_capacity() - node_room);
  return edges > fill ? edges : fill;
}

double demand(double taken) { return taken > kReserveFrom ? kReserveDemand : 1.0 + kDemandGrowth * taken; }

/// Whether an edge with this covariance would tell less than `bits` of a pose that the graph knows with that one.
bool tells_too_little(const Sym3& of_edge, const Sym3& in_map, double bits) {
  return determinant(of_edge + in_map) < exp(2.0 * kLn2 * bits) * determinant(of_edge);
}

/// Of the covariance of the position.
double larger_eigenvalue(const Sym3& covariance) {
  const double mean = 0.5 * (covariance.xx + covariance.yy);
  const double half = 0.5 * (covariance.xx - covariance.yy);
  return mean + sqrt(half * half + covariance.xy * covariance.xy);
}

}  // namespace

bool Linker::worth_keeping(const PlaceHypothesis& place) const {
  const double m = static_cast<double>(config_.max_sigma_m);
  const double rad = static_cast<double>(config_.max_sigma_rad);
  return place.agreement >= config_.min_agreement && place.overlap >= config_.min_overlap &&
         larger_eigenvalue(place.covariance) <= m * m && place.covariance.tt <= rad * rad;
}

void Linker::add(NodeId a, NodeId b, const PlaceHypothesis& place) {
  PendingLink link;
  link.hypothesis.a = a;
  link.hypothesis.b = b;
  link.hypothesis.measured.a_T_b = place.a_T_b;
  const auto warp_m = static_cast<double>(config_.warp_sigma_m);
  const auto warp_rad = static_cast<double>(config_.warp_sigma_rad);
  link.hypothesis.measured.covariance =
      place.covariance + diagonal(warp_m * warp_m, warp_m * warp_m, warp_rad * warp_rad);
  link.agreement = place.agreement;
  link.overlap = place.overlap;
  link.peak = place.peak;
  if (pending_.full()) {
    std::size_t least = 0;
    for (std::size_t i = 1; i < pending_.size(); ++i) {
      least = pending_[i].agreement < pending_[least].agreement ? i : least;
    }
    pending_.erase(least);
  }
  (void)pending_.push(link);
}

bool Linker::known_well(const Sym3& covariance) const {
  const auto m = static_cast<double>(config_.single_sigma_m);
  const auto rad = static_cast<double>(config_.single_sigma_rad);
  return covariance.xx <= m * m && covariance.yy <= m * m && covariance.tt <= rad * rad;
}

void Linker::begin(PoseGraph& graph, Optimiser& optimiser, Span<const NodeScans> scans, void* context,
                   Decided decided) {
  const double min_gain_bits = static_cast<double>(config_.min_gain_bits) * demand(room_taken(graph, optimiser));
  case_ = {&graph, &optimiser, scans, context, decided, min_gain_bits};
  next_ = 0;
  alone_ = 0;
  eligible_ = 0;
  added_ = 0;
  stage_ = Stage::weigh;
}

bool Linker::step() {
  switch (stage_) {
    case Stage::idle:
      break;
    case Stage::weigh:
      if (next_ < pending_.size()) {
        weigh_next();
      } else if (alone_ != 0) {
        accept(alone_, LinkReason::confirmed_by_map);
        stage_ = Stage::idle;
      } else {
        next_group();
      }
      break;
    case Stage::search:
      if (!search_.step()) {
        finish_group();
      }
      break;
  }
  return stage_ != Stage::idle;
}

/// One hypothesis against the graph.
void Linker::weigh_next() {
  PendingLink& link = pending_[next_];
  const LoopHypothesis& h = link.hypothesis;
  const std::uint64_t bit = std::uint64_t{1} << next_;
  const LinkReason before = link.reason;
  RelativePose in_map;
  if (case_.graph->component(h.a) != case_.graph->component(h.b)) {
    link.reason = LinkReason::waiting;
    eligible_ |= bit;
  } else if (relative(&case_, h.a, h.b, in_map) == Status::ok) {
    link.graph_chi2 = hypothesis_chi2(h.measured, in_map);
    const bool fits = link.graph_chi2 <= config_.graph_gate_chi2;
    link.reason = fits ? LinkReason::waiting : LinkReason::contradicts_map;
    const Sym3 of_edge = scale(h.measured.covariance, 1.0 / static_cast<double>(config_.information_share));
    if (fits && case_.min_gain_bits > 0.0 && tells_too_little(of_edge, in_map.covariance, case_.min_gain_bits)) {
      link.reason = LinkReason::redundant;
      case_.decided(case_.context, link, kNoId);
      pending_.erase(next_);
      return;
    }
    eligible_ |= fits ? bit : 0;
    alone_ |= fits && known_well(in_map.covariance) && link.agreement >= config_.single_agreement ? bit : 0;
  }
  if (link.reason != before) {
    case_.decided(case_.context, link, kNoId);
  }
  ++next_;
}

/// The group of the last of the eligible ones; none is left: all is judged.
void Linker::next_group() {
  if (eligible_ == 0) {
    stage_ = Stage::idle;
    return;
  }
  group_ = same_components(63U - static_cast<std::size_t>(__builtin_clzll(eligible_)));
  std::size_t count = 0;
  for (std::uint64_t left = group_.members; left != 0; left &= left - 1) {
    candidates_[count++] = pending_[static_cast<std::size_t>(__builtin_ctzll(left))].hypothesis;
  }
  ConsistencyOptions options;
  options.gate_chi2 = config_.pair_gate_chi2;
  options.search_limit = kSearchLimit;
  const Status status = search_.begin(candidates_.first(count), {&case_, relative, shared}, options);
  if (status == Status::ok) {
    stage_ = Stage::search;
  } else {
    eligible_ &= ~group_.members;
    stage_ = Stage::weigh;
  }
}

Linker::Group Linker::same_components(std::size_t index) const {
  const PoseGraph& graph = *case_.graph;
  const LoopHypothesis& seed = pending_[index].hypothesis;
  const NodeId ca = graph.component(seed.a);
  const NodeId cb = graph.component(seed.b);
  Group group;
  group.merges = ca != cb;
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    const LoopHypothesis& h = pending_[i].hypothesis;
    const NodeId da = graph.component(h.a);
    const NodeId db = graph.component(h.b);
    if ((eligible_ >> i & 1U) != 0 && ((da == ca && db == cb) || (da == cb && db == ca))) {
      group.members |= std::uint64_t{1} << i;
    }
  }
  return group;
}

void Linker::finish_group() {
  const ConsistentSet& set = search_.result();
  const std::uint32_t needed = group_.merges ? config_.merge_witnesses : config_.loop_witnesses;
  if (set.witness_count < needed) {
    eligible_ &= ~group_.members;  // from another of its hypotheses the same group would be asked the same again
    stage_ = Stage::weigh;
    return;
  }
  std::uint64_t members = 0;
  std::size_t place = 0;
  for (std::uint64_t left = group_.members; left != 0; left &= left - 1, ++place) {
    members |= (set.members >> place & 1U) != 0 ? left & (~left + 1) : 0;
  }
  accept(members, LinkReason::confirmed_by_set);
  stage_ = Stage::idle;
}

void Linker::accept(std::uint64_t members, LinkReason reason) {
  PoseGraph& graph = *case_.graph;
  for (std::size_t i = pending_.size(); i-- > 0;) {
    if ((members >> i & 1U) == 0) {
      continue;
    }
    PendingLink link = pending_[i];
    const LoopHypothesis& h = link.hypothesis;
    Sym3 information;
    if (!has_room(graph)) {
      continue;  // the hypothesis keeps waiting
    }
    if (information_from_covariance(h.measured.a_T_b, h.measured.covariance, information)) {
      const EdgeKind kind = case_.scans[h.a].session == case_.scans[h.b].session ? EdgeKind::loop : EdgeKind::merge;
      const Result<EdgeId> edge = graph.add_edge(h.a, h.b, kind, h.measured.a_T_b,
                                                 scale(information, static_cast<double>(config_.information_share)));
      if (!edge.ok()) {
        continue;
      }
      link.reason = reason;
      case_.decided(case_.context, link, edge.value());
      ++added_;
    }
    pending_.erase(i);
  }
}

}  // namespace mellin
