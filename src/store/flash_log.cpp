#include "mellin/store/flash_log.hpp"

#include <cstring>

#include "mellin/store/crc32.hpp"

namespace mellin {
namespace {

constexpr std::uint32_t kMinBlockSize = 4096;
constexpr std::uint32_t kMaxBlockSize = 1U << 20U;
constexpr std::uint32_t kMaxProgramUnit = 2048;
/// Blocks that are never written to, for reclaiming to have a place to begin.
constexpr std::uint32_t kSpareBlocks = 1;

constexpr bool is_power_of_two(std::uint64_t x) { return x != 0 && (x & (x - 1)) == 0; }

bool geometry_fits(const mellin_flash& flash, std::size_t page_bytes) {
  const bool callable =
      flash.read != nullptr && flash.program != nullptr && flash.erase != nullptr && flash.sync != nullptr;
  return callable && flash.block_size >= kMinBlockSize && flash.block_size <= kMaxBlockSize && flash.block_count >= 2 &&
         std::uint64_t{flash.block_size} * flash.block_count <= (std::uint64_t{1} << 32U) &&
         is_power_of_two(flash.program_unit) && flash.program_unit <= kMaxProgramUnit && is_power_of_two(page_bytes) &&
         page_bytes % flash.program_unit == 0 && flash.block_size % page_bytes == 0;
}

}  // namespace

Status FlashLog::init(const Memory& memory, const mellin_flash& flash, const LogIdentity& identity, Log log) {
  if (!geometry_fits(flash, memory.page.size())) {
    return Status::invalid_config;
  }
  flash_ = flash;
  identity_ = identity;
  log_ = log;
  page_ = memory.page;
  mounted_ = false;
  open_ = false;
  appended_records_ = 0;
  appended_bytes_ = 0;
  statistics_ = {};
  failures_ = {};
  return Status::ok;
}

Status FlashLog::read(std::uint32_t address, Span<std::uint8_t> out) const {
  const int result = flash_.read(flash_.context, address, out.data(), static_cast<std::uint32_t>(out.size()));
  failures_.reads += result == 0 ? 0U : 1U;
  return result == 0 ? Status::ok : Status::device_error;
}

Status FlashLog::erase(std::uint32_t block) {
  const int result = flash_.erase(flash_.context, block);
  failures_.erases += result == 0 ? 0U : 1U;
  return result == 0 ? Status::ok : Status::device_error;
}

Status FlashLog::sync() {
  const int result = flash_.sync(flash_.context);
  failures_.syncs += result == 0 ? 0U : 1U;
  return result == 0 ? Status::ok : Status::device_error;
}

Status FlashLog::read_block_header(std::uint32_t block, BlockHeader& out) const {
  std::uint8_t bytes[kBlockHeaderBytes];
  const Status status = read(block * flash_.block_size, bytes);
  return status == Status::ok ? decode_block_header(bytes, out) : status;
}

// Mounting.

Status FlashLog::format() {
  mounted_ = false;
  open_ = false;
  fill_ = 0;
  statistics_ = {};
  BlockHeader newest;
  Blank blank;
  const Status found = find_newest(newest, blank);
  if (found == Status::device_error) {
    return found;
  }
  newest_sequence_ = found == Status::ok ? newest.sequence : 0;
  newest_block_ = found == Status::ok ? newest_block_ : flash_.block_count - 1;
  if (newest_sequence_ + 1 >= kNumberLimit) {
    const Status erased = erase_all();
    if (erased != Status::ok) {
      return erased;
    }
    newest_sequence_ = 0;
  }
  Status status = Status::device_error;
  for (std::uint32_t i = 0; i < flash_.block_count && status != Status::ok; ++i) {
    newest_block_ = after(newest_block_);
    oldest_sequence_ = newest_sequence_ + 1;
    oldest_block_ = newest_block_;
    status = start_block(newest_block_, newest_sequence_ + 1);
  }
  if (status == Status::ok) {
    status = flush();
  }
  mounted_ = status == Status::ok;
  return status;
}

Status FlashLog::erase_all() {
  for (std::uint32_t block = 0; block < flash_.block_count; ++block) {
    const Status status = erase(block);
    if (status != Status::ok) {
      return status;
    }
  }
  return sync();
}

Status FlashLog::mount() {
  mounted_ = false;
  open_ = false;
  fill_ = 0;
  statistics_ = {};
  BlockHeader newest;
  Blank blank;
  Status status = find_newest(newest, blank);
  if (status == Status::bad_data && blank.others) {
    return blank.first ? Status::not_found : find_torn_format();
  }
  if (status == Status::ok) {
    status = check_identity(newest);
  }
  if (status != Status::ok) {
    return status;
  }
  newest_sequence_ = newest.sequence;
  oldest_sequence_ = newest.oldest_sequence;
  status = find_oldest();
  mounted_ = status == Status::ok;
  return status;
}

/// The block with the highest sequence, of whatever identity. Sets newest_block_ and sums up erases.
Status FlashLog::find_newest(BlockHeader& newest, Blank& blank) {
  newest.sequence = 0;
  blank = {};
  for (std::uint32_t block = 0; block < flash_.block_count; ++block) {
    std::uint8_t bytes[kBlockHeaderBytes];
    BlockHeader header;
    const Status status = read(block * flash_.block_size, bytes);
    if (status != Status::ok) {
      return status;
    }
    for (const std::uint8_t byte : bytes) {
      bool& is_blank = block == 0 ? blank.first : blank.others;
      is_blank = is_blank && byte == flash_.erased_value;
    }
    if (decode_block_header(bytes, header) != Status::ok) {
      continue;
    }
    statistics_.erases += header.erases;
    if (header.erases > statistics_.max_block_erases) {
      statistics_.max_block_erases = header.erases;
    }
    if (header.sequence > newest.sequence) {
      newest = header;
      newest_block_ = block;
    }
  }
  return newest.sequence != 0 ? Status::ok : Status::bad_data;
}

/// Whether block 0 holds what a power cut may leave of the very first header: some of the bits that it programs, and
/// nothing behind them. Nothing was ever stored there. Statuses: not_found: so it is; bad_data; device_error.
Status FlashLog::find_torn_format() const {
  std::uint8_t header[kBlockHeaderBytes];
  encode_block_header(block_header(1, 1, 1), header);
  std::uint8_t window[128];
  for (std::uint32_t at = 0; at < flash_.block_size; at += static_cast<std::uint32_t>(sizeof window)) {
    const Status status = read(at, window);
    if (status != Status::ok) {
      return status;
    }
    for (std::uint32_t i = 0; i < sizeof window; ++i) {
      const std::uint8_t intended = at + i < sizeof header ? header[at + i] : flash_.erased_value;
      const unsigned changed = window[i] ^ unsigned { flash_.erased_value };
      const unsigned programmed = intended ^ unsigned { flash_.erased_value };
      if ((changed & ~programmed) != 0) {
        return Status::bad_data;
      }
    }
  }
  return Status::not_found;
}

Status FlashLog::check_identity(const BlockHeader& header) const {
  if (header.version != kStoreFormatVersion) {
    log_.write(MELLIN_LOG_WARNING, LogLine()
                                       << "store: the flash holds format version " << std::uint32_t{header.version}
                                       << ", this is version " << std::uint32_t{kStoreFormatVersion});
    return Status::version_mismatch;
  }
  const bool geometry = header.block_size == flash_.block_size && header.block_count == flash_.block_count &&
                        header.program_unit == flash_.program_unit && header.erased_value == flash_.erased_value;
  if (!geometry) {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "store: the flash was written as " << header.block_count
                                             << " blocks of " << header.block_size << " bytes, it now has "
                                             << flash_.block_count << " of " << flash_.block_size);
    return Status::version_mismatch;
  }
  const bool config =
      header.fingerprint == identity_.fingerprint && header.side == identity_.side && header.cell_m == identity_.cell_m;
  if (!config) {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "store: the flash belongs to configuration " << header.fingerprint
                                             << ", side " << std::uint32_t{header.side} << ", this is "
                                             << identity_.fingerprint << ", side " << std::uint32_t{identity_.side});
    return Status::version_mismatch;
  }
  return Status::ok;
}

