// GMapping with forgetting (Grisetti, Stachniss, Burgard 2007; paper, Section III-A): a Rao-Blackwellised particle
// filter in which each particle carries its own live grid and the poses of the remembered scans, and the oldest scan is
// subtracted from every grid when the memory is full. With one particle it is a scan matcher without sampling.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/random.hpp"
#include "mellin/mapping/live_grid.hpp"
#include "mellin/mapping/local_mapper.hpp"
#include "mellin/mapping/odometry_model.hpp"
#include "mellin/mapping/scan_matcher.hpp"
#include "mellin/mapping/track_monitor.hpp"

namespace mellin {

struct ParticleMapperConfig {
  /// Measured on intel, fr079 and aces, one does as well as ten (the paper's number) at a twelfth of the time: within
  /// the scan memory there are hardly any loops for the others to tell apart.
  std::uint16_t particles = 1;
  std::uint16_t remembered_scans = 40;  ///< K: the live map is the sum of this many scans
  std::uint16_t spare_scans = 12;       ///< kept beyond K, so that a submap can be rendered while scans come in
  std::uint16_t side = 768;             ///< cells of the window; even
  float cell_m = 0.05F;
  /// A scan counts a cell of the live map once instead of once a beam: 2 bytes a cell instead of 4.
  bool count_once_a_scan = false;
  float take_distance_m = 0.5F;         ///< a scan is taken when odometry says so much straight-line distance …
  float take_angle_rad = 0.523598776F;  ///< … or so much turn since the last taken one
  float resample_share = 0.5F;          ///< resample when the effective number of particles falls below this share
  float proposal_spread = 0.3F;         ///< share of the match's standard deviation that sampling uses
  std::uint16_t max_beams = 0;          ///< of any laser
  ScanMatcherConfig matcher;
  MotionNoise noise;
  OdometryModelConfig odometry;
  TrackMonitorConfig monitor;
};

class ParticleMapper final : public LocalMapper {
 public:
  struct Particle {
    LiveGrid grid;
    Pose2 pose;               ///< at the newest taken scan
    double log_weight = 0.0;  ///< since the last resampling, relative
    Sym3 information;         ///< of the last match
    bool matched = false;
    std::uint16_t offspring = 0;  ///< scratch of resampling: copies drawn of it
  };
  struct Memory {
    ScanMemory::Memory scans;
    ScanMatcher::Memory matcher;
    LiveGrid::Memory grids;
    Span<Particle> particles;
    Span<Pose2> poses;     ///< particle by particle, a ring by scan number
    Span<CellRect> rects;  ///< the part of the window that each scan has been continuously inside
    Span<Sym3> drifts;     ///< of the best particle's match, a ring by scan number
  };
  template <class A>
  static constexpr Memory carve(A& arena, const ParticleMapperConfig& config) {
    const std::size_t capacity = std::size_t{config.remembered_scans} + config.spare_scans;
    return {ScanMemory::carve(arena, scan_memory_config(config)),
            ScanMatcher::carve(arena, matcher_config(config)),
            LiveGrid::carve(arena, config.side, config.particles, config.count_once_a_scan),
            arena.template take<Particle>(config.particles, Part::mapper),
            arena.template take<Pose2>(capacity * config.particles, Part::mapper),
            arena.template take<CellRect>(std::size_t{config.remembered_scans} * config.particles, Part::mapper),
            arena.template take<Sym3>(capacity, Part::mapper)};
  }

  ParticleMapper() = default;
  /// `lasers` has kMaxLasers elements and stays the caller's.
  ParticleMapper(const ParticleMapperConfig& config, const Memory& memory, Span<const LaserConfig> lasers,
                 std::uint64_t seed);

  void reset(const Pose2& session_T_base) override;
  Result<ScanOutcome> add(const Scan& scan) override;
  Pose2 pose() const override { return tracked_; }
  Sym3 covariance() const override;
  const CountingGrid& live_map() const override { return memory_.particles[best_].grid.grid(); }
  float cell_m() const override { return config_.cell_m; }
  const ScanMemory& scans() const override { return scans_; }
  std::uint32_t first_remembered() const override {
    return scans_.end() > stretch_begin_ + config_.remembered_scans ? scans_.end() - config_.remembered_scans
                                                                    : stretch_begin_;
  }
  std::uint16_t stretch() const override { return stretch_; }
  std::uint32_t stretch_begin() const override { return stretch_begin_; }
  Pose2 scan_pose(std::uint32_t number) const override { return poses(best_)[number % pose_capacity()]; }
  Sym3 scan_drift(std::uint32_t number) const override { return memory_.drifts[number % pose_capacity()]; }
  const MapperStatistics& statistics() const override { return statistics_; }
  /// What is known of the odometry by now.
  const OdometryModel& odometry() const { return odometry_; }

  /// Poses lie within so much of their frame's origin: cells are counted in 32 bits. A scan whose odometry leads
  /// beyond is bad_data.
  static constexpr double kReach_m = 1e6;
  /// Whether a pose is finite and within that reach; turns count up to kReach_m radians.
  static bool within_reach(const Pose2& pose);

 private:
  static constexpr ScanMemoryConfig scan_memory_config(const ParticleMapperConfig& config) {
    return {static_cast<std::uint16_t>(config.remembered_scans + config.spare_scans), config.max_beams};
  }
  static constexpr ScanMatcherConfig matcher_config(const ParticleMapperConfig& config) {
    ScanMatcherConfig matcher = config.matcher;
    matcher.max_points = config.max_beams;
    return matcher;
  }
  std::size_t pose_capacity() const { return std::size_t{config_.remembered_scans} + config_.spare_scans; }
  Span<Pose2> poses(std::size_t particle) const {
    return memory_.poses.subspan(particle * pose_capacity(), pose_capacity());
  }
  Span<CellRect> rects(std::size_t particle) const {
    return memory_.rects.subspan(particle * config_.remembered_scans, config_.remembered_scans);
  }

  bool acceptable(const Scan& scan);
  void count_oddities(const Scan& scan);
  Sym3 prior_information(const Pose2& motion) const;
  void learn_odometry(std::uint32_t number, const Sym3& scan_information);
  ScanUse track(const Pose2& predicted, const Sym3& prior);
  ScanUse take(const Pose2& predicted, const Sym3& prior);
  bool due(const Pose2& odometry) const;
  MatchResult reconsidered(const LiveGrid& grid, const Pose2& predicted, const MatchResult& match);
  void begin_stretch(const Pose2& session_T_base);
  void copy_poses(std::size_t from, std::size_t to);
  void propose(std::size_t index, const Pose2& predicted, const Sym3& prior);
  void remember(std::size_t index, std::uint32_t number);
  void resample_if_poor();

  ParticleMapperConfig config_;
  Memory memory_;
  Span<const LaserConfig> lasers_;
  ScanMemory scans_;
  ScanMatcher matcher_;
  OdometryModel odometry_;
  TrackMonitor monitor_;
  std::uint64_t seed_ = 0;
  MapperStatistics statistics_;
  std::size_t best_ = 0;
  Pose2 motion_;   ///< by odometry, since the last taken scan
  Pose2 tracked_;  ///< live pose at the newest scan, taken or not
  Sym3 tracked_information_;
  std::int64_t last_stamp_us_ = 0;  ///< of the newest scan
  Pose2 last_odometry_;             ///< at the newest scan
  Pose2 taken_odometry_;            ///< at the newest taken scan
  Pose2 due_odometry_;              ///< at the newest scan that was due to be taken
  std::uint32_t stretch_begin_ = 0;
  std::uint16_t stretch_ = 0;
};

}  // namespace mellin
