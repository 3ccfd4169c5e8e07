// The map collection (paper, Section III): all submaps of all sessions as nodes of one graph. A new submap is described
// by its digest, stored, linked to its predecessor by odometry, screened against every submap that shares no scans with
// it, registered against the few that look alike, and linked where the evidence suffices; then the graph is optimised.
// All of it happens in step(), slice by slice, whenever the caller has time.
#pragma once

#include <cstdint>

#include "mellin/collection/linker.hpp"
#include "mellin/collection/place_matcher.hpp"
#include "mellin/core/arena.hpp"
#include "mellin/core/log.hpp"
#include "mellin/graph/optimiser.hpp"
#include "mellin/graph/pose_graph.hpp"
#include "mellin/grid/submap.hpp"
#include "mellin/port.h"
#include "mellin/store/submap_store.hpp"

namespace mellin {

/// Deviations of an odometry edge between consecutive submaps, beside the drift that the local mapper knows of.
struct OdometryEdgeNoise {
  float base_m = 0.02F;
  float per_m = 0.005F;  ///< times the distance of the centres
  float base_rad = 0.005F;
  float per_m_rad = 0.0F;  ///< times the distance of the centres
};

struct CollectionConfig {
  std::uint32_t max_submaps = 512;
  std::uint16_t max_sessions = 16;
  std::uint8_t candidates = 4;  ///< of a new submap that are registered, best first, one a place
  /// Of those, so many are taken for where the graph has them, nearest first, and not for their digests: along a
  /// corridor all digests are alike.
  std::uint8_t nearby_candidates = 1;
  /// Between the centres of submaps that the graph may have in one place. No early stage of screening drops such a
  /// pair.
  float nearby_m = 10.0F;
  float candidate_agreement = 0.25F;  ///< digests must agree so well for a pair to be registered
  std::uint32_t digest_bytes = 0;     ///< of one digest, for the store
  bool close_loops = true;            ///< off: submaps are stored and linked by odometry only
  OdometryEdgeNoise odometry;
  LinkerConfig linker;
  PoseGraphConfig graph;
};

/// What became of a pair of submaps, for whoever wants to know why.
struct PairEvent {
  enum class Stage : std::uint8_t { screened, registered, decided };
  Stage stage = Stage::screened;
  SubmapId a = kNoSubmap;
  SubmapId b = kNoSubmap;
  bool between_sessions = false;
  bool nearby = false;  ///< screened: the graph has them within nearby_m of each other
  float score = 0.0F;   ///< peak of the matched filter
  float agreement = 0.0F;
  Pose2 a_T_b;
  bool accepted = false;  ///< screened: becomes a candidate; registered: becomes a hypothesis; decided: becomes an edge
  LinkReason reason = LinkReason::none;
};
struct PairObserver {
  void* context = nullptr;
  void (*seen)(void* context, const PairEvent& event) = nullptr;
};

struct CollectionStatistics {
  std::uint64_t pairs_possible = 0;  ///< pairs of submaps that share no scans
  std::uint64_t pairs_screened = 0;
  std::uint64_t pairs_dropped_coarse = 0;    ///< of the screened ones: coarser digests do not match
  std::uint64_t pairs_dropped_rotation = 0;  ///< likewise: no rotation stands out
  std::uint64_t pairs_cut_short = 0;         ///< likewise: the first rotation peaks left no hope for the others
  std::uint64_t pairs_registered = 0;
  std::uint64_t pairs_accepted = 0;  ///< became edges
  std::uint32_t edges_rejected = 0;  ///< were edges, and then outliers
  std::uint32_t fetches_failed = 0;
  std::uint32_t digests_missed = 0;  ///< could not be read back when they were to be compared
  std::uint32_t stored = 0;          ///< submaps that are safe in the store
  std::uint32_t not_stored = 0;      ///< submaps that the store refused: they stay in the map until the next start
  std::uint32_t flushes_failed = 0;  ///< poses and edges not stored: the next flush does it all again
  Status last_store_failure = Status::ok;  ///< why, of the last submap or flush that was not stored
  std::uint32_t submaps_missing = 0;       ///< ids without a submap, found when the store was restored
  std::uint32_t records_damaged = 0;       ///< digests, poses and edges left out when the store was restored
  std::uint32_t optimisations = 0;
  std::uint64_t screening_us = 0;  ///< by the port's clock
  std::uint64_t registration_us = 0;
  std::uint64_t optimisation_us = 0;
  std::uint64_t store_us = 0;
};

class MapCollection {
 public:
  struct Candidate {
    SubmapId id = kNoSubmap;
    float score = 0.0F;
  };
  struct Memory {
    Span<SubmapHeader> headers;
    Span<NodeScans> scans;
    Span<SessionId> sessions;
    Span<Candidate> candidates;
    Linker::Memory linker;
    PoseGraph::Memory graph;
    Optimiser::Memory optimiser;
    Span<std::uint8_t> record;
  };
  static constexpr PoseGraphConfig graph_config(const CollectionConfig& config) {
    PoseGraphConfig graph = config.graph;
    graph.max_nodes = config.max_submaps;
    return graph;
  }
  template <class A>
  static constexpr Memory carve(A& arena, const CollectionConfig& config) {
    return carve(arena, arena, config);
  }
  /// The optimiser's memory comes from `work`. The collection uses it from the last registration of a submap to the end
  /// of that submap's work; the matchers may use it at all other times.
  template <class A, class W>
  static constexpr Memory carve(A& arena, W& work, const CollectionConfig& config) {
    Memory m;
    m.headers = arena.template take<SubmapHeader>(config.max_submaps, Part::collection);
    m.scans = arena.template take<NodeScans>(config.max_submaps, Part::collection);
    m.sessions = arena.template take<SessionId>(config.max_sessions, Part::collection);
    m.candidates = arena.template take<Candidate>(config.max_submaps, Part::collection);
    m.linker = Linker::carve(arena, config.linker);
    m.graph = PoseGraph::carve(arena, graph_config(config));
    m.optimiser = Optimiser::carve(work, graph_config(config));
    m.record = arena.template take<std::uint8_t>(
        config.digest_bytes > kRecordBytes ? config.digest_bytes : kRecordBytes, Part::collection);
    return m;
  }

