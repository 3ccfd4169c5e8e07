// Runs logs through the library, one mapping session each, in memory given once, and keeps what `mellin map` writes:
// the pose of every scan, live and final, and what became of each pair of submaps.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/summary.hpp"
#include "host/tum.hpp"
#include "mellin/slam.hpp"

namespace mellin::host {

/// One session as it was mapped.
struct MappedSession {
  std::string log;
  std::uint16_t session = 0;  ///< index in the map collection
  std::vector<SubmapId> submaps;
  struct MappedScan {
    std::string stamp;
    double seconds = 0.0;
    Pose2 session_T_base;  ///< live
    std::uint32_t anchor_scan = 0;
    Pose2 anchor_T_base;
    ScanUse use = ScanUse::odometry;
  };
  std::vector<MappedScan> scans;
  std::uint32_t lost = 0;  ///< times that the robot did not know where it was
  /// For each taken scan, the submaps that hold it and how central it is in each.
  struct Placement {
    SubmapId submap = kNoSubmap;
    Pose2 submap_T_scan;
    double weight = 0.0;
  };
  std::vector<std::vector<Placement>> placements;
};

/// Adds the lasers of a log to a configuration; returns the index in Config::lasers of each. Throws where there are
/// more than the library takes.
std::vector<std::uint8_t> add_lasers(Config& config, const Log& log);

class MappingRun {
 public:
  /// `config` has all lasers of all logs. Throws std::runtime_error with the library's own words where it refuses.
  MappingRun(const Config& config, const mellin_flash& flash, std::function<void(const std::string&)> log_sink);
  MappingRun(const MappingRun&) = delete;
  MappingRun& operator=(const MappingRun&) = delete;

  /// Maps a log as the next session and flushes. `lasers` says which laser of the configuration each of the log's is.
  /// Calls progress(scans done) now and then.
  void map(const Log& log, const std::vector<std::uint8_t>& lasers, const std::function<void(std::size_t)>& progress);

  /// Called when submaps have become safe in the store, with their number.
  std::function<void(SubmapId)> on_stored;

  const Slam& slam() const { return *slam_; }
  Slam& slam() { return *slam_; }
  const std::vector<MappedSession>& sessions() const { return sessions_; }
  const std::vector<MatchRow>& matches() const { return matches_; }

  /// The live pose of each scan of a session, in the session's frame.
  std::vector<StampedPose> live_trajectory(const MappedSession& session) const;
  /// The final pose of each scan, in the frame of the session's component: that of the scan it hangs on, which is the
  /// average over the submaps that hold it, the more central the more weight, so that no seam shows between submaps.
  std::vector<StampedPose> final_trajectory(const MappedSession& session) const;

  /// The grid of a submap, fetched from the store where it is not in RAM; calls use(grid). Returns whether it was
  /// there.
  bool with_grid(SubmapId id, const std::function<void(const GridView&)>& use);

 private:
  // The library calls these; what they keep goes into room reserved before, so that nothing they do counts as the
  // library's use of the heap.
  static void log_line(void* context, mellin_log_level level, const char* line);
  static void frozen(void* context, SubmapId id, std::uint32_t first_scan, Span<const Pose2> submap_T_scan);
  static void pair_seen(void* context, const PairEvent& event);
  void reserve_room();
  void take_events();
  void drain();
  static void rehang_doubted(MappedSession& session);
  Pose2 scan_pose(const MappedSession& session, std::uint32_t scan) const;

  struct FrozenSubmap {
    SubmapId id = kNoSubmap;
    std::uint32_t first_scan = 0;
    std::size_t first_pose = 0;
    std::size_t count = 0;
  };
  std::vector<std::uint64_t> memory_;
  std::function<void(const std::string&)> log_sink_;
  std::vector<std::array<char, 160>> lines_;
  std::vector<PairEvent> pairs_;
  std::vector<FrozenSubmap> frozen_;
  std::vector<Pose2> frozen_poses_;
  Slam* slam_ = nullptr;
  std::vector<MappedSession> sessions_;
  std::vector<MatchRow> matches_;
  std::uint32_t reported_stored_ = 0;
  SubmapId next_stored_ = 0;
};

}  // namespace mellin::host