bool FlashLog::live(const BlockHeader& header) const {
  return header.version == kStoreFormatVersion && header.sequence >= oldest_sequence_ &&
         header.sequence <= newest_sequence_ && header.fingerprint == identity_.fingerprint;
}

/// The first live block behind the newest one in the ring.
Status FlashLog::find_oldest() {
  oldest_block_ = newest_block_;
  bool found = false;
  for (std::uint32_t block = after(newest_block_); block != newest_block_; block = after(block)) {
    BlockHeader header;
    const Status status = read_block_header(block, header);
    if (status == Status::device_error) {
      return status;
    }
    const bool is_live = status == Status::ok && live(header);
    if (is_live && !found) {
      found = true;
      oldest_block_ = block;
    }
    statistics_.damaged_blocks += found && !is_live ? 1U : 0U;
  }
  return Status::ok;
}

// Writing.

std::uint32_t FlashLog::room() const {
  return open_ ? (newest_block_ + 1) * flash_.block_size - (page_address_ + fill_) : 0;
}

std::uint32_t FlashLog::free_blocks() const {
  const std::uint32_t used =
      (newest_block_ >= oldest_block_ ? newest_block_ : newest_block_ + flash_.block_count) - oldest_block_ + 1;
  const std::uint32_t left = flash_.block_count - used;
  return mounted_ && left > kSpareBlocks ? left - kSpareBlocks : 0;
}