  MapCollection() = default;
  MapCollection(const MapCollection&) = delete;
  MapCollection& operator=(const MapCollection&) = delete;

  /// All that is passed stays the caller's and outlives the collection. The store is mounted or formatted by then; what
  /// it holds is restored in the first steps. Statuses: ok; those of the graph.
  Status init(const CollectionConfig& config, const Memory& memory, DigestMatcher& digests, GridMatcher& grids,
              SubmapStore& store, const mellin_clock& clock, Log log);
  void observe(const PairObserver& observer) { observer_ = observer; }

  /// Submaps that come from now on belong to this session. full: max_sessions.
  Status begin_session(const SessionId& id);

  /// Takes a submap that was rendered into the slot (header without id and session) and starts to work on it; the
  /// handle is taken over. An odometry edge joins it to the session's submap before: as `from_before` measured it, or,
  /// where that is about another submap or no measurement, as their poses in the session have it. Submaps of different
  /// stretches of a session get none: the robot was lost meanwhile. Returns its id. busy: step() has not finished with
  /// the one before. full: max_submaps.
  Result<SubmapId> insert(SubmapHeader header, SlotHandle& slot, const SubmapStep& from_before,
                          std::uint16_t stretch = 0);

  /// Whether step() has nothing to do.
  bool idle() const { return stage_ == Stage::idle; }
  /// Whether the store could be read while it was restored: ok; device_error: the rest is missing from the map, and
  /// nothing must be stored on top of it.
  Status restored() const { return restored_; }
  /// Whether insert() can be called.
  bool ready() const { return stage_ == Stage::idle; }
  /// One slice of work; see the parts for their bounds.
  void step();
  /// Starts to write all poses and edges that the store does not have as they are now; step() until idle().
  void begin_flush();

