// Submaps for the evaluation (paper, Section V-A): from a separate mapping run with few particles and no loops, so that
// they carry the drift of a live map, each with its true pose and the area that its scans truly observed.
//
// One scan is taken per 0.5 m or 30 degrees; K of them make a submap, and one begins every K/4 scans, so that
// neighbours share three quarters of their data. The true pose of a scan is its live pose put right by the ground truth
// before and after it. The true pose of a submap is the rigid motion that lays its live scan poses best on their true
// ones: what is left is the submap's own deformation. Two submaps overlap by the observed area that they share, over
// the smaller of the two, cut to what lies in their grids.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/cell_counts.hpp"
#include "host/submap_rendering.hpp"
#include "host/tum.hpp"
#include "mellin/core/se2.hpp"

namespace mellin::host {

/// A scan that local mapping took, where the live map has it and where it truly was.
struct LiveScan {
  double seconds = 0.0;
  Pose2 session_T_base;  ///< live: it drifts
  Pose2 truth_T_base;
  Pose2 base_T_laser;
  PosedScan scan;  ///< its pose is left open
  /// Scans of different stretches (the robot was lost in between, or the truth has a gap) are never in one submap.
  std::size_t stretch = 0;
};

/// What local mapping made of one log.
struct LiveDrive {
  std::string log;
  std::vector<LiveScan> scans;
};

struct LiveOptions {
  std::uint16_t particles = 1;
  std::uint64_t seed = 1;
  double max_range_m = 40.0;  ///< farther end points are left out of submaps: they are mostly glass and glitches
};

/// Runs the library's local mapping over a log, loops off. Scans farther than kTruthReach_m from any that the truth has
/// a pose for are left out. Throws std::runtime_error where none is left.
LiveDrive drive_live(const Log& log, const std::vector<StampedPose>& truth, const LiveOptions& options = {});
inline constexpr double kTruthReach_m = 2.0;

/// Where live poses truly were: each carries the correction of the pose with known truth before it in time and that of
/// the one after it, weighted by nearness in time.
class TruthOfLive {
 public:
  /// Both sorted by time; poses pair as pairing.hpp says.
  TruthOfLive(const std::vector<StampedPose>& live, const std::vector<StampedPose>& truth);
  /// False where both neighbours lie farther than kTruthReach_m away.
  bool correct(double seconds, const Pose2& live_T_base, Pose2& truth_T_base) const;

 private:
  struct Anchor {
    double seconds = 0.0;
    Pose2 live;
    Pose2 truth;
  };
  std::vector<Anchor> anchors_;
};

/// Cells of one lattice over the whole truth frame, a bit each.
struct ObservedArea {
  std::vector<std::uint64_t> bits;
  std::size_t cells = 0;  ///< that are observed
};

struct EvalSubmap {
  std::size_t drive = 0;       ///< index of its LiveDrive
  std::size_t first_scan = 0;  ///< indices of its scans: first …
  std::size_t scan_count = 0;  ///< … and how many
  RenderedSubmap grid;         ///< world_T_submap: live, in the frame of its session
  Pose2 truth_T_submap;
  ObservedArea area;
};

enum class SubmapFrames {
  aligned,  ///< axes of the session's frame; the matcher then looks better than it is, since buildings are rectangular
  random,   ///< each submap in an orientation of its own
};

struct SubmapOptions {
  std::uint16_t scans = 40;  ///< K
  std::uint16_t every = 0;   ///< a submap begins every so many scans; 0: K / 4
  std::uint16_t side = 768;  ///< cells
  float cell_m = 0.05F;
  SubmapFrames frames = SubmapFrames::random;
  std::uint64_t seed = 1;     ///< of the orientations
  double area_cell_m = 0.05;  ///< of the lattice that overlap is counted on: the cells of the submaps
};

/// The submaps of all drives, whose truths are in one frame, in order. Centred where their scans were taken. The
/// result does not depend on `threads`.
std::vector<EvalSubmap> make_submaps(const std::vector<LiveDrive>& drives, const SubmapOptions& options,
                                     std::size_t threads = 1);

/// A pair whose scans are disjoint; a comes before b.
struct EvalPair {
  std::size_t a = 0;
  std::size_t b = 0;
  double overlap = 0.0;        ///< shared observed area over the smaller one, at the true poses
  double union_overlap = 0.0;  ///< … over the area that either observed
  Pose2 a_T_b;                 ///< true
  double weight = 1.0;         ///< how many pairs it stands for, where they were sampled
};

enum class PairChoice {
  all,               ///< every pair that shares no scan
  between_sessions,  ///< only those of different drives
};

std::vector<EvalPair> make_pairs(const std::vector<EvalSubmap>& submaps, PairChoice choice = PairChoice::all);

/// Pairs that overlap so much are positive, in the paper and here …
inline constexpr double kPositiveOverlap = 0.4;
/// … and those that overlap at most so much negative.
inline constexpr double kNegativeOverlap = 0.1;

}  // namespace mellin::host
