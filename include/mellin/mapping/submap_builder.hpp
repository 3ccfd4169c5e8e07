// Submaps (paper, Section III-B): the remembered scans, rendered afresh into an occupancy grid that is centred where
// they lie. Cutting them out of the live window would lose what the robot saw before it moved on.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/counting_grid.hpp"
#include "mellin/grid/submap.hpp"
#include "mellin/mapping/local_mapper.hpp"
#include "mellin/mapping/scan_smoother.hpp"

namespace mellin {

struct SubmapBuilderConfig {
  std::uint16_t max_scans = 40;  ///< K: rendered into one submap at most, the newest ones …
  float max_path_m = 20.0F;      ///< … that lie within so much driven path: what is longer warps, and leaves the grid
  std::uint16_t every_scans = 10;  ///< a submap is due after so many new scans (the paper's K/4) …
  float every_path_m = 10.0F;      ///< … or so much path: half of max_path_m keeps neighbours overlapping
  /// Nor may a submap hold more scans than the local mapper is sure of: those along a featureless stretch are placed by
  /// odometry, and a rigid grid that spans it would hold its error for good. Deviations from the newest scan to the
  /// oldest.
  float max_drift_m = 0.3F;
  float max_drift_rad = 0.04F;
  std::uint16_t min_scans = 6;  ///< rendered all the same, however uncertain
  /// Share of a scan's deviation that points the same way scan after scan, since it comes from the odometry's bias.
  float drift_share = 1.0F;
  std::uint16_t side = 768;  ///< cells of the grid; even
  float cell_m = 0.05F;
  std::uint16_t band_rows = 32;  ///< rows rendered in one slice; memory in proportion
  ScanSmootherConfig smoother;
};

/// Renders one submap at a time, band by band. The scans it renders must stay in the scan memory until it is done.
class SubmapBuilder {
 public:
  struct Memory {
    Span<CellCount> band;
    Span<Pose2> poses;
    Span<Pose2> poses_before;  ///< of the submap before
    ScanSmoother::Memory smoother;
  };
  template <class A>
  static constexpr Memory carve(A& arena, const SubmapBuilderConfig& config) {
    return {arena.template take<CellCount>(std::size_t{config.band_rows} * config.side, Part::submaps),
            arena.template take<Pose2>(config.max_scans, Part::submaps),
            arena.template take<Pose2>(config.max_scans, Part::submaps), ScanSmoother::carve(arena, config.smoother)};
  }

  SubmapBuilder() = default;
  SubmapBuilder(const SubmapBuilderConfig& config, const Memory& memory)
      : config_(config), memory_(memory), smoother_(config.smoother, memory.smoother) {}

  /// A new session: counts path and scans from here.
  void reset();
  /// To be told of each taken scan, the mapper's newest. Returns whether a submap is due: the memory has been filled
  /// once (with scans, path or drift), and since the last submap enough is new.
  bool scan_taken(const LocalMapper& mapper);
  /// Whether scans were taken that no submap holds yet.
  bool has_unfrozen() const { return new_scans_ > 0; }

  /// To be told when the mapper has begun another stretch, before its first scan: path and scans count from here. What
  /// the old one has not frozen becomes its last submap by the next begin(). Returns whether nothing is lost by it:
  /// false where the last submap of the stretch before was still waiting, and where a stretch without any submap has
  /// fewer than min_scans scans, which would be found again nowhere.
  bool stretch_ended(const LocalMapper& mapper);
  /// Whether the last submap of an ended stretch waits for begin().
  bool has_ended_stretch() const { return ended_.waits; }
  void forget_ended_stretch() { ended_.waits = false; }
  /// The stretch of the scans that are rendered.
  std::uint16_t stretch() const { return rendered_stretch_; }

  /// Freezes the newest scans, or the last ones of an ended stretch: takes over their poses. Smoothing them and
  /// rendering into `cells` (side * side) follow in steps. busy: a submap is being made. degenerate: no scan was taken.
  /// not_found: those of the ended stretch have left the memory; it waits no longer.
  Status begin(const LocalMapper& mapper, Span<std::uint8_t> cells);
  /// The next slice of smoothing, or the next band. Returns true when the grid is complete. not_found: a scan has left
  /// the memory meanwhile; the submap is lost. Cost: that of ScanSmoother::step(), or band_rows x side cells and the
  /// beams of max_scans scans clipped to them.
  Result<bool> step(const ScanMemory& scans);
  /// Of the submap that step() completed (all but id and session).
  const SubmapHeader& header() const { return header_; }
  /// From the submap before to this one, as the scans that both hold have it, and what the local mapper may have
  /// drifted: the scans from the middle of the one to the middle of the other, with errors that all point the same way,
  /// since what a scan does not determine is wrong by the odometry's bias again and again.
  const SubmapStep& from_before() const { return from_before_; }
  bool active() const { return stage_ != Stage::idle; }
  void abort() { stage_ = Stage::idle; }

  /// The frozen scans: numbers from first_scan(), and their poses in the submap's frame. Valid from when step() has
  /// completed the submap until the next begin().
  std::uint32_t first_scan() const { return first_scan_; }
  Span<const Pose2> submap_T_scan() const { return memory_.poses.first(scan_count_); }

 private:
  enum class Stage : std::uint8_t { idle, smooth, render };
  /// Scans that one submap may hold, [first, end), and what goes before them.
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t end = 0;
    std::uint32_t middle = 0;  ///< number of the scan in the middle of the stretch's last submap …
    bool any_frozen = false;   ///< … if there is one
    std::uint16_t stretch = 0;
  };
  struct EndedStretch {
    bool waits = false;
    Range range;
  };

  void swap_poses();
  void place();
  static Pose2 measured_step(Span<const Pose2> before, Span<const Pose2> here);
  void render_band(const ScanMemory& scans);
  Range open_range(const LocalMapper& mapper) const;
  Range ended_range(const LocalMapper& mapper) const;
  void count_from_here();
  std::uint32_t scans_in_reach(const LocalMapper& mapper, const Range& range) const;
  bool too_uncertain(const Sym3& drift) const;
  Sym3 drift_since(const LocalMapper& mapper, const Pose2& session_T_submap, std::uint32_t from,
                   std::uint32_t to) const;

  SubmapBuilderConfig config_;
  Memory memory_;
  ScanSmoother smoother_;
  Span<std::uint8_t> cells_;
  Stage stage_ = Stage::idle;
  std::uint16_t next_row_ = 0;
  std::uint32_t first_scan_ = 0;
  std::uint32_t scan_count_ = 0;
  std::uint32_t first_before_ = 0;  ///< of the submap before
  std::uint32_t count_before_ = 0;
  Pose2 session_T_newest_;  ///< the newest frozen scan, as the local mapper has it
  SubmapHeader header_;
  SubmapStep from_before_;
  std::uint32_t taken_ = 0;      ///< scans of the stretch
  std::uint32_t new_scans_ = 0;  ///< since the last submap
  double path_m_ = 0.0;          ///< of the stretch
  Sym3 new_drift_;               ///< since the last submap
  double new_path_m_ = 0.0;      ///< since the last submap
  Pose2 last_pose_;
  bool any_frozen_ = false;
  std::uint32_t middle_ = 0;  ///< number of the scan in the middle of the last submap
  EndedStretch ended_;
  std::uint16_t rendered_stretch_ = 0;
};

}  // namespace mellin
