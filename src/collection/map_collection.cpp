#include "mellin/collection/map_collection.hpp"

#include <cmath>

#include "mellin/collection/persistence.hpp"

namespace mellin {

// Restoring, storing and flushing are in map_storage.cpp.

Status MapCollection::init(const CollectionConfig& config, const Memory& memory, DigestMatcher& digests,
                           GridMatcher& grids, SubmapStore& store, const mellin_clock& clock, Log log) {
  config_ = config;
  memory_ = memory;
  digests_ = &digests;
  grids_ = &grids;
  store_ = &store;
  clock_ = clock;
  log_ = log;
  linker_ = Linker(config.linker, memory.linker);
  candidates_ = List<Candidate>(memory.candidates);
  const PoseGraphConfig graph = graph_config(config);
  const Status status = graph_.init(graph, memory.graph);
  if (status != Status::ok) {
    return status;
  }
  stage_ = store.submap_count() > 0 ? Stage::restore_submaps : Stage::idle;
  return optimiser_.init(graph, memory.optimiser);
}

Status MapCollection::begin_session(const SessionId& id) {
  if (session_count_ >= memory_.sessions.size()) {
    return Status::full;
  }
  session_ = session_count_++;
  memory_.sessions[session_] = id;
  newest_ = kNoSubmap;
  return Status::ok;
}

Result<SubmapId> MapCollection::insert(SubmapHeader header, SlotHandle& slot, const SubmapStep& from_before,
                                       std::uint16_t stretch) {
  if (!ready() || session_count_ == 0) {
    return Status::busy;
  }
  if (count_ >= config_.max_submaps) {
    return Status::full;
  }
  const SubmapId id = count_;
  header.id = id;
  header.session = memory_.sessions[session_];
  const Result<NodeId> node = graph_.add_node(header.session_T_submap);
  if (!node.ok()) {
    return node.status();
  }
  ++count_;
  memory_.headers[id] = header;
  memory_.scans[id] = {session_, stretch, header.first_scan, header.scan_count};
  slot_ = static_cast<SlotHandle&&>(slot);
  (void)store_->slots().assign(slot_, id);
  link_odometry(id, from_before);
  newest_ = id;
  const bool described = digests_->begin_describe(id, store_->slots().view(slot_)) == Status::ok;
  stage_ = described ? Stage::describe : Stage::store_submap;
  return id;
}

void MapCollection::link_odometry(SubmapId id, const SubmapStep& from_before) {
  odometry_edge_ = kNoId;
  if (newest_ == kNoSubmap || !same_stretch(newest_, id)) {
    return;
  }
  const bool measured = from_before.shared_scans > 0 && from_before.before_first_scan == memory_.scans[newest_].first;
  const Pose2 step = measured ? from_before.before_T_submap : session_step(newest_, id);
  const Result<EdgeId> edge = add_odometry_edge(newest_, id, step, from_before.drift);
  if (edge.ok()) {
    odometry_edge_ = edge.value();
  } else {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "submap " << id << ": no odometry edge: " << to_string(edge.status()));
  }
}

bool MapCollection::same_stretch(SubmapId a, SubmapId b) const {
  return memory_.scans[a].session == memory_.scans[b].session && memory_.scans[a].stretch == memory_.scans[b].stretch;
}

/// The edge between two submaps of a stretch, as the local mapper saw them lie; `drift` is what it knows of its error.
Result<EdgeId> MapCollection::add_odometry_edge(SubmapId a, SubmapId b, const Pose2& step, const Sym3& drift) {
  const OdometryEdgeNoise& noise = config_.odometry;
  const double distance = translation(step);
  const double m = static_cast<double>(noise.base_m) + static_cast<double>(noise.per_m) * distance;
  const double rad = static_cast<double>(noise.base_rad) + static_cast<double>(noise.per_m_rad) * distance;
  Sym3 information;
  if (!invert(diagonal(m * m, m * m, rad * rad) + drift, information)) {
    information = diagonal(1.0 / (m * m), 1.0 / (m * m), 1.0 / (rad * rad));
  }
  return graph_.add_edge(a, b, EdgeKind::odometry, step, information);
}