LogCursor FlashLog::head() const { return {newest_block_, flash_.block_size - room(), newest_sequence_}; }

Status FlashLog::open_block() {
  if (!mounted_) {
    return Status::not_found;
  }
  if (open_) {
    const Status status = program_page();
    open_ = false;
    if (status != Status::ok) {
      return status;
    }
  }
  const std::uint32_t newest = newest_block_;
  Status status = Status::full;
  while (status != Status::ok && free_blocks() > 0 && newest_sequence_ + 1 < kNumberLimit) {
    const std::uint32_t block = after(newest_block_);
    newest_block_ = block;
    status = start_block(block, newest_sequence_ + 1);
  }
  if (status != Status::ok) {
    newest_block_ = newest;  // it is the device rather than its blocks: they are tried again
  }
  return status;
}

/// Erases a block and buffers its header.
Status FlashLog::start_block(std::uint32_t block, std::uint32_t sequence) {
  BlockHeader old;
  const Status known = read_block_header(block, old);
  // The ring wears all blocks alike: where a torn erase took the count, the number of rounds stands in for it.
  const std::uint32_t erases = known == Status::ok ? old.erases + 1 : (sequence - 1) / flash_.block_count + 1;
  if (erase(block) != Status::ok) {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "store: block " << block << " cannot be erased");
    return Status::device_error;
  }
  statistics_.erases += known == Status::ok ? 1U : erases;
  if (erases > statistics_.max_block_erases) {
    statistics_.max_block_erases = erases;
  }
  newest_sequence_ = sequence;
  page_address_ = block * flash_.block_size;
  fill_ = 0;
  open_ = true;
  return write_block_header(erases);
}

