// A submap to and from its records in the log, a slice a call.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/submap.hpp"
#include "mellin/store/flash_log.hpp"
#include "mellin/store/tile_codec.hpp"

namespace mellin {

/// Writes a submap: its header, grid records of as many tiles as fit, an end record with the checksum of all.
class SubmapWriter {
 public:
  struct Memory {
    Span<std::uint8_t> payload;
    Span<std::uint8_t> tile;
  };
  template <class A>
  static constexpr Memory carve(A& arena) {
    return {arena.template take<std::uint8_t>(kMaxPayloadBytes, Part::store),
            arena.template take<std::uint8_t>(kTileCells, Part::store)};
  }

  SubmapWriter() = default;
  explicit SubmapWriter(const Memory& memory) : memory_(memory) {}

  /// Starts with a submap; `grid` must not change until it is done.
  void begin(std::uint32_t group, const SubmapHeader& header, const GridView& grid);
  /// Codes one tile, or appends one record, or opens one block. Statuses: busy: call again; ok: done; full;
  /// device_error.
  Status step(FlashLog& log);
  /// The most blocks that a submap of this side can take, in a log with that much room in a block.
  static std::uint32_t worst_case_blocks(std::uint16_t side, std::uint32_t block_room);

 private:
  enum class Stage : std::uint8_t { header, open_record, tiles, raw_tile, end, done };
  Status write_header(FlashLog& log);
  Status open_record(FlashLog& log);
  Status add_tile(FlashLog& log);
  Status write_grid_record(FlashLog& log);
  Status write_raw_tile(FlashLog& log);
  Status write_end(FlashLog& log);
  RecordHeader record(RecordType type) const;

  Memory memory_;
  TileEncoder encoder_;
  SubmapHeader header_;
  GridView grid_;
  Stage stage_ = Stage::done;
  std::uint32_t group_ = 0;
  std::uint32_t tile_ = 0;        ///< next to be coded
  std::uint32_t first_tile_ = 0;  ///< of the record under way
  std::uint32_t crc_ = 0;
};

/// Reads a submap back into a grid's cells. They are the stored ones only when step() has said ok.
class SubmapReader {
 public:
  struct Memory {
    Span<std::uint8_t> payload;
    Span<std::uint8_t> tile;
  };
  template <class A>
  static constexpr Memory carve(A& arena) {
    return {arena.template take<std::uint8_t>(kMaxPayloadBytes, Part::store),
            arena.template take<std::uint8_t>(kTileCells, Part::store)};
  }

  SubmapReader() = default;
  explicit SubmapReader(const Memory& memory) : memory_(memory) {}

  /// Starts with the submap `id` whose first record lies at `address`.
  void begin(std::uint32_t address, SubmapId id, std::uint16_t side, Span<std::uint8_t> cells);
  /// Reads one record or decodes one tile. Statuses: busy: call again; ok: done, all checksums agree; lost;
  /// device_error.
  Status step(const FlashLog& log);
  /// Valid once step() has said ok.
  const SubmapHeader& header() const { return header_; }
  std::uint32_t crc() const { return crc_; }

 private:
  enum class Stage : std::uint8_t { header, record, tiles, done };
  Status read_header(const FlashLog& log);
  Status read_record(const FlashLog& log);
  Status accept_record(const LogRecord& record);
  void decode_tile();

  Memory memory_;
  TileDecoder decoder_;
  LogCursor cursor_;
  SubmapHeader header_;
  Span<std::uint8_t> cells_;
  Stage stage_ = Stage::done;
  GridCoding coding_ = GridCoding::modelled;
  std::uint32_t address_ = 0;
  std::uint32_t group_ = 0;
  SubmapId id_ = kNoSubmap;
  std::uint16_t side_ = 0;
  std::uint32_t tile_ = 0;  ///< next to be decoded
  std::uint32_t end_ = 0;   ///< behind the last tile of the record under way
  std::uint32_t crc_ = 0;
};

}  // namespace mellin