std::uint64_t* MapCollection::stage_clock() {
  switch (stage_) {
    case Stage::describe:
    case Stage::screen:
    case Stage::recalling:
    case Stage::screening:
      return &statistics_.screening_us;
    case Stage::choose:
    case Stage::registering:
      return &statistics_.registration_us;
    case Stage::marginals:
    case Stage::judge:
    case Stage::optimise:
      return &statistics_.optimisation_us;
    default:
      return &statistics_.store_us;
  }
}

void MapCollection::step() {
  if (stage_ == Stage::idle) {
    return;
  }
  std::uint64_t* const spent = stage_clock();
  const std::uint64_t before = clock_.now_us != nullptr ? clock_.now_us(clock_.context) : 0;
  run_slice();
  const std::uint64_t after = clock_.now_us != nullptr ? clock_.now_us(clock_.context) : 0;
  *spent += after >= before ? after - before : 0;
}

void MapCollection::run_slice() {
  switch (stage_) {
    case Stage::idle:
      break;
    case Stage::restore_submaps:
      restore_submap();
      break;
    case Stage::restore_digest:
      if (digests_->step()) {
        stage_ = Stage::restore_submaps;
      }
      break;
    case Stage::restore_edges:
      restore_edge();
      break;
    case Stage::restore_poses:
      restore_pose();
      break;
    case Stage::describe:
      if (digests_->step()) {
        begin_storing();
      }
      break;
    case Stage::store_submap:
    case Stage::store_digest:
    case Stage::store_node:
    case Stage::store_edge:
    case Stage::commit:
      step_store();
      break;
    case Stage::screen:
      screen_next();
      break;
    case Stage::recalling:
      if (digests_->step()) {
        begin_comparison();
      }
      break;
    case Stage::screening:
      if (digests_->step()) {
        finish_screening();
      }
      break;
    case Stage::choose:
      choose_candidate();
      break;
    case Stage::fetching:
      step_fetch();
      break;
    case Stage::registering:
      if (grids_->step()) {
        finish_registration();
      }
      break;
    case Stage::marginals:
      if (!optimiser_.step()) {
        stage_ = Stage::judge;
      }
      break;
    case Stage::judge:
      judge();
      break;
    case Stage::optimise:
      if (!optimiser_.step()) {
        finish_optimisation();
      }
      break;
    case Stage::flush:
      step_flush();
      break;
  }
}

void MapCollection::begin_screening() {
  other_ = 0;
  registered_ = 0;
  evidence_ = false;
  candidates_.clear();
  stage_ = config_.close_loops ? Stage::screen : Stage::idle;
  if (stage_ == Stage::idle) {
    finish_submap();
  }
}

void MapCollection::screen_next() {
  const SubmapId newest = count_ - 1;
  while (other_ < newest && share_scans(memory_.scans[other_], memory_.scans[newest])) {
    ++other_;
  }
  if (other_ >= newest) {
    (void)grids_->set_query(store_->slots().view(slot_));  // begin() refuses without
    stage_ = Stage::choose;
    return;
  }
  ++statistics_.pairs_possible;
  if (digests_->holds_digests()) {
    begin_comparison();
  } else {
    recall_digest();
  }
}

/// Reads the digest of the other submap back from the store.
void MapCollection::recall_digest() {
  const Result<std::size_t> size = store_->read_blob(kDigestRecord, other_, memory_.record);
  if (size.ok() && digests_->begin_restore(other_, memory_.record.first(size.value())) == Status::ok) {
    stage_ = Stage::recalling;
    return;
  }
  ++statistics_.digests_missed;
  ++other_;
}

void MapCollection::begin_comparison() {
  nearby_ = distance_in_graph(other_) < static_cast<double>(config_.nearby_m);
  if (digests_->begin_compare(other_, count_ - 1, nearby_) == Status::ok) {
    stage_ = Stage::screening;
  } else {
    ++other_;
    stage_ = Stage::screen;
  }
}