  // Access.
  std::uint32_t size() const { return count_; }
  /// The following require id < size().
  const SubmapHeader& header(SubmapId id) const { return memory_.headers[id]; }
  std::uint16_t session_of(SubmapId id) const { return memory_.scans[id].session; }
  /// Which of the session's stretches it is of.
  std::uint16_t stretch_of(SubmapId id) const { return memory_.scans[id].stretch; }
  /// Pose in the frame of its component.
  const Pose2& map_T_submap(SubmapId id) const { return graph_.pose(id); }
  /// Components are named by their smallest submap.
  SubmapId component(SubmapId id) const { return graph_.component(id); }
  std::uint16_t session_count() const { return session_count_; }
  const SessionId& session(std::uint16_t index) const { return memory_.sessions[index]; }
  const PoseGraph& graph() const { return graph_; }
  const CollectionStatistics& statistics() const { return statistics_; }
  /// The newest submap of the present session, or kNoSubmap.
  SubmapId newest_of_session() const { return newest_; }

  static constexpr std::uint32_t kRecordBytes = 96;

 private:
  enum class Stage : std::uint8_t {
    idle,
    restore_submaps,
    restore_digest,
    restore_edges,
    restore_poses,
    describe,
    store_submap,
    store_digest,
    store_node,
    store_edge,
    commit,
    screen,
    recalling,
    screening,
    choose,
    fetching,
    registering,
    marginals,
    judge,
    optimise,
    flush,
  };

  void run_slice();
  bool same_stretch(SubmapId a, SubmapId b) const;
  void link_odometry(SubmapId id, const SubmapStep& from_before);
  /// How b lies to a by their poses in their session.
  Pose2 session_step(SubmapId a, SubmapId b) const {
    return between(memory_.headers[a].session_T_submap, memory_.headers[b].session_T_submap);
  }
  Result<EdgeId> add_odometry_edge(SubmapId a, SubmapId b, const Pose2& step, const Sym3& drift);
  void begin_screening();
  void screen_next();
  void recall_digest();
  void begin_comparison();
  void finish_screening();
  LinkReason screening_verdict();
  double distance_in_graph(SubmapId other) const;
  std::size_t best_by_digest() const;
  std::size_t nearest_in_graph() const;
  void choose_candidate();
  void step_fetch();
  void begin_registration();
  void finish_registration();
  void begin_marginals();
  void judge();
  void finish_optimisation();
  void finish_submap();

  void begin_storing();
  void step_store();
  void store_failed(Status status);
  Span<const std::uint8_t> node_record(SubmapId id);
  Span<const std::uint8_t> edge_record(EdgeId id);
  void flush_next();
  void step_flush();
  std::uint16_t session_index(const SessionId& id);
  void flush_failed(Status status);
  bool keeps(const Edge& edge) const;
  void restore_failed(Status status);
  void restore_submap();
  void restore_gap();
  void bridge_gaps();
  bool has_odometry_edge(SubmapId newer) const;
  void restore_edge();
  void restore_pose();

  std::uint64_t* stage_clock();
  void report(PairEvent event) const;

  CollectionConfig config_;
  Memory memory_;
  DigestMatcher* digests_ = nullptr;
  GridMatcher* grids_ = nullptr;
  SubmapStore* store_ = nullptr;
  mellin_clock clock_ = {};
  Log log_;
  PairObserver observer_;
  Linker linker_;
  PoseGraph graph_;
  Optimiser optimiser_;
  CollectionStatistics statistics_;

  Stage stage_ = Stage::idle;
  std::uint32_t count_ = 0;
  std::uint16_t session_count_ = 0;
  std::uint16_t session_ = 0;    ///< of the submaps that come
  SubmapId newest_ = kNoSubmap;  ///< of the present session
  SlotHandle slot_;              ///< of the submap under way
  SlotHandle other_slot_;        ///< of the candidate under way
  SubmapId other_ = 0;           ///< next to be screened, or being registered
  List<Candidate> candidates_;
  std::uint8_t registered_ = 0;
  bool nearby_ = false;              ///< other_ lies so by the graph, while it is screened
  bool evidence_ = false;            ///< a hypothesis came in since the last judgement
  std::uint32_t record_ = 0;         ///< next to be flushed or restored
  std::uint32_t loops_flushed_ = 0;  ///< loop and merge edges among those that this flush has put
  EdgeId odometry_edge_ = kNoId;     ///< of the submap under way
  Status restored_ = Status::ok;
};

}  // namespace mellin
