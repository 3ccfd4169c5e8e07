#include "mellin/mapping/particle_mapper.hpp"

namespace mellin {
namespace {

double wide(float value) { return static_cast<double>(value); }

double magnitude(double value) { return value < 0.0 ? -value : value; }

/// Draws from a normal distribution of the given covariance (Cholesky factor times standard normals).
Pose2 draw(const Sym3& covariance, Random& random) {
  const double u = random.normal();
  const double v = random.normal();
  const double w = random.normal();
  const double a = sqrt(covariance.xx);
  const double b = covariance.xy / a;
  const double c = covariance.xt / a;
  const double d = sqrt(covariance.yy - b * b > 0.0 ? covariance.yy - b * b : 0.0);
  const double e = d > 0.0 ? (covariance.yt - b * c) / d : 0.0;
  const double rest = covariance.tt - c * c - e * e;
  return {a * u, b * u + d * v, c * u + e * v + sqrt(rest > 0.0 ? rest : 0.0) * w};
}

/// What an error of the odometry leaves in a pose that scan and odometry determine together: of the estimate
/// S (A x_scan + W x_odometry) with S = (A + W)^-1, an odometry error of covariance W^-1 becomes one of S W S.
Sym3 drift_left(const Sym3& odometry_information, const Sym3& scan_information) {
  const Sym3& w = odometry_information;  // diagonal
  Sym3 s;
  if (!invert(scan_information + w, s)) {
    (void)invert(w, s);
    return s;
  }
  return {s.xx * w.xx * s.xx + s.xy * w.yy * s.xy + s.xt * w.tt * s.xt,
          s.xx * w.xx * s.xy + s.xy * w.yy * s.yy + s.xt * w.tt * s.yt,
          s.xx * w.xx * s.xt + s.xy * w.yy * s.yt + s.xt * w.tt * s.tt,
          s.xy * w.xx * s.xy + s.yy * w.yy * s.yy + s.yt * w.tt * s.yt,
          s.xy * w.xx * s.xt + s.yy * w.yy * s.yt + s.yt * w.tt * s.tt,
          s.xt * w.xx * s.xt + s.yt * w.yy * s.yt + s.tt * w.tt * s.tt};
}

}  // namespace

ParticleMapper::ParticleMapper(const ParticleMapperConfig& config, const Memory& memory, Span<const LaserConfig> lasers,
                               std::uint64_t seed)
    : config_(config),
      memory_(memory),
      lasers_(lasers),
      scans_(scan_memory_config(config), memory.scans, lasers),
      matcher_(matcher_config(config), memory.matcher),
      odometry_(config.odometry, config.noise),
      monitor_(config.monitor),
      seed_(seed) {
  for (std::size_t p = 0; p < config.particles; ++p) {
    memory_.particles[p].grid = LiveGrid(memory.grids, p, config.side, config.cell_m);
  }
  reset({});
}

void ParticleMapper::reset(const Pose2& session_T_base) {
  scans_.clear();
  odometry_.reset();
  stretch_ = 0;
  best_ = 0;
  begin_stretch(session_T_base);
}

/// An empty live map, with the robot at the given pose of the session's frame.
void ParticleMapper::begin_stretch(const Pose2& session_T_base) {
  stretch_begin_ = scans_.end();
  monitor_.reset();
  tracked_ = session_T_base;
  tracked_information_ = prior_information({});
  for (Particle& particle : memory_.particles) {
    particle.grid.reset(session_T_base);
    particle.pose = session_T_base;
    particle.log_weight = 0.0;
    particle.information = tracked_information_;
  }
  for (std::size_t p = 0; p < config_.particles && scans_.end() > 0; ++p) {
    // Whichever of them is the best next, it knows where the scans before were, which may still be rendered.
    copy_poses(best_, p);
  }
}

void ParticleMapper::copy_poses(std::size_t from, std::size_t to) {
  const Span<const Pose2> source = poses(from);
  Pose2* target = poses(to).data();
  for (const Pose2& pose : source) {
    *target++ = pose;
  }
}

bool ParticleMapper::within_reach(const Pose2& pose) {
  return magnitude(pose.x) < kReach_m && magnitude(pose.y) < kReach_m && magnitude(pose.theta) < kReach_m;
}

/// Whether it can be mapped; counts why not.
bool ParticleMapper::acceptable(const Scan& scan) {
  if (scan.laser >= kMaxLasers || lasers_[scan.laser].beams == 0) {
    ++statistics_.unknown_laser;
    return false;
  }
  if (scan.ranges_m.size() != lasers_[scan.laser].beams) {
    ++statistics_.wrong_count;
    return false;
  }
  const bool sane = within_reach(scan.odom_T_base);
  statistics_.bad_odometry += sane ? 0U : 1U;
  return sane;
}

/// What an accepted scan has that a working sensor and clock do not give.
void ParticleMapper::count_oddities(const Scan& scan) {
  if (scans_.end() > 0) {
    statistics_.stamps_back += scan.stamp_us < last_stamp_us_ ? 1U : 0U;
    statistics_.stamps_repeated += scan.stamp_us == last_stamp_us_ ? 1U : 0U;
  }
  last_stamp_us_ = scan.stamp_us;
  bool bad = false;
  for (const float range : scan.ranges_m) {
    bad = bad || !(range >= 0.0F);
  }
  bool seen = false;
  for (const StoredRange range : scans_.ranges(scans_.end())) {
    seen = seen || range != 0;
  }
  statistics_.bad_ranges += bad ? 1U : 0U;
  statistics_.blind += seen ? 0U : 1U;
}

Sym3 ParticleMapper::prior_information(const Pose2& motion) const {
  const Sym3 covariance = odometry_.covariance(motion);
  return diagonal(1.0 / covariance.xx, 1.0 / covariance.yy, 1.0 / covariance.tt);
}

/// From the way between the last taken scan and this one, where the scans are sure of both.
void ParticleMapper::learn_odometry(std::uint32_t number, const Sym3& scan_information) {
  if (number == 0 || !memory_.particles[best_].matched) {
    odometry_.skip();
    return;
  }
  odometry_.learn(between(poses(best_)[(number - 1) % pose_capacity()], tracked_), scan_information);
}

Result<ScanOutcome> ParticleMapper::add(const Scan& scan) {
  ++statistics_.scans;
  if (!acceptable(scan)) {
    ++statistics_.refused;
    return Status::bad_data;
  }
  const bool first = scans_.end() == 0;
  const Pose2 motion = first ? Pose2{} : between(last_odometry_, scan.odom_T_base);
  const Pose2 since_taken = first ? Pose2{} : between(taken_odometry_, scan.odom_T_base);
  const std::uint32_t taken_before = scans_.end();
  const Pose2 predicted = compose(tracked_, odometry_.corrected(motion));
  if (!within_reach(predicted)) {  // odometry that jumps adds up
    ++statistics_.refused;
    ++statistics_.beyond_reach;
    return Status::bad_data;
  }
  last_odometry_ = scan.odom_T_base;
  odometry_.advance(motion);
  scans_.stage(scan);
  count_oddities(scan);
  (void)matcher_.set_scan(scans_.ranges(scans_.end()), scans_.directions(scans_.end()),
                          lasers_[scan.laser].base_T_laser, config_.cell_m);

  // The matches on the way from the last taken scan leaned on the odometry, too: it errs over the whole way.
  const Sym3 prior = prior_information(since_taken);
  ScanOutcome outcome;
  if (due(scan.odom_T_base)) {
    due_odometry_ = scan.odom_T_base;
    motion_ = since_taken;
    outcome.use = take(predicted, prior);
  } else {
    outcome.use = track(predicted, prior);
  }
  outcome.taken = scans_.end() > taken_before;
  if (outcome.taken) {
    taken_odometry_ = scan.odom_T_base;
    ++statistics_.taken;
  }
  statistics_.unmatched += outcome.use == ScanUse::odometry ? 1U : 0U;
  statistics_.doubted += outcome.use == ScanUse::doubted ? 1U : 0U;
  statistics_.lost += outcome.use == ScanUse::lost ? 1U : 0U;
  outcome.session_T_base = tracked_;
  outcome.anchor_scan = scans_.end() - 1;
  outcome.anchor_T_base = between(scan_pose(outcome.anchor_scan), tracked_);
  return outcome;
}

/// Whether a scan with this odometry is to be taken.
bool ParticleMapper::due(const Pose2& odometry) const {
  const Pose2 moved = between(due_odometry_, odometry);
  return scans_.end() == 0 || translation(moved) >= wide(config_.take_distance_m) ||
         magnitude(moved.theta) >= wide(config_.take_angle_rad);
}

/// A second opinion on what the ordinary search found: the wider one, where that failed or where much speaks against
/// its pose, for a scan can fit half of a room well and contradict the other half. Good where it can be relied on.
MatchResult ParticleMapper::reconsidered(const LiveGrid& grid, const Pose2& predicted, const MatchResult& match) {
  const MapAgreement agreement = matcher_.compare(grid, match.pose);
  if (match.good && !monitor_.suspects(agreement)) {
    return match;
  }
  const MatchResult wider = matcher_.recover(grid, predicted, match);
  if (wider.good && !monitor_.suspects(matcher_.compare(grid, wider.pose))) {
    ++statistics_.recovered;
    return wider;
  }
  MatchResult relied_on = match;
  relied_on.good = match.good && !monitor_.contradicts(agreement);
  return relied_on;
}

ScanUse ParticleMapper::track(const Pose2& predicted, const Sym3& prior) {
  const LiveGrid& grid = memory_.particles[best_].grid;
  MatchResult match = matcher_.refine(grid, predicted, predicted, prior);
  if (!match.good) {
    match = matcher_.search(grid, predicted, prior);
  }
  match = reconsidered(grid, predicted, match);
  tracked_ = match.good ? match.pose : predicted;
  tracked_information_ = match.good ? match.information : prior;
  return match.good ? ScanUse::matched : ScanUse::odometry;
}

ScanUse ParticleMapper::take(const Pose2& predicted, const Sym3& prior) {
  const std::uint32_t number = scans_.end();
  const bool first = number == 0;
  if (matcher_.points() == 0 && !first) {
    tracked_ = predicted;  // nothing to add: the live map keeps the scans that it has
    tracked_information_ = prior;
    return ScanUse::odometry;
  }
  const Pose2 best_before = memory_.particles[best_].pose;
  for (std::size_t p = 0; p < config_.particles; ++p) {
    // What was learnt of the motion between the taken scans holds for every particle.
    const Pose2 own = p == best_ ? predicted : compose(memory_.particles[p].pose, between(best_before, predicted));
    propose(p, own, prior);
  }
  best_ = 0;
  for (std::size_t p = 1; p < config_.particles; ++p) {
    best_ = memory_.particles[p].log_weight > memory_.particles[best_].log_weight ? p : best_;
  }
  const Particle& best = memory_.particles[best_];
  tracked_ = best.pose;
  tracked_information_ = best.information;
  const TrackState state =
      first ? TrackState::sure : monitor_.judge(best.matched, matcher_.compare(best.grid, tracked_));
  if (state == TrackState::doubted) {
    memory_.particles[best_].pose = predicted;
    tracked_ = predicted;
    tracked_information_ = prior;
    return ScanUse::doubted;
  }
  if (state == TrackState::lost) {
    ++stretch_;
    begin_stretch(predicted);
  }
  // Before the scan is in the map, which it would agree with by itself.
  const Sym3 seen = matcher_.scan_information(best.grid, tracked_);
  memory_.drifts[number % pose_capacity()] = drift_left(prior_information(motion_), seen);
  if (state == TrackState::lost) {
    odometry_.skip();
  } else {
    learn_odometry(number, seen);
  }
  (void)scans_.take_staged();
  for (std::size_t p = 0; p < config_.particles; ++p) {
    remember(p, number);
  }
  const bool matched = first || best.matched;
  if (config_.particles > 1) {
    resample_if_poor();
  }
  return state == TrackState::lost ? ScanUse::lost : matched ? ScanUse::taken : ScanUse::odometry;
}

void ParticleMapper::propose(std::size_t index, const Pose2& predicted, const Sym3& prior) {
  Particle& particle = memory_.particles[index];
  particle.matched = false;
  if (scans_.end() == 0) {
    particle.pose = predicted;
    return;
  }
  Random random(seed_, std::uint64_t{scans_.end()} * config_.particles + index);
  Sym3 covariance;
  Pose2 start = predicted;
  if (config_.particles > 1 && invert(prior, covariance)) {
    start = compose(predicted, draw(covariance, random));  // the motion model
  }
  const MatchResult match = reconsidered(particle.grid, start, matcher_.search(particle.grid, start, prior));
  particle.matched = match.good;
  if (!match.good) {
    particle.pose = start;
    particle.information = prior;
    particle.log_weight += wide(config_.matcher.scan_weight * match.score);
    return;
  }
  particle.pose = match.pose;
  particle.information = match.information;
  if (config_.particles > 1 && invert(match.information, covariance)) {
    // The improved proposal: a Gaussian round the match, narrower than the motion model.
    const double spread = wide(config_.proposal_spread);
    particle.pose = compose(match.pose, draw(scale(covariance, spread * spread), random));
  }
  const Pose2 off = match.recovered ? Pose2{} : between(predicted, match.pose);
  particle.log_weight += wide(config_.matcher.scan_weight * match.score) - 0.5 * quadratic_form(prior, off);
}

void ParticleMapper::remember(std::size_t index, std::uint32_t number) {
  Particle& particle = memory_.particles[index];
  const Span<Pose2> scan_poses = poses(index);
  const Span<CellRect> scan_rects = rects(index);
  const std::uint32_t k = config_.remembered_scans;
  if (number >= stretch_begin_ + k) {
    const std::uint32_t oldest = number - k;
    particle.grid.remove(scans_, oldest, scan_poses[oldest % pose_capacity()], scan_rects[oldest % k]);
  }
  if (particle.grid.off_centre(particle.pose) > config_.side / 12) {
    particle.grid.roll_to(particle.pose);
    for (CellRect& rect : scan_rects) {
      rect = intersection(rect, particle.grid.grid().window());
    }
  }
  scan_poses[number % pose_capacity()] = particle.pose;
  scan_rects[number % k] = particle.grid.grid().window();
  particle.grid.add(scans_, number, particle.pose, scan_rects[number % k]);
}

void ParticleMapper::resample_if_poor() {
  const std::size_t n = config_.particles;
  const double top = memory_.particles[best_].log_weight;
  double sum = 0.0;
  double squares = 0.0;
  for (Particle& particle : memory_.particles) {
    particle.log_weight -= top;
    const double weight = exp(particle.log_weight);
    sum += weight;
    squares += weight * weight;
  }
  if (sum * sum >= wide(config_.resample_share) * static_cast<double>(n) * squares) {
    return;
  }
  ++statistics_.resampled;
  // Low-variance resampling (Thrun, Burgard, Fox 2005, Table 4.4), sorted so that survivors stay in place.
  Random random(seed_, ~std::uint64_t{scans_.end()});
  const double step = sum / static_cast<double>(n);
  double target = random.uniform() * step;
  double reached = 0.0;
  std::size_t drawn = 0;
  for (Particle& particle : memory_.particles) {
    reached += exp(particle.log_weight);
    particle.offspring = 0;
    while (drawn < n && target < reached) {
      ++particle.offspring;
      ++drawn;
      target += step;
    }
  }
  memory_.particles[n - 1].offspring = static_cast<std::uint16_t>(memory_.particles[n - 1].offspring + (n - drawn));
  std::size_t source = 0;
  for (std::size_t p = 0; p < n; ++p) {
    Particle& dead = memory_.particles[p];
    if (dead.offspring > 0) {
      continue;
    }
    while (memory_.particles[source].offspring < 2) {
      ++source;
    }
    Particle& alive = memory_.particles[source];
    --alive.offspring;
    dead.offspring = 1;
    dead.grid.copy_from(alive.grid);
    dead.pose = alive.pose;
    dead.information = alive.information;
    dead.matched = alive.matched;
    copy_poses(source, p);
    for (std::size_t i = 0; i < config_.remembered_scans; ++i) {
      rects(p)[i] = rects(source)[i];
    }
  }
  for (Particle& particle : memory_.particles) {
    particle.log_weight = 0.0;
  }
  // The best particle survives: its share of the weight is the largest. Where it lies now is its own place.
}

Sym3 ParticleMapper::covariance() const {
  Sym3 spread;
  if (!invert(tracked_information_, spread)) {
    spread = diagonal(1.0, 1.0, 1.0);
  }
  if (config_.particles < 2) {
    return spread;
  }
  double total = 0.0;
  double xx = 0.0;
  double yy = 0.0;
  double xy = 0.0;
  double tt = 0.0;
  const Pose2 best = memory_.particles[best_].pose;
  for (const Particle& particle : memory_.particles) {
    const double weight = exp(particle.log_weight);
    const Pose2 off = between(best, particle.pose);
    total += weight;
    xx += weight * off.x * off.x;
    xy += weight * off.x * off.y;
    yy += weight * off.y * off.y;
    tt += weight * off.theta * off.theta;
  }
  return spread + scale({xx, xy, 0.0, yy, 0.0, tt}, 1.0 / total);
}

}  // namespace mellin
