// The store's set-up, mounting and reading. Writing: submap_store_write.cpp.
#include "mellin/store/submap_store.hpp"

namespace mellin {

Status SubmapStore::init(const StoreConfig& config, const Memory& memory, const mellin_flash& flash, Log log) {
  const bool sane = config.side >= 2 && config.side % 2 == 0 && config.side <= kMaxStoreSide && config.cell_m > 0.0F &&
                    is_finite(static_cast<double>(config.cell_m)) && config.grid_slots >= 1;
  if (!sane) {
    return Status::invalid_config;
  }
  const std::size_t grid_cells = static_cast<std::size_t>(config.side) * config.side;
  const bool enough = memory.slots.slots.size() >= config.grid_slots &&
                      memory.slots.cells.size() >= grid_cells * config.grid_slots &&
                      memory.index.entries.size() >= std::size_t{config.max_submaps} + config.max_blobs &&
                      memory.log.page.size() >= config.page_bytes && memory.writer.payload.size() >= kMaxPayloadBytes &&
                      memory.writer.tile.size() >= kTileCells && memory.reader.payload.size() >= kMaxPayloadBytes &&
                      memory.reader.tile.size() >= kTileCells;
  if (!enough) {
    return Status::insufficient_memory;
  }
  config_ = config;
  log_sink_ = log;
  flash_blocks_ = flash.block_count;
  slots_ = GridSlots(memory.slots, config.side, config.cell_m);
  index_ = RecordIndex(memory.index);
  writer_ = SubmapWriter(memory.writer);
  reader_ = SubmapReader(memory.reader);
  end_group();
  fetch_slot_ = SlotHandle();
  fetch_id_ = kNoSubmap;
  lost_records_ = 0;
  groups_failed_ = 0;
  if (!has_flash()) {
    log_sink_.write(MELLIN_LOG_INFO, LogLine() << "store: no flash, submaps are kept only in their slots");
    return Status::ok;
  }
  return log_.init(memory.log, flash, {config.fingerprint, config.side, config.cell_m}, log);
}

// Mounting.

Status SubmapStore::format() {
  if (group_open_) {
    return Status::busy;
  }
  index_.clear();
  slots_.forget_all();
  group_ = 0;
  previous_group_ = 0;
  lost_records_ = 0;
  return has_flash() ? log_.format() : Status::ok;
}

Status SubmapStore::mount() {
  if (group_open_) {
    return Status::busy;
  }
  index_.clear();
  slots_.forget_all();
  group_ = 0;
  previous_group_ = 0;
  lost_records_ = 0;
  if (!has_flash()) {
    return Status::ok;
  }
  Status status = log_.mount();
  if (status == Status::ok) {
    status = replay();
  }
  if (status != Status::ok) {
    index_.clear();
    log_.unmount();
    return status;
  }
  const auto submaps = static_cast<std::uint32_t>(submap_count());
  log_sink_.write(MELLIN_LOG_INFO, LogLine() << "store: mounted, " << submaps << " submaps, "
                                             << static_cast<std::uint32_t>(index_.size()) - submaps << " blobs, "
                                             << lost_records_ << " records lost");
  return Status::ok;
}

/// Walks the log and applies each group when its commit record is met.
Status SubmapStore::replay() {
  LogCursor cursor = log_.begin();
  LogCursor from = cursor;
  std::uint32_t open_group = 0;
  LogRecord record;
  Status status = log_.next(cursor, record);
  for (; status == Status::ok; status = log_.next(cursor, record)) {
    const std::uint32_t group = record.header.group;
    if (group <= previous_group_) {
      continue;  // group numbers only count up
    }
    if (group != open_group) {
      open_group = group;
      from = cursor;
      from.offset -= record.bytes();
    }
    group_ = group > group_ ? group : group_;
    if (record.header.type == RecordType::commit) {
      const Status applied = apply_group(from, record);
      if (applied != Status::ok && applied != Status::lost) {
        return applied;
      }
    }
  }
  return status == Status::not_found ? Status::ok : status;
}

/// Takes the group's records into the index. Statuses: ok; lost where some are missing: the rest is taken; full;
/// device_error.
Status SubmapStore::apply_group(LogCursor from, const LogRecord& commit_record) {
  std::uint8_t payload[kCommitPayloadBytes];
  Commit commit;
  Status status = log_.read_payload(commit_record, payload);
  if (status == Status::device_error) {
    return status;
  }
  if (status != Status::ok || commit_record.header.length != sizeof payload ||
      decode_commit(payload, commit) != Status::ok) {
    return Status::lost;  // torn; were it damaged, the next commit will tell
  }
  if (previous_group_ != 0 && commit.previous_group != previous_group_) {
    ++lost_records_;
    log_sink_.write(MELLIN_LOG_WARNING, LogLine()
                                            << "store: the commit of group " << commit.previous_group << " is missing");
  }
  previous_group_ = commit_record.header.group;
  std::uint32_t records = 0;
  LogRecord record;
  for (status = log_.next(from, record); status == Status::ok && record.address != commit_record.address;
       status = log_.next(from, record)) {
    if (record.header.group != commit_record.header.group) {
      continue;
    }
    ++records;
    const Status applied = apply_record(record);
    if (applied != Status::ok) {
      return applied;
    }
  }
  if (status != Status::ok) {
    return status == Status::not_found ? Status::lost : status;
  }
  if (records != commit.records) {
    lost_records_ += commit.records > records ? commit.records - records : 1;
    log_sink_.write(MELLIN_LOG_WARNING, LogLine() << "store: group " << commit_record.header.group << " has " << records
                                                  << " records of " << commit.records);
    return Status::lost;
  }
  return Status::ok;
}

Status SubmapStore::apply_record(const LogRecord& record) {
  const RecordHeader& header = record.header;
  switch (header.type) {
    case RecordType::submap:
      if (!index_.contains(0, header.id) && submap_count() >= config_.max_submaps) {
        return Status::full;
      }
      slots_.forget(header.id);
      return index_.put(0, header.id, record.address, record.bytes());
    case RecordType::blob:
      if (header.part != 0) {
        index_.grow(header.kind, header.id, record.bytes());
        return Status::ok;
      }
      if (!index_.contains(header.kind, header.id) && index_.size() - submap_count() >= config_.max_blobs) {
        return Status::full;
      }
      return index_.put(header.kind, header.id, record.address, record.bytes());
    case RecordType::grid:
    case RecordType::submap_end:
      index_.grow(0, header.id, record.bytes());
      return Status::ok;
    case RecordType::remove:
      index_.remove(header.kind, header.id);
      if (header.kind == 0) {
        slots_.forget(header.id);
      }
      return Status::ok;
    case RecordType::commit:
      break;
  }
  return Status::ok;
}

// Reading.

Status SubmapStore::begin_fetch(SubmapId id) {
  if (fetch_id_ != kNoSubmap) {
    return Status::busy;
  }
  if (slots_.is_resident(id)) {
    fetch_id_ = id;
    return Status::ok;
  }
  const IndexEntry* const entry = index_.find(0, id);
  if (entry == nullptr) {
    return Status::not_found;
  }
  Result<SlotHandle> slot = slots_.acquire_free();
  if (!slot.ok()) {
    return slot.status();
  }
  fetch_slot_ = std::move(slot.value());
  fetch_id_ = id;
  fetch_address_ = entry->address;
  reader_.begin(entry->address, id, config_.side, slots_.cells(fetch_slot_));
  return Status::ok;
}

Status SubmapStore::step_fetch() {
  if (fetch_id_ == kNoSubmap) {
    return Status::not_found;
  }
  if (fetch_slot_.empty()) {
    const bool resident = slots_.is_resident(fetch_id_);
    fetch_id_ = kNoSubmap;
    return resident ? Status::ok : Status::not_found;
  }
  Status status = reader_.step(log_);
  if (status == Status::busy) {
    return status;
  }
  if (status == Status::ok) {
    // A group committed meanwhile may have replaced or removed the submap.
    const IndexEntry* const entry = index_.find(0, fetch_id_);
    const bool current = entry != nullptr && entry->address == fetch_address_;
    status = current ? slots_.assign(fetch_slot_, fetch_id_) : Status::not_found;
  }
  lost_records_ += status == Status::lost ? 1U : 0U;
  const Status released = slots_.release(fetch_slot_);
  fetch_id_ = kNoSubmap;
  return status == Status::ok ? released : status;
}

Result<SubmapHeader> SubmapStore::header(SubmapId id) const {
  const IndexEntry* const entry = index_.find(0, id);
  if (entry == nullptr) {
    return Status::not_found;
  }
  LogRecord record;
  Status status = log_.record_at(entry->address, record);
  if (status != Status::ok) {
    return status;
  }
  std::uint8_t payload[kSubmapPayloadBytes];
  SubmapHeader header;
  if (record.header.type != RecordType::submap || record.header.length != sizeof payload) {
    return Status::lost;
  }
  status = log_.read_payload(record, payload);
  if (status != Status::ok) {
    return status;
  }
  if (decode_submap(payload, header) != Status::ok || header.id != id) {
    return Status::lost;
  }
  return header;
}

Result<std::uint32_t> SubmapStore::grid_crc32(SubmapId id) const {
  const IndexEntry* const entry = index_.find(0, id);
  if (entry == nullptr) {
    return Status::not_found;
  }
  LogRecord first;
  LogCursor cursor;
  Status status = log_.record_at(entry->address, first);
  if (status == Status::ok) {
    status = log_.seek(entry->address, cursor);
  }
  if (status != Status::ok) {
    return status;
  }
  cursor.offset += first.bytes();
  LogRecord record;
  do {
    status = log_.next(cursor, record);
    if (status != Status::ok) {
      return status == Status::not_found ? Status::lost : status;
    }
    if (record.header.group != first.header.group || record.header.id != id) {
      return Status::lost;
    }
  } while (record.header.type == RecordType::grid);
  std::uint8_t payload[kSubmapEndPayloadBytes];
  if (record.header.type != RecordType::submap_end || record.header.length != sizeof payload) {
    return Status::lost;
  }
  status = log_.read_payload(record, payload);
  if (status != Status::ok) {
    return status;
  }
  return decode_u32(Span<const std::uint8_t>(payload, sizeof payload));
}

Result<std::size_t> SubmapStore::read_blob(BlobKind kind, std::uint32_t id, Span<std::uint8_t> out) const {
  const IndexEntry* const entry = kind == 0 ? nullptr : index_.find(kind, id);
  if (entry == nullptr) {
    return Status::not_found;
  }
  LogCursor cursor;
  Status status = log_.seek(entry->address, cursor);
  std::size_t length = 0;
  std::uint32_t group = 0;
  LogRecord record;
  for (std::uint32_t part = 0; status == Status::ok; ++part) {
    status = log_.next(cursor, record);
    if (status != Status::ok) {
      break;
    }
    const RecordHeader& header = record.header;
    group = part == 0 ? header.group : group;
    if (header.type != RecordType::blob || header.kind != kind || header.id != id || header.part != part ||
        header.group != group || (part == 0 && record.address != entry->address)) {
      return Status::lost;
    }
    status = log_.read_payload(record, out.subspan(length, out.size() - length));
    length += header.length;
    if (status == Status::ok && header.parts == 1) {
      return length;
    }
  }
  return status == Status::not_found ? Status::lost : status;
}

Status SubmapStore::read_blobs(BlobKind kind, Span<std::uint8_t> buffer, void* context, BlobVisitor visitor) {
  Status worst = Status::ok;
  for (std::size_t i = 0; i < blob_count(kind); ++i) {
    const std::uint32_t id = blob_id(kind, i);
    const Result<std::size_t> length = read_blob(kind, id, buffer);
    if (length.ok()) {
      visitor(context, id, buffer.first(length.value()));
    } else if (length.status() == Status::lost) {
      ++lost_records_;
      worst = Status::lost;
    } else {
      return length.status();
    }
  }
  return worst;
}

std::uint32_t SubmapStore::stored_bytes(SubmapId id) const {
  const IndexEntry* const entry = index_.find(0, id);
  return entry == nullptr ? 0 : entry->bytes();
}

StoreStatistics SubmapStore::statistics() const {
  StoreStatistics statistics;
  statistics.submaps = static_cast<std::uint32_t>(submap_count());
  statistics.blobs = static_cast<std::uint32_t>(index_.size()) - statistics.submaps;
  statistics.logical_bytes = index_.bytes();
  statistics.lost_records = lost_records_;
  statistics.groups_failed = groups_failed_;
  if (has_flash()) {
    const FlashLogStatistics log = log_.statistics();
    statistics.programmed_bytes = log.programmed_bytes;
    statistics.erases = log.erases;
    statistics.max_block_erases = log.max_block_erases;
    statistics.damaged_blocks = log.damaged_blocks;
    statistics.flash_failures = log.failures;
    statistics.free_bytes = std::uint64_t{log.free_blocks} * log_.block_room() + log_.room();
  }
  return statistics;
}

}  // namespace mellin