BlockHeader FlashLog::block_header(std::uint32_t sequence, std::uint32_t oldest_sequence, std::uint32_t erases) const {
  BlockHeader header;
  header.side = identity_.side;
  header.fingerprint = identity_.fingerprint;
  header.sequence = sequence;
  header.oldest_sequence = oldest_sequence;
  header.erases = erases;
  header.block_size = flash_.block_size;
  header.block_count = flash_.block_count;
  header.program_unit = flash_.program_unit;
  header.cell_m = identity_.cell_m;
  header.erased_value = flash_.erased_value;
  return header;
}

Status FlashLog::write_block_header(std::uint32_t erases) {
  std::uint8_t bytes[kBlockHeaderBytes];
  encode_block_header(block_header(newest_sequence_, oldest_sequence_, erases), bytes);
  return put(bytes);
}

Status FlashLog::append(const RecordHeader& header, Span<const std::uint8_t> payload) {
  if (payload.size() > kMaxPayloadBytes || kRecordHeaderBytes + payload.size() > room()) {
    return Status::invalid_argument;
  }
  RecordHeader filled = header;
  filled.length = static_cast<std::uint16_t>(payload.size());
  filled.payload_crc = crc32(payload);
  std::uint8_t bytes[kRecordHeaderBytes];
  encode_record_header(filled, bytes);
  Status status = put(bytes);
  if (status == Status::ok) {
    status = put(payload);
  }
  if (status == Status::ok) {
    ++appended_records_;
    appended_bytes_ += static_cast<std::uint32_t>(kRecordHeaderBytes + payload.size());
  }
  return status;
}

/// Buffers bytes and programs each page that fills up.
Status FlashLog::put(Span<const std::uint8_t> bytes) {
  const auto page_bytes = static_cast<std::uint32_t>(page_.size());
  std::size_t done = 0;
  while (done < bytes.size()) {
    const std::uint32_t limit = page_bytes - page_address_ % page_bytes;
    const std::size_t left = bytes.size() - done;
    const std::size_t count = left < limit - fill_ ? left : limit - fill_;
    std::memcpy(&page_[fill_], &bytes[done], count);
    fill_ += static_cast<std::uint32_t>(count);
    done += count;
    if (fill_ == limit) {
      const Status status = program_page();
      if (status != Status::ok) {
        return status;
      }
    }
  }
  return Status::ok;
}

/// Programs what is buffered, up to the next program unit.
Status FlashLog::program_page() {
  if (fill_ == 0) {
    return Status::ok;
  }
  const std::uint32_t unit = flash_.program_unit;
  const std::uint32_t size = (fill_ + unit - 1) / unit * unit;
  if (size > fill_) {
    std::memset(&page_[fill_], flash_.erased_value, size - fill_);
  }
  const int result = flash_.program(flash_.context, page_address_, page_.data(), size);
  page_address_ += size;
  fill_ = 0;
  if (result != 0) {
    ++failures_.programs;
    open_ = false;
    return Status::device_error;
  }
  statistics_.programmed_bytes += size;
  return Status::ok;
}

Status FlashLog::flush() {
  Status status = open_ ? program_page() : Status::ok;
  if (status == Status::ok) {
    status = sync();
    open_ = open_ && status == Status::ok;
  }
  return status;
}

// Reading.

LogCursor FlashLog::begin() const {
  LogCursor cursor;
  if (!mounted_ || seek(oldest_block_ * flash_.block_size, cursor) != Status::ok) {
    return {newest_block_, flash_.block_size, newest_sequence_};
  }
  return cursor;
}

Status FlashLog::seek(std::uint32_t address, LogCursor& out) const {
  const std::uint32_t block = address / flash_.block_size;
  BlockHeader header;
  const Status status = block < flash_.block_count ? read_block_header(block, header) : Status::lost;
  if (status == Status::device_error) {
    return status;
  }
  if (status != Status::ok || !live(header)) {
    return Status::lost;
  }
  const std::uint32_t offset = address % flash_.block_size;
  const auto first = static_cast<std::uint32_t>(kBlockHeaderBytes);
  out = {block, offset < first ? first : offset, header.sequence};
  return Status::ok;
}

