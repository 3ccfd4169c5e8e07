// A circular log of checksummed records on flash: what flash_format.hpp describes, without knowing what is in a
// payload. It stands alone: give it a mellin_flash and a page of memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/log.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/port.h"
#include "mellin/store/flash_format.hpp"

namespace mellin {

/// What a log's blocks say about whom they belong to.
struct LogIdentity {
  std::uint64_t fingerprint = 0;
  std::uint16_t side = 0;
  float cell_m = 0.0F;
};

/// Where a reader of the log stands: always between two records.
struct LogCursor {
  std::uint32_t block = 0;
  std::uint32_t offset = 0;
  std::uint32_t sequence = 0;  ///< of the block
};

/// A record met on the way.
struct LogRecord {
  RecordHeader header;
  std::uint32_t address = 0;  ///< of its header
  std::uint32_t bytes() const { return static_cast<std::uint32_t>(kRecordHeaderBytes) + header.length; }
};

/// Calls that the device refused, since init.
struct FlashFailures {
  std::uint32_t reads = 0;
  std::uint32_t programs = 0;
  std::uint32_t erases = 0;
  std::uint32_t syncs = 0;
};

struct FlashLogStatistics {
  std::uint64_t programmed_bytes = 0;  ///< since init
  std::uint64_t erases = 0;            ///< over the device's life, as the block headers tell
  std::uint32_t max_block_erases = 0;  ///< the same, of the most erased block
  std::uint32_t damaged_blocks = 0;    ///< blocks among the live ones whose header is invalid
  std::uint32_t free_blocks = 0;
  FlashFailures failures;
};

class FlashLog {
 public:
  struct Memory {
    Span<std::uint8_t> page;
  };
  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t page_bytes) {
    return {arena.template take<std::uint8_t>(page_bytes, Part::store)};
  }

  FlashLog() = default;

  /// `flash` is copied. Statuses: ok; invalid_config where the geometry contradicts itself (block size 4 KiB to 1 MiB
  /// and a multiple of the page, page a power of two and a multiple of the program unit, at least 2 blocks, at most
  /// 4 GiB).
  Status init(const Memory& memory, const mellin_flash& flash, const LogIdentity& identity, Log log);

  /// Starts an empty log behind whatever is there: one erase and one program. A power cut leaves either the new log or
  /// the old one, less its oldest block where all were in use. Statuses: ok; device_error.
  Status format();
  /// Finds the log's ends: reads one header a block. Statuses: ok; not_found on a blank device, also where a power
  /// cut tore its first format(); bad_data where nothing on it is a block header; version_mismatch where the log
  /// belongs to another format version, geometry or identity (both are logged); device_error.
  Status mount();
  bool mounted() const { return mounted_; }
  void unmount() { mounted_ = open_ = false; }

  // Writing.

  /// Bytes that a record may take in the open block, header included; 0 where no block is open.
  std::uint32_t room() const;
  /// Erases the next block in the ring and makes it the open one; a block that cannot be erased is passed over.
  /// Statuses: ok; full where only the spare block is left; not_found where nothing is mounted; device_error.
  Status open_block();
  /// Appends a record; `header`'s length and checksum are filled in here. Requires kRecordHeaderBytes + payload.size()
  /// <= room(), else invalid_argument. Programs whole pages as they fill. Other statuses: ok; device_error, after which
  /// the block is closed, since what lies there is uncertain.
  Status append(const RecordHeader& header, Span<const std::uint8_t> payload);
  /// Programs what is buffered, filled up with erased bytes to the program unit, and syncs. Statuses: ok; device_error.
  Status flush();
  /// A cursor before whatever is appended next.
  LogCursor head() const;
  std::uint32_t address(const LogCursor& cursor) const { return cursor.block * flash_.block_size + cursor.offset; }
  /// Records and their bytes appended since init.
  std::uint32_t appended_records() const { return appended_records_; }
  std::uint32_t appended_bytes() const { return appended_bytes_; }
  /// Blocks that open_block can still give.
  std::uint32_t free_blocks() const;
  /// Bytes of records that fit in a fresh block.
  std::uint32_t block_room() const { return flash_.block_size - static_cast<std::uint32_t>(kBlockHeaderBytes); }
  std::uint32_t program_unit() const { return flash_.program_unit; }

  // Reading. Requires that the records were flushed.

  /// The log's first record; the end of everything is `not_found` from next().
  LogCursor begin() const;
  /// The cursor before the record at `address`. Statuses: ok; lost where the block's header is invalid; device_error.
  Status seek(std::uint32_t address, LogCursor& out) const;
  /// The next valid record from the cursor on, which is moved behind it. Passes over damage: at most all remaining
  /// blocks are read. Statuses: ok; not_found at the end; device_error.
  Status next(LogCursor& cursor, LogRecord& out) const;
  /// The record that begins at `address`. Statuses: ok; lost where there is no valid header; device_error.
  Status record_at(std::uint32_t address, LogRecord& out) const;
  /// The payload, checked; `out` takes header.length bytes. Statuses: ok; lost; invalid_argument where `out` is too
  /// small; device_error.
  Status read_payload(const LogRecord& record, Span<std::uint8_t> out) const;

  FlashLogStatistics statistics() const;

 private:
  Status read(std::uint32_t address, Span<std::uint8_t> out) const;
  Status read_block_header(std::uint32_t block, BlockHeader& out) const;
  Status record_in_block(std::uint32_t block, std::uint32_t offset, LogRecord& out) const;
  Status search_record(std::uint32_t block, std::uint32_t from, LogRecord& out) const;
  Status enter_next_block(LogCursor& cursor) const;
  bool live(const BlockHeader& header) const;
  /// Whether the places of block headers hold erased bytes only.
  struct Blank {
    bool first = true;  ///< block 0
    bool others = true;
  };
  Status find_newest(BlockHeader& newest, Blank& blank);
  Status find_torn_format() const;
  Status erase(std::uint32_t block);
  Status sync();
  BlockHeader block_header(std::uint32_t sequence, std::uint32_t oldest_sequence, std::uint32_t erases) const;
  Status find_oldest();
  Status check_identity(const BlockHeader& header) const;
  Status erase_all();
  Status start_block(std::uint32_t block, std::uint32_t sequence);
  Status write_block_header(std::uint32_t erases);
  Status put(Span<const std::uint8_t> bytes);
  Status program_page();
  std::uint32_t after(std::uint32_t block) const { return block + 1 == flash_.block_count ? 0 : block + 1; }

  mellin_flash flash_ = {};
  LogIdentity identity_;
  Log log_;
  Span<std::uint8_t> page_;
  bool mounted_ = false;
  bool open_ = false;  ///< whether newest_block_ may be written to
  std::uint32_t newest_block_ = 0;
  std::uint32_t newest_sequence_ = 0;
  std::uint32_t oldest_block_ = 0;
  std::uint32_t oldest_sequence_ = 0;
  std::uint32_t page_address_ = 0;  ///< of page_[0]; a multiple of the program unit
  std::uint32_t fill_ = 0;          ///< bytes in page_
  std::uint32_t appended_records_ = 0;
  std::uint32_t appended_bytes_ = 0;
  FlashLogStatistics statistics_;
  mutable FlashFailures failures_;  ///< reading is const and may fail
};

}  // namespace mellin
