#include "mellin/store/submap_stream.hpp"

#include "mellin/store/crc32.hpp"

namespace mellin {
namespace {

/// Below this a new grid record is not worth its header, and the rest of the block is left.
constexpr std::uint32_t kLeastRecordBytes = static_cast<std::uint32_t>(kRecordHeaderBytes) + 64;

/// The most that a tile can add to the log: a record of its own with the raw cells.
constexpr std::uint32_t kMaxTileBytes = static_cast<std::uint32_t>(kRecordHeaderBytes + kTileCells + 4);

/// Opens a block where the open one has not this much room. Statuses: ok: it has; busy: opened one; full; device_error.
Status make_room(FlashLog& log, std::size_t bytes) {
  if (log.room() >= bytes) {
    return Status::ok;
  }
  const Status status = log.open_block();
  return status == Status::ok ? Status::busy : status;
}

}  // namespace

// Writing.

void SubmapWriter::begin(std::uint32_t group, const SubmapHeader& header, const GridView& grid) {
  group_ = group;
  header_ = header;
  grid_ = grid;
  stage_ = Stage::header;
  tile_ = 0;
  first_tile_ = 0;
  crc_ = 0;
}

std::uint32_t SubmapWriter::worst_case_blocks(std::uint16_t side, std::uint32_t block_room) {
  const std::uint32_t tiles_per_block = block_room / kMaxTileBytes;
  return (tile_count(side) + tiles_per_block - 1) / tiles_per_block + 1;
}

RecordHeader SubmapWriter::record(RecordType type) const {
  RecordHeader record;
  record.type = type;
  record.group = group_;
  record.id = header_.id;
  return record;
}

Status SubmapWriter::step(FlashLog& log) {
  switch (stage_) {
    case Stage::header:
      return write_header(log);
    case Stage::open_record:
      return open_record(log);
    case Stage::tiles:
      return add_tile(log);
    case Stage::raw_tile:
      return write_raw_tile(log);
    case Stage::end:
      return write_end(log);
    case Stage::done:
      break;
  }
  return Status::ok;
}

Status SubmapWriter::write_header(FlashLog& log) {
  Status status = make_room(log, kRecordHeaderBytes + kSubmapPayloadBytes);
  if (status != Status::ok) {
    return status;
  }
  const Span<std::uint8_t> payload = memory_.payload.first(kSubmapPayloadBytes);
  encode_submap(header_, payload);
  crc_ = crc32(payload);
  status = log.append(record(RecordType::submap), payload);
  stage_ = Stage::open_record;
  return status == Status::ok ? Status::busy : status;
}

Status SubmapWriter::open_record(FlashLog& log) {
  if (tile_ == tile_count(grid_.side)) {
    stage_ = Stage::end;
    return Status::busy;
  }
  const Status status = make_room(log, kLeastRecordBytes);
  if (status != Status::ok) {
    return status;
  }
  const std::size_t room = log.room() - kRecordHeaderBytes;
  encoder_.begin(memory_.payload.first(room < kMaxPayloadBytes ? room : kMaxPayloadBytes));
  first_tile_ = tile_;
  stage_ = Stage::tiles;
  return Status::busy;
}

Status SubmapWriter::add_tile(FlashLog& log) {
  const TileRect rect = tile_rect(grid_.side, tile_);
  gather_tile(grid_, rect, memory_.tile);
  const TileEncoder::Outcome outcome = encoder_.add(memory_.tile, rect);
  if (outcome == TileEncoder::Outcome::added) {
    crc_ = crc32(memory_.tile.first(rect.cells()), crc_);
    ++tile_;
    return tile_ == tile_count(grid_.side) ? write_grid_record(log) : Status::busy;
  }
  if (encoder_.tiles() > 0) {
    return write_grid_record(log);
  }
  if (outcome == TileEncoder::Outcome::incompressible) {
    stage_ = Stage::raw_tile;
    return Status::busy;
  }
  stage_ = Stage::open_record;
  const Status status = log.open_block();
  return status == Status::ok ? Status::busy : status;
}

Status SubmapWriter::write_grid_record(FlashLog& log) {
  RecordHeader grid = record(RecordType::grid);
  grid.part = static_cast<std::uint16_t>(first_tile_);
  grid.parts = encoder_.tiles();
  const Status status = log.append(grid, memory_.payload.first(encoder_.finish()));
  stage_ = Stage::open_record;
  return status == Status::ok ? Status::busy : status;
}

Status SubmapWriter::write_raw_tile(FlashLog& log) {
  const TileRect rect = tile_rect(grid_.side, tile_);
  Status status = make_room(log, kRecordHeaderBytes + rect.cells());
  if (status != Status::ok) {
    return status;
  }
  gather_tile(grid_, rect, memory_.tile);
  crc_ = crc32(memory_.tile.first(rect.cells()), crc_);
  RecordHeader grid = record(RecordType::grid);
  grid.part = static_cast<std::uint16_t>(tile_);
  grid.parts = 1;
  grid.coding = GridCoding::raw;
  status = log.append(grid, memory_.tile.first(rect.cells()));
  ++tile_;
  stage_ = Stage::open_record;
  return status == Status::ok ? Status::busy : status;
}

Status SubmapWriter::write_end(FlashLog& log) {
  const Status room = make_room(log, kRecordHeaderBytes + kSubmapEndPayloadBytes);
  if (room != Status::ok) {
    return room;
  }
  std::uint8_t payload[kSubmapEndPayloadBytes];
  encode_u32(crc_, payload);
  stage_ = Stage::done;
  return log.append(record(RecordType::submap_end), Span<const std::uint8_t>(payload, sizeof payload));
}

// Reading.

void SubmapReader::begin(std::uint32_t address, SubmapId id, std::uint16_t side, Span<std::uint8_t> cells) {
  address_ = address;
  id_ = id;
  side_ = side;
  cells_ = cells;
  stage_ = Stage::header;
  tile_ = 0;
  end_ = 0;
  crc_ = 0;
}

Status SubmapReader::step(const FlashLog& log) {
  switch (stage_) {
    case Stage::header:
      return read_header(log);
    case Stage::record:
      return read_record(log);
    case Stage::tiles:
      decode_tile();
      return Status::busy;
    case Stage::done:
      break;
  }
  return Status::ok;
}

Status SubmapReader::read_header(const FlashLog& log) {
  LogRecord record;
  Status status = log.record_at(address_, record);
  if (status == Status::ok) {
    status = log.seek(address_, cursor_);
    cursor_.offset += record.bytes();
  }
  if (status == Status::ok) {
    status = log.read_payload(record, memory_.payload);
  }
  if (status != Status::ok) {
    return status;
  }
  const Span<const std::uint8_t> payload = memory_.payload.first(record.header.length);
  if (record.header.type != RecordType::submap || record.header.id != id_ ||
      decode_submap(payload, header_) != Status::ok || header_.id != id_) {
    return Status::lost;
  }
  group_ = record.header.group;
  crc_ = crc32(payload);
  stage_ = Stage::record;
  return Status::busy;
}

Status SubmapReader::read_record(const FlashLog& log) {
  LogRecord record;
  Status status = log.next(cursor_, record);
  if (status == Status::not_found) {
    return Status::lost;
  }
  if (status == Status::ok) {
    status = accept_record(record);
  }
  if (status == Status::ok) {
    status = log.read_payload(record, memory_.payload);
  }
  if (status != Status::ok) {
    return status;
  }
  const Span<const std::uint8_t> payload = memory_.payload.first(record.header.length);
  if (record.header.type == RecordType::grid) {
    decoder_.begin(payload);
    coding_ = record.header.coding;
    end_ = tile_ + record.header.parts;
    stage_ = Stage::tiles;
    return Status::busy;
  }
  stage_ = Stage::done;
  return decode_u32(payload) == crc_ ? Status::ok : Status::lost;
}

/// Whether the record is the one that has to come next. Statuses: ok; lost.
Status SubmapReader::accept_record(const LogRecord& record) {
  const RecordHeader& header = record.header;
  if (header.group != group_ || header.id != id_) {
    return Status::lost;
  }
  const std::uint32_t tiles = tile_count(side_);
  if (header.type == RecordType::submap_end) {
    return tile_ == tiles && header.length == kSubmapEndPayloadBytes ? Status::ok : Status::lost;
  }
  if (header.type != RecordType::grid || header.part != tile_ || header.parts == 0 || header.parts > tiles - tile_) {
    return Status::lost;
  }
  const bool raw = header.coding == GridCoding::raw;
  return !raw || (header.parts == 1 && header.length == tile_rect(side_, tile_).cells()) ? Status::ok : Status::lost;
}

void SubmapReader::decode_tile() {
  const TileRect rect = tile_rect(side_, tile_);
  Span<std::uint8_t> tile = memory_.tile.first(rect.cells());
  if (coding_ == GridCoding::raw) {
    tile = memory_.payload.first(rect.cells());
  } else {
    decoder_.next(tile, rect);
  }
  crc_ = crc32(tile, crc_);
  scatter_tile(tile, rect, side_, cells_);
  ++tile_;
  stage_ = tile_ == end_ ? Stage::record : Stage::tiles;
}

}  // namespace mellin
