// Slam: scans in, the robot's pose and the building's map out. add() keeps the live map and never waits; work() does
// everything below it in bounded slices: rendering submaps, storing, recognising places, closing loops, optimising.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/config.hpp"
#include "mellin/port.h"

namespace mellin {

/// Since create(), over all sessions.
struct SlamStatistics {
  std::uint32_t submaps_due = 0;
  std::uint32_t submaps_delayed = 0;  ///< due while the one before was not finished: started later, with newer scans
  std::uint32_t submaps_lost = 0;     ///< not kept: no room in the collection, their scans were overwritten, or the
                                      ///< robot was lost again after a few scans
  std::uint64_t mapping_us = 0;       ///< in add(), by the port's clock
  std::uint64_t rendering_us = 0;
  std::uint32_t clock_back = 0;  ///< times that the port's clock ran back in add() or work(); no time is then counted
};

/// Where the robot is in the map of its component.
struct MapPose {
  bool linked = false;  ///< false: no submap yet since the session began or the robot was lost; the pose is in the
                        ///< session's frame
  SubmapId component = kNoSubmap;
  Pose2 map_T_base;  ///< jumps when a loop closes
};

/// Told when a submap has been frozen: the numbers and poses of the scans in it. Corrections of the map move a submap
/// as a whole, so a scan's final pose is its submap's pose times this.
struct SubmapObserver {
  void* context = nullptr;
  void (*frozen)(void* context, SubmapId id, std::uint32_t first_scan, Span<const Pose2> submap_T_scan) = nullptr;
};

class Slam {
 public:
  struct Memory {
    Span<Slam> self;
    ParticleMapper::Memory mapper;
    SubmapBuilder::Memory builder;
    SubmapStore::Memory store;
    SpectralScreening::Memory screening;
    SpectralRegistration::Memory registration;
    MapCollection::Memory collection;
  };
  /// Requires a resolved configuration.
  template <class A>
  static constexpr Memory carve(A& arena, const Config& config);

  /// Builds the system in `memory` (aligned to kArenaAlignment, required_bytes(config) long; it stays the caller's, and
  /// the system lives as long). `fast` may hold what required_memory(config).fast says, and memory the rest. What the
  /// port's flash holds is restored before this returns; a blank flash is formatted. A first session begins.
  /// Statuses: ok; invalid_config (the log says which field; also digests that are not held, and
  /// no flash to read them from); invalid_argument where memory is not aligned;
  /// insufficient_memory (the log says how many bytes lack); full where the flash holds submaps of max_sessions
  /// sessions already; version_mismatch, bad_data, device_error of the store: the flash is left as it was.
  static Result<Slam*> create(const Config& given, Span<std::byte> memory, const mellin_port& port,
                              Span<std::byte> fast = {});

  Slam() = default;
  Slam(const Slam&) = delete;
  Slam& operator=(const Slam&) = delete;

  /// Takes the next scan. bad_data: the scan is not what the configuration says, or its odometry is not finite; it is
  /// ignored and counted, see MapperStatistics. A stamp that jumps or stands still is counted only: scans count in the
  /// order in which they come. Cost bounded by the configuration; does no background work. A robot that finds itself
  /// lost (ScanUse::lost) goes on in the same session, in a component of the map of its own, until a place that is
  /// recognised links it.
  Result<ScanOutcome> add(const Scan& scan);

  /// Does up to `budget` slices of background work, at least one where there is any. Returns whether there is more.
  bool work(std::uint32_t budget = 1);

  /// Before a shutdown or a new session: the scans that no submap holds yet become one, and poses and edges go to the
  /// store. The work itself is done by work(), until it returns false. Statuses: ok.
  Status begin_flush();

  /// A new mapping session (the robot was carried, or restarted): the live map starts empty, with the robot at the
  /// given pose of a frame of its own. Flush first. invalid_argument: a pose that is not finite, or beyond
  /// ParticleMapper::kReach_m. busy: work is pending. full: no room for another session.
  Status new_session(const Pose2& session_T_base = {});

