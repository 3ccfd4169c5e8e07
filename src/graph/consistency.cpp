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

Result<ConsistentSet> find_consistent(Span<const LoopHypothesis> hypotheses, const MapQuery& map,
                                      const ConsistencyOptions& options) {
  const std::size_t n = hypotheses.size();
  if (n > kMaxHypotheses || map.relative == nullptr || !positive(options.gate_chi2) || options.search_limit == 0) {
    return Status::invalid_argument;
  }
  for (const LoopHypothesis& h : hypotheses) {
    if (!usable(h)) {
      return Status::bad_data;
    }
  }
  LinkMatrix consistent;
  LinkMatrix independent;  // consistent, and no scans shared: a clique of it is a set of witnesses
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      if (agree(map, hypotheses[i], hypotheses[j], options.gate_chi2)) {
        link(consistent, i, j);
        if (!share_scans(map, hypotheses[i], hypotheses[j])) {
          link(independent, i, j);
        }
      }
    }
  }
  const std::uint64_t all = n == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1;
  std::uint32_t limit = options.search_limit;
  ConsistentSet set;
  set.witnesses = maximum_clique(independent, all, limit);
  set.exact = limit > 0;
  limit = options.search_limit;
  const std::uint64_t others = linked_to_all(consistent, set.witnesses, all & ~set.witnesses);
  set.members = set.witnesses | maximum_clique(consistent, others, limit);
  set.exact = set.exact && limit > 0;
  set.member_count = static_cast<std::uint32_t>(__builtin_popcountll(set.members));
  set.witness_count = static_cast<std::uint32_t>(__builtin_popcountll(set.witnesses));
  return set;
}

}  // namespace mellin
