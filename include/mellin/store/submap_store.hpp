// The submap store (paper, Section III-D): submaps on flash, a few full grids in RAM, fetched on demand, and small
// blobs (digests, graph nodes, edges, sessions) beside them. Everything is written in groups that a power cut leaves
// either whole or absent; everything read is checked. The bytes on flash: flash_format.hpp.
//
// Writing: begin_group(), any of put_submap / put_blob / remove_*, each followed by step() until it no longer says
// busy, then commit() and step() until ok: from then on the group survives a power cut. One group at a time.
// Fetching: begin_fetch(id), step_fetch() until it no longer says busy; independent of a group being written.
//
// Without flash (block_count 0) groups are accepted and their blobs dropped, and submaps live as long as their slot:
// begin_fetch says not_found for one that was evicted, and keeps_data() is false.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/log.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/submap.hpp"
#include "mellin/port.h"
#include "mellin/store/flash_log.hpp"
#include "mellin/store/grid_slots.hpp"
#include "mellin/store/record_index.hpp"
#include "mellin/store/submap_stream.hpp"

namespace mellin {

struct StoreConfig {
  std::uint16_t side = 0;          ///< cells along a grid; even, at most kMaxStoreSide. A slot takes side * side bytes
  float cell_m = 0.0F;             ///< edge of a cell
  std::uint32_t max_submaps = 0;   ///< 12 bytes of RAM each
  std::uint32_t max_blobs = 0;     ///< 12 bytes of RAM each
  std::uint16_t grid_slots = 0;    ///< at least 1
  std::uint16_t page_bytes = 256;  ///< written at once where possible; a power of two, a multiple of the program unit
  std::uint64_t fingerprint = 0;   ///< of the configuration that stored grids and blobs depend on
};

/// A worst-case grid of this side still fits in the 16 MiB that an index entry can count.
inline constexpr std::uint16_t kMaxStoreSide = 2048;

/// Kinds of blobs are the caller's, from 1 to 255. Kind 0 means submaps.
using BlobKind = std::uint8_t;

/// What a group will hold at most, so that begin_group can say `full` before anything is written.
struct GroupSize {
  std::uint32_t submaps = 0;
  std::uint32_t blobs = 0;       ///< and removals
  std::uint32_t blob_bytes = 0;  ///< in total
};

struct StoreStatistics {
  std::uint32_t submaps = 0;
  std::uint32_t blobs = 0;
  std::uint64_t logical_bytes = 0;     ///< of the live submaps' and blobs' records
  std::uint64_t programmed_bytes = 0;  ///< since init, fill of program units included
  std::uint64_t erases = 0;            ///< over the device's life
  std::uint32_t max_block_erases = 0;  ///< the same, of the most erased block
  std::uint64_t free_bytes = 0;        ///< in blocks that can still be opened
  std::uint32_t lost_records = 0;      ///< found missing or damaged since mount
  std::uint32_t damaged_blocks = 0;
  std::uint32_t groups_failed = 0;  ///< given up in step(), since init
  FlashFailures flash_failures;     ///< calls that the device refused, since init
};

class SubmapStore {
 public:
  struct Memory {
    GridSlots::Memory slots;
    RecordIndex::Memory index;
    FlashLog::Memory log;
    SubmapWriter::Memory writer;
    SubmapReader::Memory reader;
  };
  template <class A>
  static constexpr Memory carve(A& arena, const StoreConfig& config) {
    Memory memory;
    memory.slots = GridSlots::carve(arena, config.side, config.grid_slots);
    memory.index = RecordIndex::carve(arena, std::size_t{config.max_submaps} + config.max_blobs);
    memory.log = FlashLog::carve(arena, config.page_bytes);
    memory.writer = SubmapWriter::carve(arena);
    memory.reader = SubmapReader::carve(arena);
    return memory;
  }

  SubmapStore() = default;
  SubmapStore(const SubmapStore&) = delete;
  SubmapStore& operator=(const SubmapStore&) = delete;

