// The local mapper (paper, Section III-A) as the rest of the system sees it: takes scans, keeps a live map of the last
// few dozen, says where the robot is in it. The paper's own, GMapping that forgets, is particle_mapper.hpp; another one
// takes its place by implementing this interface.
#pragma once

#include <cstdint>

#include "mellin/core/se2.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/counting_grid.hpp"
#include "mellin/mapping/laser.hpp"
#include "mellin/mapping/scan_memory.hpp"

namespace mellin {

enum class ScanUse : std::uint8_t {
  taken,     ///< matched and added to the live map
  matched,   ///< matched to the live map only
  odometry,  ///< matching failed: the pose rides on odometry from the last one
  doubted,   ///< due to be taken, but it contradicts the live map: not added, since the robot may not be where it seems
  lost,      ///< too many in a row did: the live map begins afresh with this scan, where odometry has the robot
};

struct ScanOutcome {
  ScanUse use = ScanUse::odometry;
  bool taken = false;             ///< added to the live map, whether matched or not
  Pose2 session_T_base;           ///< the live pose
  std::uint32_t anchor_scan = 0;  ///< number of the newest taken scan …
  Pose2 anchor_T_base;            ///< … and the pose relative to it, which later corrections leave as it is
};

/// Since the mapper was made: reset() leaves them as they are, so that what went wrong before a new session is still
/// seen.
struct MapperStatistics {
  std::uint32_t scans = 0;  ///< given, refused ones included
  std::uint32_t taken = 0;
  std::uint32_t unmatched = 0;  ///< rode on odometry
  std::uint32_t refused = 0;    ///< bad_data; the sum of the next four
  std::uint32_t unknown_laser = 0;
  std::uint32_t wrong_count = 0;   ///< of ranges
  std::uint32_t bad_odometry = 0;  ///< not finite, or out of the mapper's reach by itself
  std::uint32_t beyond_reach = 0;  ///< the odometry's jumps added up to a pose out of the mapper's reach
  std::uint32_t bad_ranges = 0;   ///< accepted scans with a range that is NaN or negative: a beam that measured nothing
  std::uint32_t blind = 0;        ///< accepted scans of which no beam measured anything
  std::uint32_t stamps_back = 0;  ///< accepted scans stamped earlier than the one accepted before
  std::uint32_t stamps_repeated = 0;  ///< accepted scans stamped as the one accepted before
  std::uint32_t resampled = 0;
  std::uint32_t recovered = 0;  ///< matched by the wider search only
  std::uint32_t doubted = 0;    ///< due to be taken, and not added
  std::uint32_t lost = 0;       ///< times that the live map began afresh
};

class LocalMapper {
 public:
  /// Forgets everything; the robot starts at the given pose.
  virtual void reset(const Pose2& session_T_base) = 0;

  /// Takes the next scan. bad_data: an odometry that is not finite or leads out of the mapper's reach, a laser that is
  /// not configured, a wrong number of ranges; the scan is then ignored and counted. Scans count in the order in which
  /// they are given: a stamp that jumps back, stands still or leaps ahead is kept as it is, counted, and changes
  /// nothing. Cost bounded by the configuration.
  virtual Result<ScanOutcome> add(const Scan& scan) = 0;

  virtual Pose2 pose() const = 0;
  /// Covariance of pose() against the live map, in the robot's own frame.
  virtual Sym3 covariance() const = 0;
  /// The live map round the robot.
  virtual const CountingGrid& live_map() const = 0;
  virtual float cell_m() const = 0;

  /// The scans in memory: [first_remembered(), scans().end()) are in the live map; older ones that scans() still holds
  /// wait to be rendered.
  virtual const ScanMemory& scans() const = 0;
  virtual std::uint32_t first_remembered() const = 0;
  /// A stretch is the way from one loss of the robot's place to the next; within a session they count from 0. Poses
  /// are continuous by odometry from one to the next, but nothing else holds them together.
  virtual std::uint16_t stretch() const = 0;
  /// Number of the present stretch's first scan: the live map holds none from before.
  virtual std::uint32_t stretch_begin() const = 0;
  /// Where the robot was at a scan that scans() holds, as the best hypothesis has it now.
  virtual Pose2 scan_pose(std::uint32_t number) const = 0;
  /// Covariance, in the robot's own frame, of what the error of the odometry since the scan before leaves in that
  /// scan's pose: next to nothing where the scan determines the pose, all of it where it does not (along a corridor).
  /// Since odometry errs the same way again and again, such deviations add up along the way.
  virtual Sym3 scan_drift(std::uint32_t number) const = 0;
  virtual const MapperStatistics& statistics() const = 0;

 protected:
  ~LocalMapper() = default;
};

}  // namespace mellin