void MapCollection::finish_screening() {
  ++statistics_.pairs_screened;
  const SubmapId newest = count_ - 1;
  const PlaceHypotheses& found = digests_->hypotheses();
  PairEvent event;
  event.stage = PairEvent::Stage::screened;
  event.a = other_;
  event.b = newest;
  event.nearby = nearby_;
  if (!found.empty()) {
    event.score = found[0].peak;
    event.agreement = found[0].agreement;
    event.a_T_b = found[0].a_T_b;
  }
  event.reason = screening_verdict();
  event.accepted = event.reason == LinkReason::none;
  report(event);
  if (event.accepted) {
    (void)candidates_.push({other_, rank_of(event.agreement, event.score)});
  }
  ++other_;
  stage_ = Stage::screen;
}

/// Of the comparison that has ended, counted: none, or why the pair is no candidate.
LinkReason MapCollection::screening_verdict() {
  switch (digests_->compare_end()) {
    case CompareEnd::coarse:
      ++statistics_.pairs_dropped_coarse;
      return LinkReason::coarse_mismatch;
    case CompareEnd::rotation:
      ++statistics_.pairs_dropped_rotation;
      return LinkReason::no_rotation;
    case CompareEnd::first_peaks:
      ++statistics_.pairs_cut_short;
      break;
    case CompareEnd::compared:
      break;
  }
  const PlaceHypotheses& found = digests_->hypotheses();
  const bool alike = !found.empty() && found[0].agreement >= config_.candidate_agreement;
  return alike ? LinkReason::none : LinkReason::weak;
}

/// Of the newest submap, m; beyond all where the graph does not join the two.
double MapCollection::distance_in_graph(SubmapId other) const {
  const SubmapId newest = count_ - 1;
  return graph_.component(other) == graph_.component(newest)
             ? translation(between(graph_.pose(other), graph_.pose(newest)))
             : HUGE_VAL;
}

/// Index into the candidates; their number where there is none.
std::size_t MapCollection::best_by_digest() const {
  std::size_t best = candidates_.size();
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (best == candidates_.size() || candidates_[i].score > candidates_[best].score) {
      best = i;
    }
  }
  return best;
}

/// The same, of the candidate that lies nearest to the new submap by the graph; none beyond nearby_m.
std::size_t MapCollection::nearest_in_graph() const {
  std::size_t best = candidates_.size();
  auto least = static_cast<double>(config_.nearby_m);
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const double distance = distance_in_graph(candidates_[i].id);
    if (distance < least) {
      least = distance;
      best = i;
    }
  }
  return best;
}

void MapCollection::choose_candidate() {
  std::size_t best = registered_ < config_.nearby_candidates ? nearest_in_graph() : candidates_.size();
  best = best == candidates_.size() ? best_by_digest() : best;
  if (best == candidates_.size() || registered_ >= config_.candidates) {
    if (evidence_) {
      begin_marginals();
    } else {
      finish_submap();
    }
    return;
  }
  other_ = candidates_[best].id;
  // Neighbours of the chosen one rest on the same scans: they would say the same again.
  for (std::size_t i = candidates_.size(); i-- > 0;) {
    if (share_scans(memory_.scans[candidates_[i].id], memory_.scans[other_])) {
      candidates_.erase(i);
    }
  }
  ++registered_;
  if (store_->is_resident(other_)) {
    begin_registration();
    return;
  }
  const Status status = store_->begin_fetch(other_);
  if (status == Status::ok) {
    stage_ = Stage::fetching;
  } else {
    ++statistics_.fetches_failed;
  }
}

void MapCollection::step_fetch() {
  const Status status = store_->step_fetch();
  if (status == Status::busy) {
    return;
  }
  if (status == Status::ok) {
    begin_registration();
    return;
  }
  log_.write(MELLIN_LOG_WARNING, LogLine() << "submap " << other_ << " cannot be fetched: " << to_string(status));
  ++statistics_.fetches_failed;
  stage_ = Stage::choose;
}

