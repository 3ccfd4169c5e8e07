// The store's writing: groups, and the jobs that step() takes forward.
#include <cstring>

#include "mellin/store/submap_store.hpp"

namespace mellin {
namespace {

/// A chunk of a blob is not begun with less room than this, unless it is the last one.
constexpr std::size_t kLeastChunk = 64;

std::uint32_t divided_up(std::uint64_t a, std::uint64_t b) { return static_cast<std::uint32_t>((a + b - 1) / b); }

/// The most blocks that the blobs can take: each block may lose the room that is too little for a chunk.
std::uint32_t worst_case_blob_blocks(const GroupSize& size, std::uint32_t block_room) {
  const std::uint32_t chunks = block_room / static_cast<std::uint32_t>(kMaxRecordBytes) + 1;
  const auto header = static_cast<std::uint32_t>(kRecordHeaderBytes);
  const std::uint32_t usable = block_room - chunks * header - header - static_cast<std::uint32_t>(kLeastChunk);
  return divided_up(std::uint64_t{size.blob_bytes} + std::uint64_t{size.blobs} * header, usable);
}

}  // namespace

Status SubmapStore::begin_group(const GroupSize& size) {
  if (group_open_) {
    return Status::busy;
  }
  if (!mounted()) {
    return Status::not_found;
  }
  if (has_flash() && (!fits(size) || group_ + 1 >= kNumberLimit)) {
    return Status::full;
  }
  group_open_ = true;
  ++group_;
  group_begin_ = log_.head();
  records_before_ = log_.appended_records();
  bytes_before_ = log_.appended_bytes();
  return Status::ok;
}

bool SubmapStore::fits(const GroupSize& size) const {
  const std::uint32_t room = log_.block_room();
  const std::uint64_t submaps = std::uint64_t{size.submaps} * SubmapWriter::worst_case_blocks(config_.side, room);
  const std::uint32_t blobs = worst_case_blob_blocks(size, room);
  return submaps + blobs + 1 <= log_.free_blocks();  // 1: the commit
}

Status SubmapStore::ready_to_put() const {
  if (!group_open_) {
    return Status::invalid_argument;
  }
  return job_ == Job::none ? Status::ok : Status::busy;
}

/// Counts an item that is new against its limit. Statuses: ok; full.
Status SubmapStore::reserve(std::uint8_t kind, std::uint32_t id) {
  if (!has_flash() || index_.contains(kind, id)) {
    return Status::ok;
  }
  const std::size_t submaps = submap_count();
  const std::size_t there = kind == 0 ? submaps : index_.size() - submaps;
  std::uint32_t& added = kind == 0 ? new_submaps_ : new_blobs_;
  if (there + added >= (kind == 0 ? config_.max_submaps : config_.max_blobs)) {
    return Status::full;
  }
  ++added;
  return Status::ok;
}

Status SubmapStore::check_put(const SubmapHeader& header, const GridView& grid) const {
  const std::size_t cells = static_cast<std::size_t>(config_.side) * config_.side;
  const bool sane = header.id != kNoSubmap && is_finite(header.session_T_submap) && is_finite(header.submap_T_robot) &&
                    grid.side == config_.side && grid.cells.size() == cells;
  return sane ? ready_to_put() : Status::invalid_argument;
}

Status SubmapStore::put_submap(const SubmapHeader& header, const SlotHandle& slot) {
  const Status checked = check_put(header, slots_.view(slot));
  if (checked != Status::ok) {
    return checked;
  }
  Result<SlotHandle> pin = slots_.pin_again(slot);
  if (!pin.ok()) {
    return pin.status();
  }
  const Status started = put_submap(header, slots_.view(slot));
  if (started != Status::ok) {
    const Status released = slots_.release(pin.value());
    return released == Status::ok ? started : released;
  }
  writing_slot_ = std::move(pin.value());
  writing_id_ = header.id;
  return Status::ok;
}

Status SubmapStore::put_submap(const SubmapHeader& header, const GridView& grid) {
  Status status = check_put(header, grid);
  if (status == Status::ok) {
    status = reserve(0, header.id);
  }
  if (status != Status::ok) {
    return status;
  }
  publish_slot();  // of a submap put before in this group
  writer_.begin(group_, header, grid);
  job_ = Job::submap;
  return Status::ok;
}

Status SubmapStore::put_blob(BlobKind kind, std::uint32_t id, Span<const std::uint8_t> bytes) {
  if (kind == 0) {
    return Status::invalid_argument;
  }
  Status status = ready_to_put();
  if (status == Status::ok) {
    status = reserve(kind, id);
  }
  if (status != Status::ok) {
    return status;
  }
  blob_kind_ = kind;
  blob_id_ = id;
  blob_ = bytes;
  blob_position_ = 0;
  blob_part_ = 0;
  job_ = Job::blob;
  return Status::ok;
}

Status SubmapStore::remove_submap(SubmapId id) {
  if (!has_flash() && slots_.is_resident(id)) {
    slots_.forget(id);
    return ready_to_put();
  }
  return start_remove(0, id);
}

Status SubmapStore::remove_blob(BlobKind kind, std::uint32_t id) {
  return kind == 0 ? Status::invalid_argument : start_remove(kind, id);
}

Status SubmapStore::start_remove(std::uint8_t kind, std::uint32_t id) {
  const Status ready = ready_to_put();
  if (ready != Status::ok) {
    return ready;
  }
  if (!index_.contains(kind, id)) {
    return Status::not_found;
  }
  blob_kind_ = kind;
  blob_id_ = id;
  job_ = Job::remove;
  return Status::ok;
}

Status SubmapStore::commit() {
  const Status ready = ready_to_put();
  if (ready != Status::ok) {
    return ready;
  }
  job_ = Job::commit;
  commit_stage_ = CommitStage::flush;
  return Status::ok;
}

void SubmapStore::abandon_group() {
  if (!writing_slot_.empty()) {
    static_cast<void>(slots_.release(writing_slot_));
  }
  end_group();
}

void SubmapStore::end_group() {
  group_open_ = false;
  job_ = Job::none;
  new_submaps_ = 0;
  new_blobs_ = 0;
  writing_slot_ = SlotHandle();
  writing_id_ = kNoSubmap;
}

/// Lets the written submap be found in the slot that it was rendered into.
void SubmapStore::publish_slot() {
  if (!writing_slot_.empty()) {
    static_cast<void>(slots_.assign(writing_slot_, writing_id_));
    static_cast<void>(slots_.release(writing_slot_));
  }
}

Status SubmapStore::step() {
  if (job_ == Job::none) {
    return Status::ok;
  }
  const bool committing = job_ == Job::commit;
  const Status status = step_job();
  if (status == Status::busy) {
    return status;
  }
  job_ = Job::none;
  if (status != Status::ok) {
    ++groups_failed_;
    abandon_group();
  } else if (committing) {
    publish_slot();
    end_group();
  }
  return status;
}

Status SubmapStore::step_job() {
  if (!has_flash()) {
    return Status::ok;
  }
  switch (job_) {
    case Job::submap:
      return writer_.step(log_);
    case Job::blob:
      return step_blob();
    case Job::remove:
      return step_remove();
    case Job::commit:
      return step_commit();
    case Job::none:
      break;
  }
  return Status::ok;
}

/// Statuses: ok: there is room; busy: opened a block; full; device_error.
Status SubmapStore::make_room(std::size_t bytes) {
  if (log_.room() >= bytes) {
    return Status::ok;
  }
  const Status status = log_.open_block();
  return status == Status::ok ? Status::busy : status;
}

RecordHeader SubmapStore::record(RecordType type, std::uint8_t kind, std::uint32_t id) const {
  RecordHeader header;
  header.type = type;
  header.kind = kind;
  header.group = group_;
  header.id = id;
  return header;
}

Status SubmapStore::step_blob() {
  const std::size_t left = blob_.size() - blob_position_;
  const Status status = make_room(kRecordHeaderBytes + (left < kLeastChunk ? left : kLeastChunk));
  if (status != Status::ok) {
    return status;
  }
  const std::size_t room = log_.room() - kRecordHeaderBytes;
  const std::size_t most = room < kMaxPayloadBytes ? room : kMaxPayloadBytes;
  const std::size_t size = left < most ? left : most;
  RecordHeader header = record(RecordType::blob, blob_kind_, blob_id_);
  header.part = blob_part_++;
  header.parts = size == left ? 1 : 0;
  const Status appended = log_.append(header, blob_.subspan(blob_position_, size));
  blob_position_ += size;
  return appended == Status::ok && size != left ? Status::busy : appended;
}

Status SubmapStore::step_remove() {
  const Status status = make_room(kRecordHeaderBytes);
  return status == Status::ok ? log_.append(record(RecordType::remove, blob_kind_, blob_id_), {}) : status;
}

/// What the group holds has to be safe before its commit record is programmed, and that before it is reported.
Status SubmapStore::step_commit() {
  Status status = Status::ok;
  switch (commit_stage_) {
    case CommitStage::flush:
      if (log_.appended_records() == records_before_) {
        return Status::ok;  // an empty group
      }
      status = log_.flush();
      commit_stage_ = CommitStage::write;
      return status == Status::ok ? Status::busy : status;
    case CommitStage::write:
      return write_commit();
    case CommitStage::sync:
      status = log_.flush();
      return status == Status::ok ? finish_commit() : status;
  }
  return status;
}

Status SubmapStore::write_commit() {
  const Status room = make_room(kRecordHeaderBytes + kCommitPayloadBytes);
  if (room != Status::ok) {
    return room;
  }
  Commit commit;
  commit.records = log_.appended_records() - records_before_;
  commit.bytes = log_.appended_bytes() - bytes_before_;
  commit.previous_group = previous_group_;
  std::uint8_t payload[kCommitPayloadBytes];
  encode_commit(commit, payload);
  commit_record_ = {record(RecordType::commit, 0, writing_id_), log_.address(log_.head())};
  const Status status = log_.append(commit_record_.header, Span<const std::uint8_t>(payload, sizeof payload));
  commit_stage_ = CommitStage::sync;
  return status == Status::ok ? Status::busy : status;
}

/// The index is only ever built from what lies on flash: read the group back as mounting would.
Status SubmapStore::finish_commit() {
  const Status status = log_.record_at(commit_record_.address, commit_record_);
  return status == Status::ok ? apply_group(group_begin_, commit_record_) : status;
}

}  // namespace mellin
