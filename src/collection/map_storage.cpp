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
  const Status status = store_->begin_group(size);
  if (status == Status::ok && store_->put_submap(memory_.headers[id], slot_) == Status::ok) {
    stage_ = Stage::store_submap;
    return;
  }
  store_failed(status);
}

void MapCollection::store_failed(Status status) {
  ++statistics_.not_stored;
  log_.write(MELLIN_LOG_WARNING, LogLine() << "submap " << count_ - 1 << " is not stored: " << to_string(status));
  store_->abandon_group();
  begin_screening();
}

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
      if (odometry_edge_ != kNoId) {
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
  return memory_.record.first(write_node_record(graph_.pose(id), memory_.record));
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
    log_.write(MELLIN_LOG_WARNING, LogLine() << "poses and edges are not stored: " << to_string(status));
    return;
  }
  record_ = 0;
  loops_flushed_ = 0;
  stage_ = Stage::flush;
  flush_next();
}

void MapCollection::flush_next() {
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
    store_->abandon_group();
    stage_ = Stage::idle;
  }
}

void MapCollection::step_flush() {
  const Status status = store_->step();
  if (status == Status::busy) {
    return;
  }
  if (status != Status::ok) {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "poses and edges are not stored: " << to_string(status));
    store_->abandon_group();
    stage_ = Stage::idle;
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

void MapCollection::restore_submap() {
  if (count_ >= store_->submap_count()) {
    record_ = 0;
    stage_ = Stage::restore_edges;
    return;
  }
  // Ids are given in order and nothing is ever forgotten, so that the i-th stored submap is the i-th node.
  const SubmapId id = store_->submap_id(count_);
  const Result<SubmapHeader> header = store_->header(id);
  Pose2 pose;
  const Result<std::size_t> record = store_->read_blob(kNodeRecord, id, memory_.record);
  const bool whole = id == count_ && count_ < config_.max_submaps && header.ok() && record.ok() &&
                     read_node_record(memory_.record.first(record.value()), pose);
  if (!whole || !graph_.add_node(pose).ok()) {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "the map ends before submap " << id << ", which is damaged");
    record_ = 0;
    stage_ = Stage::restore_edges;
    return;
  }
  memory_.headers[id] = header.value();
  memory_.scans[id] = {session_index(header.value().session), header.value().first_scan, header.value().scan_count};
  ++count_;
  if (!digests_->holds_digests()) {
    return;  // it is read when it is compared
  }
  const Result<std::size_t> digest = store_->read_blob(kDigestRecord, id, memory_.record);
  if (digest.ok() && digests_->begin_restore(id, memory_.record.first(digest.value())) == Status::ok) {
    stage_ = Stage::restore_digest;
  }
}

void MapCollection::restore_edge() {
  if (record_ >= store_->blob_count(kEdgeRecord)) {
    record_ = 0;
    stage_ = Stage::restore_poses;
    return;
  }
  const std::uint32_t id = store_->blob_id(kEdgeRecord, record_++);
  const Result<std::size_t> record = store_->read_blob(kEdgeRecord, id, memory_.record);
  Edge edge;
  if (!record.ok() || !read_edge_record(memory_.record.first(record.value()), edge) || edge.a >= count_ ||
      edge.b >= count_) {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "edge " << id << " is damaged and left out");
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
  Pose2 pose;
  if (record.ok() && read_node_record(memory_.record.first(record.value()), pose)) {
    (void)graph_.set_pose(id, pose);
  }
}

}  // namespace mellin
