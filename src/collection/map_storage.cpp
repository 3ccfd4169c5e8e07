// What the map collection keeps in the store and how it comes back.
#include "mellin/collection/map_collection.hpp"
#include "mellin/collection/persistence.hpp"

namespace mellin {

void MapCollection::begin_storing() {
  GroupSize size;
  size.submaps = 1;
  size.blobs = odometry_edge_ == kNoId ? 2 : 3;
  size.blob_bytes = static_cast<std::uint32_t>(config_.digest_bytes + kNodeRecordBytes +
                                               (odometry_edge_ == kNoId ? 0 : kEdgeRecordBytes));
  const SubmapId id = count_ - 1;
  Status status = store_->begin_group(size);
  if (status == Status::ok) {
    status = store_->put_submap(memory_.headers[id], slot_);
  }
  if (status == Status::ok) {
    stage_ = Stage::store_submap;
  } else {
    store_failed(status);
  }
}

void MapCollection::store_failed(Status status) {
  ++statistics_.not_stored;
  statistics_.last_store_failure = status;
  log_.write(MELLIN_LOG_WARNING, LogLine() << "submap " << count_ - 1 << " is not stored: " << to_string(status));
  store_->abandon_group();
  begin_screening();
}

void MapCollection::flush_failed(Status status) {
  ++statistics_.flushes_failed;
  statistics_.last_store_failure = status;
  log_.write(MELLIN_LOG_WARNING, LogLine() << "poses and edges are not stored: " << to_string(status));
  store_->abandon_group();
  stage_ = Stage::idle;
}

/// Records name stored submaps only: the id of one that was not stored may be another's after the next start.
bool MapCollection::keeps(const Edge& edge) const { return store_->contains(edge.a) && store_->contains(edge.b); }

void MapCollection::step_store() {
  const Status status = store_->step();
  if (status == Status::busy) {
    return;
  }
  if (status != Status::ok) {
    store_failed(status);
    return;
  }
  const SubmapId id = count_ - 1;
  Status next = Status::ok;
  switch (stage_) {
    case Stage::store_submap:
      stage_ = Stage::store_digest;
      next = store_->put_blob(kDigestRecord, id, digests_->digest_bytes(id));
      break;
    case Stage::store_digest:
      stage_ = Stage::store_node;
      next = store_->put_blob(kNodeRecord, id, node_record(id));
      break;
    case Stage::store_node:
      if (odometry_edge_ != kNoId && (!store_->keeps_data() || store_->contains(graph_.edge(odometry_edge_).a))) {
        stage_ = Stage::store_edge;
        next = store_->put_blob(kEdgeRecord, id, edge_record(odometry_edge_));
        break;
      }
      stage_ = Stage::commit;
      next = store_->commit();
      break;
    case Stage::store_edge:
      stage_ = Stage::commit;
      next = store_->commit();
      break;
    default:
      ++statistics_.stored;
      begin_screening();
      break;
  }
  if (next != Status::ok) {
    store_failed(next);
  }
}

Span<const std::uint8_t> MapCollection::node_record(SubmapId id) {
  return memory_.record.first(write_node_record({graph_.pose(id), memory_.scans[id].stretch}, memory_.record));
}

Span<const std::uint8_t> MapCollection::edge_record(EdgeId id) {
  return memory_.record.first(write_edge_record(graph_.edge(id), memory_.record));
}

void MapCollection::begin_flush() {
  if (stage_ != Stage::idle || !store_->keeps_data() || count_ == 0) {
    return;
  }
  GroupSize size;
  size.blobs = count_ + graph_.edge_count();
  size.blob_bytes = static_cast<std::uint32_t>(count_ * kNodeRecordBytes + graph_.edge_count() * kEdgeRecordBytes);
  const Status status = store_->begin_group(size);
  if (status != Status::ok) {
    flush_failed(status);
    return;
  }
  record_ = 0;
  loops_flushed_ = 0;
  stage_ = Stage::flush;
  flush_next();
}

void MapCollection::flush_next() {
  while (record_ < count_ && !store_->contains(record_)) {
    ++record_;
  }
  while (record_ >= count_ && record_ < count_ + graph_.edge_count() && !keeps(graph_.edge(record_ - count_))) {
    ++record_;
  }
  Status status = Status::ok;
  if (record_ < count_) {
    status = store_->put_blob(kNodeRecord, record_, node_record(record_));
  } else if (record_ < count_ + graph_.edge_count()) {
    const EdgeId edge = record_ - count_;
    const bool odometry = graph_.edge(edge).kind == EdgeKind::odometry;
    const std::uint32_t id = odometry ? graph_.edge(edge).b : kFirstLoopRecord + loops_flushed_++;
    status = store_->put_blob(kEdgeRecord, id, edge_record(edge));
  } else {
    status = store_->commit();
  }
  ++record_;
  if (status != Status::ok) {
    flush_failed(status);
  }
}

void MapCollection::step_flush() {
  const Status status = store_->step();
  if (status == Status::busy) {
    return;
  }
  if (status != Status::ok) {
    flush_failed(status);
    return;
  }
  if (record_ > count_ + graph_.edge_count()) {
    stage_ = Stage::idle;
    return;
  }
  flush_next();
}

std::uint16_t MapCollection::session_index(const SessionId& id) {
  for (std::uint16_t i = 0; i < session_count_; ++i) {
    if (memory_.sessions[i] == id) {
      return i;
    }
  }
  if (session_count_ >= memory_.sessions.size()) {
    return static_cast<std::uint16_t>(session_count_ - 1);
  }
  memory_.sessions[session_count_] = id;
  return session_count_++;
}

void MapCollection::restore_failed(Status status) {
  restored_ = status;
  log_.write(MELLIN_LOG_WARNING, LogLine() << "the store cannot be restored: " << to_string(status));
  stage_ = Stage::idle;
}

void MapCollection::restore_submap() {
  // Ids are given in order and nothing is ever forgotten: the submap of an id is the node of that number.
  const std::size_t stored = store_->submap_count();
  if (count_ >= config_.max_submaps || count_ > store_->submap_id(stored - 1)) {
    record_ = 0;
    stage_ = Stage::restore_edges;
    return;
  }
  const SubmapId id = count_;
  const Result<SubmapHeader> header = store_->header(id);
  NodeRecord node_record;
  const Result<std::size_t> record = store_->read_blob(kNodeRecord, id, memory_.record);
  if (header.status() == Status::device_error || record.status() == Status::device_error) {
    restore_failed(Status::device_error);
    return;
  }
  const bool whole = header.ok() && record.ok() && read_node_record(memory_.record.first(record.value()), node_record);
  if (!whole) {
    restore_gap();
    return;
  }
  const Result<NodeId> node = graph_.add_node(node_record.map_T_submap);
  if (!node.ok()) {
    restore_failed(node.status());
    return;
  }
  memory_.headers[id] = header.value();
  memory_.scans[id] = {session_index(header.value().session), node_record.stretch, header.value().first_scan,
                       header.value().scan_count};
  ++count_;
  if (!digests_->holds_digests()) {
    return;  // it is read when it is compared
  }
  const Result<std::size_t> digest = store_->read_blob(kDigestRecord, id, memory_.record);
  if (digest.status() == Status::device_error) {
    restore_failed(Status::device_error);
  } else if (digest.ok() && digests_->begin_restore(id, memory_.record.first(digest.value())) == Status::ok) {
    stage_ = Stage::restore_digest;
  } else {
    ++statistics_.records_damaged;
  }
}

/// The next id has no submap: the store refused it, or it is damaged. Its node stays empty, without digest, grid, scans
/// and, mostly, edges, so that the ones behind it keep their ids.
void MapCollection::restore_gap() {
  const SubmapId id = count_;
  log_.write(MELLIN_LOG_WARNING, LogLine() << "submap " << id << " is missing from the store");
  SubmapHeader header = id > 0 ? memory_.headers[id - 1] : SubmapHeader{};
  header.id = id;
  header.scan_count = 0;
  const Result<NodeId> node = graph_.add_node(id > 0 ? graph_.pose(id - 1) : Pose2{});
  if (!node.ok()) {
    restore_failed(node.status());
    return;
  }
  memory_.headers[id] = header;
  memory_.scans[id] = id > 0 ? memory_.scans[id - 1] : NodeScans{};
  memory_.scans[id].count = 0;
  ++count_;
  ++statistics_.submaps_missing;
}

/// Links the submaps of a stretch across what is missing between them: a submap, or an edge whose older end was not
/// known to be stored. At most one visit of all edges for each submap, and mostly one visit in all.
void MapCollection::bridge_gaps() {
  std::uint32_t odometry_edges = 0;
  for (EdgeId edge = 0; edge < graph_.edge_count(); ++edge) {
    odometry_edges += graph_.edge(edge).kind == EdgeKind::odometry ? 1U : 0U;
  }
  if (odometry_edges + session_count_ >= count_) {
    return;
  }
  SubmapId last = kNoSubmap;
  bool whole = true;
  for (SubmapId id = 0; id < count_; ++id) {
    whole = whole && has_odometry_edge(id);
    if (memory_.scans[id].count == 0) {
      continue;
    }
    if (!whole && last != kNoSubmap && same_stretch(last, id)) {
      (void)add_odometry_edge(last, id, session_step(last, id), {});
    }
    last = id;
    whole = true;
  }
}

bool MapCollection::has_odometry_edge(SubmapId newer) const {
  for (EdgeId edge = 0; edge < graph_.edge_count(); ++edge) {
    if (graph_.edge(edge).kind == EdgeKind::odometry && graph_.edge(edge).b == newer) {
      return true;
    }
  }
  return false;
}

void MapCollection::restore_edge() {
  if (record_ >= store_->blob_count(kEdgeRecord)) {
    bridge_gaps();
    record_ = 0;
    stage_ = Stage::restore_poses;
    return;
  }
  const std::uint32_t id = store_->blob_id(kEdgeRecord, record_++);
  const Result<std::size_t> record = store_->read_blob(kEdgeRecord, id, memory_.record);
  if (record.status() == Status::device_error) {
    restore_failed(Status::device_error);
    return;
  }
  Edge edge;
  if (!record.ok() || !read_edge_record(memory_.record.first(record.value()), edge) || edge.a >= count_ ||
      edge.b >= count_) {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "edge " << id << " is damaged and left out");
    ++statistics_.records_damaged;
    return;
  }
  const Result<EdgeId> added = graph_.add_edge(edge.a, edge.b, edge.kind, edge.a_T_b, edge.information);
  if (added.ok() && !edge.enabled) {
    (void)graph_.disable_edge(added.value());
  }
}

void MapCollection::restore_pose() {
  if (record_ >= count_) {
    stage_ = Stage::idle;
    return;
  }
  // Edges that linked components have moved nodes; the stored poses are the optimised ones.
  const SubmapId id = record_++;
  const Result<std::size_t> record = store_->read_blob(kNodeRecord, id, memory_.record);
  NodeRecord node;
  if (record.status() == Status::device_error) {
    restore_failed(Status::device_error);
  } else if (record.ok() && read_node_record(memory_.record.first(record.value()), node)) {
    (void)graph_.set_pose(id, node.map_T_submap);
  }
}

}  // namespace mellin
