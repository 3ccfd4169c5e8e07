#include "host/mapping_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "host/heap_counter.hpp"
#include "posix/clock.hpp"

namespace mellin::host {
namespace {

bool same_laser(const LaserConfig& a, const LaserConfig& b) {
  const Pose2 off = between(a.base_T_laser, b.base_T_laser);
  return a.beams == b.beams && a.angle_min_rad == b.angle_min_rad && a.angle_increment_rad == b.angle_increment_rad &&
         a.max_range_m == b.max_range_m && translation(off) == 0.0 && off.theta == 0.0;
}

}  // namespace

std::vector<std::uint8_t> add_lasers(Config& config, const Log& log) {
  std::vector<std::uint8_t> indices;
  for (const LaserSpec& spec : log.lasers) {
    LaserConfig laser;
    laser.beams = static_cast<std::uint16_t>(spec.beams);
    laser.angle_min_rad = static_cast<float>(spec.angle_min_rad);
    laser.angle_increment_rad = static_cast<float>(spec.increment_rad);
    laser.max_range_m = static_cast<float>(spec.max_range_m);
    laser.base_T_laser = spec.base_T_laser;
    std::size_t at = 0;
    while (at < kMaxLasers && config.lasers[at].beams > 0 && !same_laser(config.lasers[at], laser)) {
      ++at;
    }
    if (at == kMaxLasers) {
      throw std::runtime_error(log.path + ": expected at most " + std::to_string(kMaxLasers) +
                               " different lasers in all logs together, found more");
    }
    config.lasers[at] = laser;
    indices.push_back(static_cast<std::uint8_t>(at));
  }
  return indices;
}

MappingRun::MappingRun(const Config& config, const mellin_flash& flash,
                       std::function<void(const std::string&)> log_sink)
    : memory_((required_bytes(config) + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t)),
      log_sink_(std::move(log_sink)) {
  reserve_room();
  mellin_port port = {};
  port.flash = flash;
  port.clock = posix::monotonic_clock();
  port.log = {this, log_line};
  const Span<std::byte> bytes(reinterpret_cast<std::byte*>(memory_.data()), required_bytes(config));
  Result<Slam*> slam = Slam::create(config, bytes, port);
  take_events();
  if (!slam.ok()) {
    throw std::runtime_error(std::string("the library refuses to start: ") + to_string(slam.status()));
  }
  slam_ = slam.value();
  slam_->observe_submaps({this, frozen});
  slam_->observe_pairs({this, pair_seen});
  next_stored_ = slam_->collection().size();
}

void MappingRun::reserve_room() {
  lines_.reserve(256);
  pairs_.reserve(4096);
  frozen_.reserve(64);
  frozen_poses_.reserve(4096);
}

void MappingRun::log_line(void* context, mellin_log_level level, const char* line) {
  if (level != MELLIN_LOG_DEBUG) {
    std::array<char, 160> text{};
    std::strncpy(text.data(), line, text.size() - 1);
    static_cast<MappingRun*>(context)->lines_.push_back(text);
  }
}

void MappingRun::frozen(void* context, SubmapId id, std::uint32_t first_scan, Span<const Pose2> submap_T_scan) {
  MappingRun& self = *static_cast<MappingRun*>(context);
  self.frozen_.push_back({id, first_scan, self.frozen_poses_.size(), submap_T_scan.size()});
  self.frozen_poses_.insert(self.frozen_poses_.end(), submap_T_scan.begin(), submap_T_scan.end());
}

void MappingRun::pair_seen(void* context, const PairEvent& event) {
  static_cast<MappingRun*>(context)->pairs_.push_back(event);
}

void MappingRun::take_events() {
  for (const std::array<char, 160>& line : lines_) {
    if (log_sink_) {
      log_sink_(line.data());
    }
  }
  lines_.clear();
  for (const FrozenSubmap& submap : frozen_) {
    MappedSession& session = sessions_.back();
    session.submaps.push_back(submap.id);
    session.placements.resize(std::max(session.placements.size(), submap.first_scan + submap.count));
    for (std::size_t i = 0; i < submap.count; ++i) {
      const auto centrality = static_cast<double>(std::min(i + 1, submap.count - i));
      session.placements[submap.first_scan + i].push_back(
          {submap.id, frozen_poses_[submap.first_pose + i], centrality});
    }
  }
  frozen_.clear();
  frozen_poses_.clear();
  for (const PairEvent& event : pairs_) {
    MatchRow row;
    row.a = event.a;
    row.b = event.b;
    row.kind = event.between_sessions ? "merge" : "loop";
    row.stage = event.stage == PairEvent::Stage::screened     ? "screened"
                : event.stage == PairEvent::Stage::registered ? "registered"
                                                              : "decided";
    row.score = static_cast<double>(event.score);
    row.agreement = static_cast<double>(event.agreement);
    row.a_T_b = event.a_T_b;
    row.accepted = event.accepted;
    row.why = to_string(event.reason);
    row.nearby = event.nearby;
    matches_.push_back(row);
  }
  pairs_.clear();
}

void MappingRun::drain() {
  for (bool more = true; more;) {
    {
      const LibraryCall inside;
      more = slam_->work(64);
    }
    take_events();
  }
  const std::uint32_t stored = slam_->collection().statistics().stored;
  for (; reported_stored_ < stored; ++reported_stored_) {
    if (on_stored) {
      on_stored(next_stored_);
    }
    ++next_stored_;
  }
}

/// The last scan begins a new stretch. Those since the first one that was in doubt belong to it, and not to the last
/// scan that was not; so do those right before that rode on odometry.
void MappingRun::rehang_doubted(MappedSession& session) {
  const MappedSession::MappedScan first = session.scans.back();
  const auto of_old_anchor = [&](const MappedSession::MappedScan& scan) {
    return scan.anchor_scan + 1 == first.anchor_scan;
  };
  auto from = std::find_if(session.scans.begin(), session.scans.end(), [&](const MappedSession::MappedScan& scan) {
    return of_old_anchor(scan) && scan.use == ScanUse::doubted;
  });
  while (from != session.scans.begin() && of_old_anchor(*(from - 1)) && (from - 1)->use == ScanUse::odometry) {
    --from;
  }
  for (; from != session.scans.end(); ++from) {
    from->anchor_scan = first.anchor_scan;
    from->anchor_T_base = between(first.session_T_base, from->session_T_base);
  }
}

void MappingRun::map(const Log& log, const std::vector<std::uint8_t>& lasers,
                     const std::function<void(std::size_t)>& progress) {
  if (!sessions_.empty()) {
    const Status status = slam_->new_session();
    if (status != Status::ok) {
      throw std::runtime_error(log.path + ": no new session: " + to_string(status));
    }
  }
  sessions_.emplace_back();
  sessions_.back().log = log.path;
  sessions_.back().session = static_cast<std::uint16_t>(slam_->collection().session_count() - 1);
  for (std::size_t i = 0; i < log.scans.size(); ++i) {
    const LogScan& in = log.scans[i];
    Scan scan;
    scan.stamp_us = static_cast<std::int64_t>(std::llround(in.seconds * 1e6));
    scan.ranges_m = Span<const float>(in.ranges.data(), in.ranges.size());
    scan.odom_T_base = in.odometry;
    scan.laser = lasers[in.laser];
    const Result<ScanOutcome> outcome = [&] {
      const LibraryCall inside;
      return slam_->add(scan);
    }();
    MappedSession& session = sessions_.back();
    MappedSession::MappedScan mapped;
    mapped.stamp = in.stamp;
    mapped.seconds = in.seconds;
    if (outcome.ok()) {
      mapped.session_T_base = outcome.value().session_T_base;
      mapped.anchor_scan = outcome.value().anchor_scan;
      mapped.anchor_T_base = outcome.value().anchor_T_base;
      mapped.use = outcome.value().use;
    } else if (!session.scans.empty()) {
      mapped = session.scans.back();
      mapped.stamp = in.stamp;
      mapped.seconds = in.seconds;
    }
    session.scans.push_back(mapped);
    if (outcome.ok() && mapped.use == ScanUse::lost) {
      ++session.lost;
      rehang_doubted(session);
    }
    drain();
    if (progress && i % 64 == 0) {
      progress(i);
    }
  }
  if (slam_->begin_flush() != Status::ok) {
    throw std::runtime_error(log.path + ": the session cannot be flushed");
  }
  drain();
}

std::vector<StampedPose> MappingRun::live_trajectory(const MappedSession& session) const {
  std::vector<StampedPose> out;
  out.reserve(session.scans.size());
  for (const MappedSession::MappedScan& scan : session.scans) {
    out.push_back({scan.stamp, scan.seconds, scan.session_T_base});
  }
  return out;
}

Pose2 MappingRun::scan_pose(const MappedSession& session, std::uint32_t scan) const {
  const MapCollection& map = slam_->collection();
  Pose2 first;
  double x = 0.0;
  double y = 0.0;
  double turn = 0.0;
  double total = 0.0;
  for (const MappedSession::Placement& place : session.placements[scan]) {
    const Pose2 pose = compose(map.map_T_submap(place.submap), place.submap_T_scan);
    first = total == 0.0 ? pose : first;
    total += place.weight;
    x += place.weight * pose.x;
    y += place.weight * pose.y;
    turn += place.weight * wrap_angle(pose.theta - first.theta);
  }
  return {x / total, y / total, wrap_angle(first.theta + turn / total)};
}

std::vector<StampedPose> MappingRun::final_trajectory(const MappedSession& session) const {
  const MapCollection& map = slam_->collection();
  std::vector<StampedPose> out;
  out.reserve(session.scans.size());
  for (const MappedSession::MappedScan& scan : session.scans) {
    Pose2 pose;
    if (scan.anchor_scan < session.placements.size() && !session.placements[scan.anchor_scan].empty()) {
      pose = compose(scan_pose(session, scan.anchor_scan), scan.anchor_T_base);
    } else if (!session.submaps.empty()) {
      // In no submap: it rides on the nearest one's correction.
      SubmapId nearest = session.submaps.front();
      for (const SubmapId id : session.submaps) {
        nearest = map.header(id).first_scan <= scan.anchor_scan ? id : nearest;
      }
      pose = compose(map.map_T_submap(nearest), between(map.header(nearest).session_T_submap, scan.session_T_base));
    } else {
      pose = scan.session_T_base;
    }
    out.push_back({scan.stamp, scan.seconds, pose});
  }
  return out;
}

bool MappingRun::with_grid(SubmapId id, const std::function<void(const GridView&)>& use) {
  SubmapStore& store = slam_->store();
  if (!store.is_resident(id)) {
    Status status = store.begin_fetch(id);
    if (status == Status::ok) {
      do {
        status = store.step_fetch();
      } while (status == Status::busy);
    }
    if (status != Status::ok) {
      return false;
    }
  }
  Result<SlotHandle> slot = store.slot(id);
  if (!slot.ok()) {
    return false;
  }
  use(store.slots().view(slot.value()));
  return store.slots().release(slot.value()) == Status::ok;
}

}  // namespace mellin::host
