// From hypotheses to edges (paper, Sections IV-B3 and V-C): a place that was recognised becomes an edge of the graph
// only when the graph, or enough independent hypotheses, agree with it. Until then it waits.
//
// The law. Within one component a hypothesis must agree with what the graph says of the two submaps (chi-squared gate
// on the graph's covariance). It is then accepted when
//   - the graph already knows the place well (its deviation is below single_sigma_*) and the submaps agree well, or
//   - together with others it forms a mutually consistent set with at least loop_witnesses independent witnesses.
// Between components the graph knows nothing: only a consistent set with merge_witnesses counts. Witnesses are
// independent when neither their older nor their newer submaps share scans.
#pragma once

#include <cstdint>

#include "mellin/collection/place_matcher.hpp"
#include "mellin/core/arena.hpp"
#include "mellin/core/containers.hpp"
#include "mellin/graph/consistency.hpp"
#include "mellin/graph/optimiser.hpp"
#include "mellin/graph/pose_graph.hpp"

namespace mellin {

struct LinkerConfig {
  std::uint16_t pending = 48;      ///< hypotheses that wait for more evidence; at most kMaxHypotheses
  double graph_gate_chi2 = 16.27;  ///< 99.9 % quantile with three degrees of freedom
  double pair_gate_chi2 = 11.34;   ///< 99 %
  std::uint8_t loop_witnesses = 2;
  std::uint8_t merge_witnesses = 3;
  float single_sigma_m = 0.6F;  ///< deviation of the graph's own estimate below which one hypothesis suffices …
  float single_sigma_rad = 0.06F;
  float single_agreement = 0.5F;  ///< … if the submaps agree at least so well
  float min_agreement = 0.4F;     ///< below, a hypothesis is not evidence at all
  float min_overlap = 0.1F;
  /// A match that leaves the pose less determined than this along any direction is none: in a plain corridor or bend
  /// two submaps fit at any offset, and the one that was found says nothing.
  float max_sigma_m = 0.15F;
  float max_sigma_rad = 0.05F;
  /// What registration does not know of: submaps are not quite rigid. Added to its covariance.
  float warp_sigma_m = 0.04F;
  float warp_sigma_rad = 0.008F;
  /// Neighbouring submaps share most of their scans, so their edges repeat one another: each carries this share of its
  /// information.
  float information_share = 0.25F;
  /// An edge is added only where it tells the graph at least so much, in bits: one half log2 of how much smaller it
  /// makes the covariance (Ila, Porta, Andrade-Cetto 2010). Several times as much as the room for edges and for the
  /// factor's fill runs out. Over 0, passing the same places again and again does not use up the graph, and there
  /// is room left for the loop that closes late.
  float min_gain_bits = 0.0F;
};

/// Why a hypothesis became an edge, or did not.
enum class LinkReason : std::uint8_t {
  none,
  weak,              ///< too little agreement or overlap, or the match does not determine the pose
  waiting,           ///< agrees with the graph, waits for a second witness
  contradicts_map,   ///< outside what the graph allows
  confirmed_by_map,  ///< accepted: the graph knows the place and agrees
  confirmed_by_set,  ///< accepted: enough independent witnesses agree
  outlier,           ///< was accepted, and later rejected by the robust optimisation
  forgotten,         ///< dropped while waiting, for lack of room
  redundant,         ///< the graph knows as much without it
  coarse_mismatch,   ///< dropped by screening: already coarser digests do not match
  no_rotation,       ///< dropped by screening: no rotation stands out
};
const char* to_string(LinkReason reason);

/// Which scans a node rests on, so that shared ones are counted once.
struct NodeScans {
  std::uint16_t session = 0;
  std::uint16_t stretch = 0;  ///< of the session: only within one are poses held together by odometry
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};
bool share_scans(const NodeScans& a, const NodeScans& b);

struct PendingLink {
  LoopHypothesis hypothesis;
  float agreement = 0.0F;
  float overlap = 0.0F;
  float peak = 0.0F;
  double graph_chi2 = 0.0;
  LinkReason reason = LinkReason::none;
};

class Linker {
 public:
  struct Memory {
    Span<PendingLink> pending;
    Span<LoopHypothesis> group;  ///< those of them that are compared
  };
  template <class A>
  static constexpr Memory carve(A& arena, const LinkerConfig& config) {
    return {arena.template take<PendingLink>(config.pending, Part::collection),
            arena.template take<LoopHypothesis>(config.pending, Part::collection)};
  }
  Linker() = default;
  Linker(const LinkerConfig& config, const Memory& memory)
      : config_(config), pending_(memory.pending), candidates_(memory.group) {}

  /// Whether a registered hypothesis is evidence at all.
  bool worth_keeping(const PlaceHypothesis& place) const;
  /// Keeps a hypothesis; where there is no room, the one that agrees least is dropped.
  void add(NodeId a, NodeId b, const PlaceHypothesis& place);

  /// Starts to judge all that waits against the graph, whose marginals must be factorised and which must stay as it is
  /// until step() returns false. `scans` has an element a node. Calls decided(context, link, edge) for each verdict
  /// that changed (edge kNoId where it is not accepted).
  using Decided = void (*)(void* context, const PendingLink& link, EdgeId edge);
  void begin(PoseGraph& graph, Optimiser& optimiser, Span<const NodeScans> scans, void* context, Decided decided);
  /// One hypothesis against the graph, one pair of them against each other, or one search for a consistent set; in the
  /// end adds edges for what is accepted. Returns whether there is more. At most 2 pending^2 + pending + 3 steps; at
  /// most 4 queries of the graph a step.
  bool step();
  bool deciding() const { return stage_ != Stage::idle; }
  /// Edges that were added, once step() has returned false.
  std::size_t added() const { return added_; }

  std::size_t pending() const { return pending_.size(); }
  void clear() {
    pending_.clear();
    stage_ = Stage::idle;
  }

 private:
  enum class Stage : std::uint8_t { idle, weigh, search };
  /// What the hypotheses are judged by.
  struct Case {
    PoseGraph* graph = nullptr;
    Optimiser* optimiser = nullptr;
    Span<const NodeScans> scans;
    void* context = nullptr;
    Decided decided = nullptr;
    double min_gain_bits = 0.0;
  };
  /// Waiting hypotheses, a bit each, that link the same two components, or lie in the same one.
  struct Group {
    std::uint64_t members = 0;
    bool merges = false;
  };
  static Status relative(void* context, NodeId from, NodeId to, RelativePose& out);
  static bool shared(void* context, const LoopHypothesis& first, const LoopHypothesis& second);
  bool known_well(const Sym3& covariance) const;
  void weigh_next();
  void next_group();
  void finish_group();
  Group same_components(std::size_t index) const;
  void accept(std::uint64_t members, LinkReason reason);

  LinkerConfig config_;
  List<PendingLink> pending_;
  Span<LoopHypothesis> candidates_;  ///< the group's, in the order of `pending_`
  Case case_;
  Stage stage_ = Stage::idle;
  std::size_t next_ = 0;        ///< of the pending ones
  std::uint64_t alone_ = 0;     ///< suffice alone
  std::uint64_t eligible_ = 0;  ///< may be in a set
  Group group_;
  ConsistencySearch search_;
  std::size_t added_ = 0;
};

}  // namespace mellin