void MapCollection::begin_registration() {
  stage_ = Stage::choose;
  Result<SlotHandle> slot = store_->slot(other_);
  if (!slot.ok()) {
    ++statistics_.fetches_failed;
    return;
  }
  other_slot_ = static_cast<SlotHandle&&>(slot.value());
  if (grids_->begin(store_->slots().view(other_slot_)) == Status::ok) {
    stage_ = Stage::registering;
  } else {
    (void)store_->slots().release(other_slot_);
  }
}

void MapCollection::finish_registration() {
  ++statistics_.pairs_registered;
  (void)store_->slots().release(other_slot_);
  const SubmapId newest = count_ - 1;
  PairEvent event;
  event.stage = PairEvent::Stage::registered;
  event.a = other_;
  event.b = newest;
  event.reason = LinkReason::weak;
  if (grids_->hypotheses().empty()) {
    report(event);
  }
  for (const PlaceHypothesis& place : grids_->hypotheses()) {
    event.score = place.peak;
    event.agreement = place.agreement;
    event.a_T_b = place.a_T_b;
    event.accepted = linker_.worth_keeping(place);
    event.reason = event.accepted ? LinkReason::none : LinkReason::weak;
    report(event);
    if (event.accepted) {
      linker_.add(other_, newest, place);
      evidence_ = true;
    }
  }
  stage_ = Stage::choose;
}

void MapCollection::begin_marginals() {
  OptimiserOptions options;
  options.max_iterations = 0;
  options.marginals = true;
  stage_ = optimiser_.begin(graph_, options) == Status::ok ? Stage::marginals : Stage::idle;
  if (stage_ == Stage::idle) {
    finish_submap();
  }
}

void MapCollection::judge() {
  const auto decided = [](void* context, const PendingLink& link, EdgeId edge) {
    MapCollection& self = *static_cast<MapCollection*>(context);
    PairEvent event;
    event.stage = PairEvent::Stage::decided;
    event.a = link.hypothesis.a;
    event.b = link.hypothesis.b;
    event.score = link.peak;
    event.agreement = link.agreement;
    event.a_T_b = link.hypothesis.measured.a_T_b;
    event.accepted = edge != kNoId;
    event.reason = link.reason;
    self.report(event);
  };
  if (!linker_.deciding()) {
    linker_.begin(graph_, optimiser_, memory_.scans.first(count_), this, decided);
  }
  if (linker_.step()) {
    return;
  }
  statistics_.pairs_accepted += linker_.added();
  if (linker_.added() == 0) {
    finish_submap();
    return;
  }
  OptimiserOptions options;
  options.robust = true;
  options.marginals = true;
  ++statistics_.optimisations;
  stage_ = optimiser_.begin(graph_, options) == Status::ok ? Stage::optimise : Stage::idle;
  if (stage_ == Stage::idle) {
    finish_submap();
  }
}

void MapCollection::finish_optimisation() {
  // What the robust kernel has rejected leaves the graph, in the open.
  bool changed = false;
  for (EdgeId id = 0; id < graph_.edge_count(); ++id) {
    const Edge& edge = graph_.edge(id);
    if (!edge.enabled || edge.kind == EdgeKind::odometry || edge.weight >= 0.5) {
      continue;
    }
    PairEvent event;
    event.stage = PairEvent::Stage::decided;
    event.a = edge.a;
    event.b = edge.b;
    event.a_T_b = edge.a_T_b;
    event.reason = LinkReason::outlier;
    report(event);
    ++statistics_.edges_rejected;
    --statistics_.pairs_accepted;
    (void)graph_.disable_edge(id);
    changed = true;
  }
  if (changed) {
    begin_marginals();  // the factor is of the graph as it was
  } else {
    stage_ = Stage::judge;  // what waited may fit now
  }
}

void MapCollection::finish_submap() {
  (void)store_->slots().release(slot_);
  stage_ = Stage::idle;
}

void MapCollection::report(PairEvent event) const {
  if (observer_.seen != nullptr) {
    event.between_sessions = session_of(event.a) != session_of(event.b);
    observer_.seen(observer_.context, event);
  }
}

}  // namespace mellin
