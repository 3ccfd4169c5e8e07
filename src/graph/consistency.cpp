#include "mellin/graph/consistency.hpp"

#include <cassert>
#include <limits>

namespace mellin {
namespace {

RelativePose compose(const RelativePose& a_T_b, const RelativePose& b_T_c) {
  return {mellin::compose(a_T_b.a_T_b, b_T_c.a_T_b),
          compose_covariance(a_T_b.a_T_b, a_T_b.covariance, b_T_c.a_T_b, b_T_c.covariance)};
}

RelativePose inverse(const RelativePose& a_T_b) {
  return {mellin::inverse(a_T_b.a_T_b), inverse_covariance(a_T_b.a_T_b, a_T_b.covariance)};
}

/// The same hypothesis seen from its other end.
LoopHypothesis exchanged(const LoopHypothesis& h) { return {h.b, h.a, inverse(h.measured), h.witness}; }

bool ask(const MapQuery& map, NodeId from, NodeId to, RelativePose& out) {
  if (from == to) {
    out = RelativePose{};
    return true;
  }
  return map.relative(map.context, from, to, out) == Status::ok && is_finite(out.a_T_b);
}

/// Whether two hypotheses with their ends in this order pass the gate; false where the map cannot tell.
bool agree_in_order(const MapQuery& map, const LoopHypothesis& first, const LoopHypothesis& second, double gate) {
  RelativePose b1_T_b2;
  RelativePose a2_T_a1;
  return ask(map, first.b, second.b, b1_T_b2) && ask(map, second.a, first.a, a2_T_a1) &&
         pair_chi2(first.measured, b1_T_b2, second.measured, a2_T_a1) <= gate;
}

bool agree(const MapQuery& map, const LoopHypothesis& first, const LoopHypothesis& second, double gate) {
  return agree_in_order(map, first, second, gate) || agree_in_order(map, first, exchanged(second), gate);
}

bool share_scans(const MapQuery& map, const LoopHypothesis& first, const LoopHypothesis& second) {
  return map.share_scans != nullptr ? map.share_scans(map.context, first, second) : first.witness == second.witness;
}

bool usable(const LoopHypothesis& h) {
  Sym3 inverted;
  return is_finite(h.measured.a_T_b) && invert(h.measured.covariance, inverted);
}

bool positive(double x) { return is_finite(x) && x > 0.0; }

void link(LinkMatrix& matrix, std::size_t i, std::size_t j) {
  matrix.rows[i] |= std::uint64_t{1} << j;
  matrix.rows[j] |= std::uint64_t{1} << i;
}

/// Those of `candidates` that are linked to every one of `members`.
std::uint64_t linked_to_all(const LinkMatrix& links, std::uint64_t members, std::uint64_t candidates) {
  for (std::uint64_t left = members; left != 0; left &= left - 1) {
    candidates &= links.rows[__builtin_ctzll(left)];
  }
  return candidates;
}

}  // namespace

double identity_chi2(const Pose2& pose, const Sym3& covariance) {
  Sym3 information;
  if (!invert(covariance, information)) {
    return std::numeric_limits<double>::infinity();
  }
  return quadratic_form(information, {pose.x, pose.y, wrap_angle(pose.theta)});
}

double hypothesis_chi2(const RelativePose& measured, const RelativePose& in_map) {
  const RelativePose loop = compose(measured, inverse(in_map));
  return identity_chi2(loop.a_T_b, loop.covariance);
}

double pair_chi2(const RelativePose& z1, const RelativePose& b1_T_b2, const RelativePose& z2,
                 const RelativePose& a2_T_a1) {
  const RelativePose loop = compose(compose(compose(z1, b1_T_b2), inverse(z2)), a2_T_a1);
  return identity_chi2(loop.a_T_b, loop.covariance);
}

Status ConsistencySearch::begin(Span<const LoopHypothesis> hypotheses, const MapQuery& map,
                                const ConsistencyOptions& options) {
  stage_ = Stage::done;
  set_ = ConsistentSet{};
  if (hypotheses.size() > kMaxHypotheses || map.relative == nullptr || !positive(options.gate_chi2) ||
      options.search_limit == 0) {
    return Status::invalid_argument;
  }
  for (const LoopHypothesis& h : hypotheses) {
    if (!usable(h)) {
      return Status::bad_data;
    }
  }
  hypotheses_ = hypotheses;
  map_ = map;
  options_ = options;
  consistent_ = LinkMatrix{};
  independent_ = LinkMatrix{};
  first_ = 0;
  second_ = 1;
  stage_ = hypotheses.size() < 2 ? Stage::witnesses : Stage::pairs;
  return Status::ok;
}

std::uint64_t ConsistencySearch::all() const {
  const std::size_t n = hypotheses_.size();
  return n == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1;
}

bool ConsistencySearch::step() {
  std::uint32_t limit = options_.search_limit;
  switch (stage_) {
    case Stage::pairs:
      compare();
      break;
    case Stage::witnesses:
      set_.witnesses = maximum_clique(independent_, all(), limit);
      set_.exact = limit > 0;
      stage_ = Stage::others;
      break;
    case Stage::others: {
      const std::uint64_t others = linked_to_all(consistent_, set_.witnesses, all() & ~set_.witnesses);
      set_.members = set_.witnesses | maximum_clique(consistent_, others, limit);
      set_.exact = set_.exact && limit > 0;
      set_.member_count = static_cast<std::uint32_t>(__builtin_popcountll(set_.members));
      set_.witness_count = static_cast<std::uint32_t>(__builtin_popcountll(set_.witnesses));
      stage_ = Stage::done;
      break;
    }
    case Stage::done:
      break;
  }
  return stage_ != Stage::done;
}

/// The next pair.
void ConsistencySearch::compare() {
  const LoopHypothesis& first = hypotheses_[first_];
  const LoopHypothesis& second = hypotheses_[second_];
  if (agree(map_, first, second, options_.gate_chi2)) {
    link(consistent_, first_, second_);
    if (!share_scans(map_, first, second)) {
      link(independent_, first_, second_);
    }
  }
  ++second_;
  if (second_ == hypotheses_.size()) {
    ++first_;
    second_ = static_cast<std::uint8_t>(first_ + 1);
    stage_ = second_ == hypotheses_.size() ? Stage::witnesses : Stage::pairs;
  }
}

Result<ConsistentSet> find_consistent(Span<const LoopHypothesis> hypotheses, const MapQuery& map,
                                      const ConsistencyOptions& options) {
  ConsistencySearch search;
  const Status status = search.begin(hypotheses, map, options);
  if (status != Status::ok) {
    return status;
  }
  while (search.step()) {
  }
  return search.result();
}

}  // namespace mellin