  /// The live pose: smooth, in the session's frame.
  Pose2 pose() const { return mapper_.pose(); }
  /// Covariance of pose() against the live map, in the robot's own frame.
  Sym3 covariance() const { return mapper_.covariance(); }
  /// Puts the robot at a pose of its choice, as a new session does. Statuses of new_session().
  Status set_pose(const Pose2& session_T_base) { return new_session(session_T_base); }
  /// The pose in the map.
  MapPose map_pose() const;

  /// The live map round the robot, in the session's frame.
  const CountingGrid& live_map() const { return mapper_.live_map(); }
  const LocalMapper& mapper() const { return mapper_; }
  const MapCollection& collection() const { return collection_; }
  SubmapStore& store() { return store_; }
  const SubmapStore& store() const { return store_; }
  const Config& config() const { return config_; }
  const ArenaUse& arena_use() const { return use_; }
  const SlamStatistics& statistics() const { return statistics_; }

  void observe_pairs(const PairObserver& observer) { collection_.observe(observer); }
  void observe_submaps(const SubmapObserver& observer) { observer_ = observer; }

 private:
  enum class Flush : std::uint8_t { none, submap, records };

  Status init(const Config& config, const Memory& memory, const mellin_port& port);
  Status open_store();
  SessionId new_session_id();
  void freeze_if_due(bool due);
  void forget_what_cannot_be_frozen();
  void render_slice();
  void hand_over();
  bool pending() const;
  void count_since(std::uint64_t before_us, std::uint64_t& spent_us);
  std::uint64_t now_us() const { return clock_.now_us != nullptr ? clock_.now_us(clock_.context) : 0; }

  Config config_;
  mellin_clock clock_ = {};
  mellin_entropy entropy_ = {};
  Log log_;
  ArenaUse use_;
  ParticleMapper mapper_;
  SubmapBuilder builder_;
  SubmapStore store_;
  SpectralScreening screening_;
  SpectralRegistration registration_;
  MapCollection collection_;
  SubmapObserver observer_;
  SlamStatistics statistics_;
  SlotHandle slot_;        ///< of the submap being rendered or waiting for the collection
  bool rendered_ = false;  ///< slot_ is complete
  Flush flush_ = Flush::none;
};

template <class A>
constexpr Slam::Memory Slam::carve(A& arena, const Config& config) {
  Memory m;
  m.self = arena.template take<Slam>(1, Part::slam);
  m.mapper = ParticleMapper::carve(arena, config.mapper);
  m.builder = SubmapBuilder::carve(arena, config.submaps);
  m.store = SubmapStore::carve(arena, store_config(config));
  // A new submap is screened, then registered, then the graph is optimised: they take turns in one workspace.
  const auto screen = [&](auto& kept, auto& work) { return SpectralScreening::carve(kept, work, config.screening); };
  const auto match = [&](auto& kept, auto& work) {
    return SpectralRegistration::carve(kept, work, config.registration);
  };
  const auto collect = [&](auto& kept, auto& work) { return MapCollection::carve(kept, work, config.collection); };
  const Workspace workspace =
      arena.take_workspace(larger(measured_work(screen), larger(measured_work(match), measured_work(collect))));
  A for_screening = arena.over(workspace);
  m.screening = screen(arena, for_screening);
  A for_registration = arena.over(workspace);
  m.registration = match(arena, for_registration);
  A for_collection = arena.over(workspace);
  m.collection = collect(arena, for_collection);
  return m;
}

/// What a configuration needs, by part and by region.
constexpr ArenaUse required_memory(const Config& config) {
  MeasureArena arena;
  (void)Slam::carve(arena, resolved(config));
  return arena.use();
}

/// Bytes that create() needs, exactly.
constexpr std::size_t required_bytes(const Config& config) { return required_memory(config).total(); }

}  // namespace mellin