Status FlashLog::next(LogCursor& cursor, LogRecord& out) const {
  if (!mounted_) {
    return Status::not_found;
  }
  for (;;) {
    Status status = record_in_block(cursor.block, cursor.offset, out);
    if (status == Status::lost) {
      status = search_record(cursor.block, cursor.offset + 1, out);
    }
    if (status == Status::ok) {
      cursor.offset = out.address % flash_.block_size + out.bytes();
      return status;
    }
    if (status == Status::lost) {
      status = enter_next_block(cursor);
    }
    if (status != Status::ok) {
      return status;
    }
  }
}

/// Moves to the next live block that was written after this one; not_found behind the newest.
Status FlashLog::enter_next_block(LogCursor& cursor) const {
  while (cursor.block != newest_block_) {
    cursor.block = after(cursor.block);
    BlockHeader header;
    const Status status = read_block_header(cursor.block, header);
    if (status == Status::device_error) {
      return status;
    }
    if (status == Status::ok && live(header) && header.sequence > cursor.sequence) {
      cursor.offset = static_cast<std::uint32_t>(kBlockHeaderBytes);
      cursor.sequence = header.sequence;
      return Status::ok;
    }
  }
  return Status::not_found;
}

/// Statuses: ok; lost where no valid record begins at `offset`; device_error.
Status FlashLog::record_in_block(std::uint32_t block, std::uint32_t offset, LogRecord& out) const {
  if (offset > flash_.block_size || flash_.block_size - offset < kRecordHeaderBytes) {
    return Status::lost;
  }
  std::uint8_t bytes[kRecordHeaderBytes];
  out.address = block * flash_.block_size + offset;
  const Status status = read(out.address, bytes);
  if (status != Status::ok) {
    return status;
  }
  const bool valid = decode_record_header(bytes, out.header) == Status::ok && out.bytes() <= flash_.block_size - offset;
  return valid ? Status::ok : Status::lost;
}

/// The first valid record that begins at `from` or later in the block.
Status FlashLog::search_record(std::uint32_t block, std::uint32_t from, LogRecord& out) const {
  std::uint8_t window[128];
  const std::uint32_t base = block * flash_.block_size;
  while (from + kRecordHeaderBytes <= flash_.block_size) {
    const std::uint32_t left = flash_.block_size - from;
    const auto size = left < sizeof window ? left : static_cast<std::uint32_t>(sizeof window);
    Status status = read(base + from, Span<std::uint8_t>(window, size));
    if (status != Status::ok) {
      return status;
    }
    for (std::uint32_t i = 0; i + 1 < size; ++i) {
      if (!is_record_magic(window[i], window[i + 1])) {
        continue;
      }
      status = record_in_block(block, from + i, out);
      if (status != Status::lost) {
        return status;
      }
    }
    from += size - 1;
  }
  return Status::lost;
}

Status FlashLog::record_at(std::uint32_t address, LogRecord& out) const {
  const std::uint32_t block = address / flash_.block_size;
  return block < flash_.block_count ? record_in_block(block, address % flash_.block_size, out) : Status::lost;
}

Status FlashLog::read_payload(const LogRecord& record, Span<std::uint8_t> out) const {
  if (out.size() < record.header.length) {
    return Status::invalid_argument;
  }
  const Span<std::uint8_t> payload = out.first(record.header.length);
  if (payload.empty()) {
    return Status::ok;
  }
  const Status status = read(record.address + static_cast<std::uint32_t>(kRecordHeaderBytes), payload);
  if (status != Status::ok) {
    return status;
  }
  return crc32(payload) == record.header.payload_crc ? Status::ok : Status::lost;
}

FlashLogStatistics FlashLog::statistics() const {
  FlashLogStatistics statistics = statistics_;
  statistics.free_blocks = free_blocks();
  statistics.failures = failures_;
  return statistics;
}

}  // namespace mellin
