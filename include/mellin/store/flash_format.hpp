// The bytes on flash, format version 1. The one place that defines them; all integers are little-endian, all floats
// IEEE 754 bits stored as integers, nothing is padded.
//
// The device is a ring of erase blocks, written in ring order: a circular log. A block is erased when it is opened,
// never before, and then filled from its start with a block header and records behind one another. A record never
// spans blocks. Space that a flush leaves before the end of a program unit holds erased bytes; a reader that finds no
// valid record header looks for the next one, byte by byte, to the end of the block.
//
//   block header, 56 bytes          record, 28 bytes and the payload
//    0 u32 magic "MLNB"              0 u16 magic "Mr"
//    4 u16 format version            2 u8  type (RecordType)
//    6 u16 side of a grid, cells     3 u8  kind of a blob; 0: a submap
//    8 u64 config fingerprint        4 u32 group, counting up from 1
//   16 u32 sequence, from 1          8 u32 id of the submap or blob
//   20 u32 oldest live sequence     12 u16 part: first tile or number of the chunk
//   24 u32 erases of this block     14 u16 parts: tiles in it; chunk: 1 the last, else 0
//   28 u32 block size, bytes        16 u16 length of the payload, bytes
//   32 u32 block count              18 u16 coding of the grid record (GridCoding)
//   36 u32 program unit, bytes      20 u32 CRC-32 of the payload
//   40 f32 edge of a cell, m        24 u32 CRC-32 of bytes 0 to 23
//   44 u8  erased value             28 …   payload, at most 2020 bytes
//   45 u8 x 7, zero
//   52 u32 CRC-32 of bytes 0 to 51; magic, version and this stay where they are in all versions
//
//   submap payload, 84 bytes         grid payload: the cells of `parts` tiles from tile `part` on, coded as
//    0 u32 id                        tile_codec.hpp says, or one raw tile
//    4 u8 x 16 session UUID
//   20 f64 x 3 session_T_submap      submap end payload, 4 bytes
//   44 f64 x 3 submap_T_robot         0 u32 CRC-32 of the submap payload, then of all cells tile by tile
//   68 i64 stamp, us
//   76 u32 first scan                commit payload, 12 bytes
//   80 u32 scan count                 0 u32 records in the group, this one not counted
//                                     4 u32 bytes of those records
//   blob payload: the chunk's bytes   8 u32 the group committed before this one, 0: none
//   remove payload: empty
//
// Atomicity. Records belong to groups, one written at a time. A group counts when its commit record is there; its
// other records are flushed and synced before the commit record is programmed, so a valid commit record says that the
// group is whole. Where (kind, id) occurs in several committed groups, the last one in the log counts; a remove record
// ends it. A group without a commit is garbage. A commit record whose predecessor is missing tells that one was
// damaged.
//
// Power cuts. A torn program may leave a unit that reads as erased and must not be programmed again. So the first
// write after a mount opens a new block: nothing is ever programmed into a block opened before a restart. That costs a
// partly used block a restart, until reclaimed. A torn erase or block header leaves a block with an invalid header:
// it is free.
//
// Reclaiming. The oldest block is emptied by appending the live groups' items that begin in it once more, as a new
// group at the head of the log; blocks opened after its commit carry the raised `oldest live sequence`, and blocks
// below that of the newest block are free, whatever they hold. So a remove record may be dropped when it comes to lie
// in the oldest block, wear is level to one erase by the ring's order, and one spare block is always kept.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

inline constexpr std::uint16_t kStoreFormatVersion = 1;

inline constexpr std::size_t kBlockHeaderBytes = 56;
inline constexpr std::size_t kRecordHeaderBytes = 28;
inline constexpr std::size_t kMaxRecordBytes = 2048;
inline constexpr std::size_t kMaxPayloadBytes = kMaxRecordBytes - kRecordHeaderBytes;
inline constexpr std::size_t kSubmapPayloadBytes = 84;
inline constexpr std::size_t kSubmapEndPayloadBytes = 4;
inline constexpr std::size_t kCommitPayloadBytes = 12;

/// Sequence and group numbers from here on are refused as damage, so that counting up cannot overflow.
inline constexpr std::uint32_t kNumberLimit = 0xFFFFFF00U;

enum class RecordType : std::uint8_t {
  submap = 1,      ///< a submap begins; its grid follows
  grid = 2,        ///< some tiles of it
  submap_end = 3,  ///< and ends
  blob = 4,        ///< a chunk of a blob
  remove = 5,      ///< (kind, id) is no more
  commit = 6,      ///< the group is whole
};

enum class GridCoding : std::uint16_t { modelled = 0, raw = 1 };

struct BlockHeader {
  std::uint16_t version = kStoreFormatVersion;
  std::uint16_t side = 0;
  std::uint64_t fingerprint = 0;
  std::uint32_t sequence = 0;
  std::uint32_t oldest_sequence = 0;
  std::uint32_t erases = 0;
  std::uint32_t block_size = 0;
  std::uint32_t block_count = 0;
  std::uint32_t program_unit = 0;
  float cell_m = 0.0F;
  std::uint8_t erased_value = 0xFF;
};

struct RecordHeader {
  RecordType type = RecordType::commit;
  std::uint8_t kind = 0;
  std::uint32_t group = 0;
  std::uint32_t id = 0;
  std::uint16_t part = 0;
  std::uint16_t parts = 0;
  std::uint16_t length = 0;
  GridCoding coding = GridCoding::modelled;
  std::uint32_t payload_crc = 0;
};

struct Commit {
  std::uint32_t records = 0;
  std::uint32_t bytes = 0;
  std::uint32_t previous_group = 0;
};

/// Each writes exactly the number of bytes that the tables above give; `out` is at least as long.
void encode_block_header(const BlockHeader& header, Span<std::uint8_t> out);
void encode_record_header(const RecordHeader& header, Span<std::uint8_t> out);
void encode_submap(const SubmapHeader& header, Span<std::uint8_t> out);
void encode_commit(const Commit& commit, Span<std::uint8_t> out);
void encode_u32(std::uint32_t value, Span<std::uint8_t> out);

/// bad_data where magic, checksum or a number's range is wrong. The block header of another format version passes:
/// its version is the caller's to compare.
Status decode_block_header(Span<const std::uint8_t> bytes, BlockHeader& out);
Status decode_record_header(Span<const std::uint8_t> bytes, RecordHeader& out);
/// bad_data where a pose is not finite or the length is not the right one.
Status decode_submap(Span<const std::uint8_t> bytes, SubmapHeader& out);
Status decode_commit(Span<const std::uint8_t> bytes, Commit& out);
std::uint32_t decode_u32(Span<const std::uint8_t> bytes);

/// Whether a record header may begin with these two bytes.
bool is_record_magic(std::uint8_t first, std::uint8_t second);

}  // namespace mellin
