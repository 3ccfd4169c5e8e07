// Which loop hypotheses agree with one another. A wrong loop closure wrecks a map, and single matches cannot always be
// told apart; hypotheses that are wrong rarely agree, so the largest set in which all pairs do is kept (pairwise
// consistency maximisation: Mangelson, Dominic, Eustice, Vasudevan 2018; Olson 2009 on the underlying test).
//
// Independent evidence counts, not the number of edges: submaps that share scans see the same thing twice. Hypotheses
// of one witness may all be in the set, but count once.
#pragma once

#include <cstdint>

#include "mellin/core/containers.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/graph/pose_graph.hpp"

namespace mellin {

/// Most hypotheses in one call: a set of them is one 64-bit word.
inline constexpr std::size_t kMaxHypotheses = 64;

/// A relative pose with its covariance over its own parameters (x, y in the first frame, theta).
struct RelativePose {
  Pose2 a_T_b;
  Sym3 covariance;
};

/// "Node b lies at a_T_b in node a's frame", from a matcher.
struct LoopHypothesis {
  NodeId a = kNoId;
  NodeId b = kNoId;
  RelativePose measured;      ///< a_T_b
  std::uint32_t witness = 0;  ///< hypotheses with the same number rest on the same scans
};

/// What the map says, asked by find_consistent(): typically Optimiser::relative_covariance() and PoseGraph::pose().
struct MapQuery {
  void* context = nullptr;
  /// The pose of node `to` in the frame of node `from`, with covariance; anything but ok where the map does not know
  /// (another component). Asked with from == to, it need not answer: that is the identity, exactly.
  Status (*relative)(void* context, NodeId from, NodeId to, RelativePose& out) = nullptr;
  /// Whether two hypotheses rest on shared scans; null: when their witness numbers are equal.
  bool (*share_scans)(void* context, const LoopHypothesis& first, const LoopHypothesis& second) = nullptr;
};

struct ConsistencyOptions {
  double gate_chi2 = 11.345;           ///< 99 % quantile of chi2 with three degrees of freedom
  std::uint32_t search_limit = 20000;  ///< nodes of the search tree; beyond, the best set found so far is returned
};

/// A set of hypotheses, by their index in the call.
struct ConsistentSet {
  std::uint64_t members = 0;    ///< bit i: hypothesis i is in it
  std::uint64_t witnesses = 0;  ///< a subset of the members no two of which share scans
  std::uint32_t member_count = 0;
  std::uint32_t witness_count = 0;  ///< independent pieces of evidence
  bool exact = true;                ///< false: the search limit was reached, there may be a larger one
};

/// e^T C^-1 e of a pose against the identity. Infinite where C is not positive definite.
double identity_chi2(const Pose2& pose, const Sym3& covariance);

/// chi2, three degrees of freedom, of one hypothesis against what the map says of the same two nodes.
double hypothesis_chi2(const RelativePose& measured, const RelativePose& in_map);

/// chi2, three degrees of freedom, of the loop Z1 (b1 -> b2) Z2^-1 (a2 -> a1), which is the identity where both
/// hypotheses hold; first order, the four taken as independent.
double pair_chi2(const RelativePose& z1, const RelativePose& b1_T_b2, const RelativePose& z2,
                 const RelativePose& a2_T_a1);

/// A graph over at most 64 vertices: bit j of row i says that i and j are linked.
struct LinkMatrix {
  std::uint64_t rows[kMaxHypotheses] = {};
};

/// The largest clique among `candidates` by branch and bound with a colouring bound (Tomita and Seki 2003); of several,
/// the one found first, trying small indices first. `limit` bounds the nodes of the search tree and is counted down; at
/// zero the largest so far is returned: never less than the greedy one, which is the first that the search finds.
/// O(limit * 64^2) word operations, no recursion.
std::uint64_t maximum_clique(const LinkMatrix& links, std::uint64_t candidates, std::uint32_t& limit);

/// Tests all pairs of hypotheses, then finds the set of mutually consistent ones with the most independent witnesses
/// and adds to it as many of the others as agree with all of it and one another. A pair that the map cannot compare is
/// inconsistent. Two hypotheses that link the same components with their ends exchanged are compared all the same.
class ConsistencySearch {
 public:
  /// Hypotheses and what the map refers to stay the caller's and as they are until the search is over. invalid_argument
  /// with more than kMaxHypotheses, without `relative` or with an option that is not positive; bad_data where a
  /// hypothesis is not finite or its covariance not positive definite.
  Status begin(Span<const LoopHypothesis> hypotheses, const MapQuery& map, const ConsistencyOptions& options);
  /// One pair, with at most 4 relative() calls, or one of the two searches for a clique. Returns whether there is more.
  bool step();
  /// The set, once step() has returned false.
  const ConsistentSet& result() const { return set_; }

 private:
  enum class Stage : std::uint8_t { pairs, witnesses, others, done };
  std::uint64_t all() const;
  void compare();

  Span<const LoopHypothesis> hypotheses_;
  MapQuery map_;
  ConsistencyOptions options_;
  LinkMatrix consistent_;
  LinkMatrix independent_;  ///< consistent, and no scans shared: a clique of it is a set of witnesses
  ConsistentSet set_;
  Stage stage_ = Stage::done;
  std::uint8_t first_ = 0;  ///< the pair that is next
  std::uint8_t second_ = 0;
};

/// ConsistencySearch in one go: the set, or the statuses of begin().
Result<ConsistentSet> find_consistent(Span<const LoopHypothesis> hypotheses, const MapQuery& map,
                                      const ConsistencyOptions& options);

}  // namespace mellin