  /// Touches no flash yet. Statuses: ok; invalid_config where config or the flash's geometry contradict themselves;
  /// insufficient_memory where a span is shorter than carve() makes it.
  Status init(const StoreConfig& config, const Memory& memory, const mellin_flash& flash, Log log);

  /// Starts an empty store, as one step that a power cut leaves done or not done; what was there is given up. One
  /// erase, one program. Statuses: ok; busy while a group is open; device_error.
  Status format();
  /// Finds what the flash holds: reads each block's record headers once or twice. Statuses: ok; not_found on a blank
  /// device, or one whose first format() a power cut tore: format() it; bad_data where the device holds something else;
  /// version_mismatch where it was written by another format version or configuration (logged with both); full where it
  /// holds more than max_submaps or max_blobs; busy while a group is open; device_error. Where it is not ok, the store
  /// is empty and takes nothing.
  Status mount();
  bool mounted() const { return !has_flash() || log_.mounted(); }
  /// Whether there is flash at all.
  bool keeps_data() const { return has_flash(); }

  // Writing.

  /// Statuses: ok; busy while a group is open; full where the worst case of `size` does not fit: nothing is written;
  /// not_found where nothing is mounted.
  Status begin_group(const GroupSize& size);
  /// Starts to write the submap in the slot, which is pinned meanwhile and found under header.id afterwards. Requires
  /// an open group and no step due. Statuses: ok; invalid_argument (also for poses that are not finite); busy; full
  /// where max_submaps are there.
  Status put_submap(const SubmapHeader& header, const SlotHandle& slot);
  /// The same from a grid outside the slots, which must not change until step() says ok.
  Status put_submap(const SubmapHeader& header, const GridView& grid);
  /// Starts to write a blob; `bytes` must not change until step() says ok. Replaces the one of the same kind and id.
  /// Statuses: ok; invalid_argument for kind 0 or no group; busy; full where max_blobs are there.
  Status put_blob(BlobKind kind, std::uint32_t id, Span<const std::uint8_t> bytes);
  /// Starts to remove a submap or blob. Statuses: ok; invalid_argument; busy; not_found.
  Status remove_submap(SubmapId id);
  Status remove_blob(BlobKind kind, std::uint32_t id);
  /// Starts to commit the group. Statuses: ok; invalid_argument without a group; busy.
  Status commit();
  /// One slice of what was started: codes a tile, or appends a record of at most 2 KiB, or erases a block, or syncs.
  /// Statuses: busy: call again; ok: done; full, device_error, lost (the flash did not keep what was written): the
  /// group is given up. It will be absent, unless the device failed in the commit itself: then only a mount can tell.
  Status step();
  /// Gives the open group up; what was written of it is garbage. Nothing happens without one.
  void abandon_group();
  bool group_open() const { return group_open_; }

  // Reading.

  /// Starts to bring a submap into a slot, the least recently used one. Statuses: ok (step_fetch() may be ok at once);
  /// not_found; busy while another is being fetched or where all slots are pinned.
  Status begin_fetch(SubmapId id);
  /// One slice: reads a record or decodes a tile. Statuses: busy: call again; ok: the submap is resident; lost where
  /// its records are damaged; not_found without a fetch; device_error.
  Status step_fetch();
  bool is_resident(SubmapId id) const { return slots_.is_resident(id); }
  /// A pin on the resident submap. Statuses: ok; not_found where it is not resident.
  Result<SlotHandle> slot(SubmapId id) { return slots_.acquire(id); }
  /// The slots themselves: a free one to render into, views, releasing.
  GridSlots& slots() { return slots_; }
  const GridSlots& slots() const { return slots_; }

  std::size_t submap_count() const { return index_.of_kind(0).size(); }
  /// Requires i < submap_count(); ascending with i, valid until the next commit.
  SubmapId submap_id(std::size_t i) const { return index_.of_kind(0)[i].id; }
  bool contains(SubmapId id) const { return index_.find(0, id) != nullptr; }
  /// Reads a submap's header. Statuses: ok; not_found; lost; device_error.
  Result<SubmapHeader> header(SubmapId id) const;
  /// CRC-32 of the submap as a whole (header and cells), as it was stored; reads the record headers of its grid.
  /// Statuses: ok; not_found; lost; device_error.
  Result<std::uint32_t> grid_crc32(SubmapId id) const;

  std::size_t blob_count(BlobKind kind) const { return index_.of_kind(kind).size(); }
  /// Requires i < blob_count(kind); ascending with i, valid until the next commit.
  std::uint32_t blob_id(BlobKind kind, std::size_t i) const { return index_.of_kind(kind)[i].id; }
  /// Copies a blob and gives its length. Statuses: ok; not_found; lost; invalid_argument where `out` is too small;
  /// device_error.
  Result<std::size_t> read_blob(BlobKind kind, std::uint32_t id, Span<std::uint8_t> out) const;
  /// Reads all blobs of a kind by ascending id into `buffer` and shows each to the visitor. A damaged one is passed
  /// over and counted. Statuses: ok; lost where one was damaged; invalid_argument where one is longer than `buffer`;
  /// device_error.
  using BlobVisitor = void (*)(void* context, std::uint32_t id, Span<const std::uint8_t> bytes);
  Status read_blobs(BlobKind kind, Span<std::uint8_t> buffer, void* context, BlobVisitor visitor);

  StoreStatistics statistics() const;
  /// Bytes of flash that the submap's records take. 0 where there is none.
  std::uint32_t stored_bytes(SubmapId id) const;

 private:
  enum class Job : std::uint8_t { none, submap, blob, remove, commit };
  enum class CommitStage : std::uint8_t { flush, write, sync };

  bool has_flash() const { return flash_blocks_ != 0; }
  Status ready_to_put() const;
  bool fits(const GroupSize& size) const;
  Status check_put(const SubmapHeader& header, const GridView& grid) const;
  Status start_remove(std::uint8_t kind, std::uint32_t id);
  Status step_job();
  Status step_blob();
  Status step_remove();
  Status step_commit();
  Status write_commit();
  Status finish_commit();
  Status reserve(std::uint8_t kind, std::uint32_t id);
  Status make_room(std::size_t bytes);
  RecordHeader record(RecordType type, std::uint8_t kind, std::uint32_t id) const;
  void publish_slot();
  void end_group();

  Status replay();
  Status apply_group(LogCursor from, const LogRecord& commit_record);
  Status apply_record(const LogRecord& record);
  Status next_of_submap(const LogRecord& first, LogCursor& cursor, LogRecord& out) const;

  StoreConfig config_;
  Log log_sink_;
  std::uint32_t flash_blocks_ = 0;
  FlashLog log_;
  RecordIndex index_;
  GridSlots slots_;
  SubmapWriter writer_;
  SubmapReader reader_;

  bool group_open_ = false;
  Job job_ = Job::none;
  CommitStage commit_stage_ = CommitStage::flush;
  LogRecord commit_record_;
  std::uint32_t group_ = 0;           ///< number of the open group, or of the last one there was
  std::uint32_t previous_group_ = 0;  ///< the last committed one
  std::uint32_t new_submaps_ = 0;     ///< in the open group, not known before
  std::uint32_t new_blobs_ = 0;
  LogCursor group_begin_;             ///< before its first record
  std::uint32_t records_before_ = 0;  ///< the log's counts when the group began
  std::uint32_t bytes_before_ = 0;
  SlotHandle writing_slot_;
  SubmapId writing_id_ = kNoSubmap;
  BlobKind blob_kind_ = 0;
  std::uint32_t blob_id_ = 0;
  Span<const std::uint8_t> blob_;
  std::size_t blob_position_ = 0;
  std::uint16_t blob_part_ = 0;

  SlotHandle fetch_slot_;
  SubmapId fetch_id_ = kNoSubmap;
  std::uint32_t fetch_address_ = 0;
  std::uint32_t lost_records_ = 0;
  std::uint32_t groups_failed_ = 0;
};

}  // namespace mellin
