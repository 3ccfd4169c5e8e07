#include "mellin/store/flash_format.hpp"

#include <cstring>

#include "mellin/store/crc32.hpp"

namespace mellin {
namespace {

constexpr std::uint32_t kBlockMagic = 0x424E4C4DU;  // "MLNB"
constexpr std::uint8_t kRecordMagic[2] = {'M', 'r'};
constexpr std::size_t kBlockCrcOffset = kBlockHeaderBytes - 4;
constexpr std::size_t kRecordCrcOffset = kRecordHeaderBytes - 4;

/// Writes little-endian values one behind the other.
class Writer {
 public:
  explicit Writer(Span<std::uint8_t> out) : out_(out) {}
  void u8(std::uint8_t v) { out_[at_++] = v; }
  void u16(std::uint16_t v) { number(v, 2); }
  void u32(std::uint32_t v) { number(v, 4); }
  void u64(std::uint64_t v) { number(v, 8); }
  void f32(float v) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &v, sizeof bits);
    u32(bits);
  }
  void f64(double v) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &v, sizeof bits);
    u64(bits);
  }
  void pose(const Pose2& v) {
    f64(v.x);
    f64(v.y);
    f64(v.theta);
  }
  /// The checksum of everything so far.
  void crc() { u32(crc32(Span<const std::uint8_t>(out_.data(), at_))); }

 private:
  void number(std::uint64_t v, int bytes) {
    for (int i = 0; i < bytes; ++i) {
      out_[at_++] = static_cast<std::uint8_t>(v >> (8 * i));
    }
  }
  Span<std::uint8_t> out_;
  std::size_t at_ = 0;
};

/// Reads them back.
class Reader {
 public:
  explicit Reader(Span<const std::uint8_t> in) : in_(in) {}
  std::uint8_t u8() { return in_[at_++]; }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  float f32() {
    const std::uint32_t bits = u32();
    float v = 0.0F;
    std::memcpy(&v, &bits, sizeof v);
    return v;
  }
  double f64() {
    const std::uint64_t bits = u64();
    double v = 0.0;
    std::memcpy(&v, &bits, sizeof v);
    return v;
  }
  Pose2 pose() {
    Pose2 v;
    v.x = f64();
    v.y = f64();
    v.theta = f64();
    return v;
  }

 private:
  std::uint64_t number(int bytes) {
    std::uint64_t v = 0;
    for (int i = 0; i < bytes; ++i) {
      v |= static_cast<std::uint64_t>(in_[at_++]) << (8 * i);
    }
    return v;
  }
  Span<const std::uint8_t> in_;
  std::size_t at_ = 0;
};

bool number_in_range(std::uint32_t number) { return number >= 1 && number < kNumberLimit; }

}  // namespace

void encode_block_header(const BlockHeader& header, Span<std::uint8_t> out) {
  Writer w(out);
  w.u32(kBlockMagic);
  w.u16(header.version);
  w.u16(header.side);
  w.u64(header.fingerprint);
  w.u32(header.sequence);
  w.u32(header.oldest_sequence);
  w.u32(header.erases);
  w.u32(header.block_size);
  w.u32(header.block_count);
  w.u32(header.program_unit);
  w.f32(header.cell_m);
  w.u8(header.erased_value);
  for (int i = 0; i < 7; ++i) {
    w.u8(0);
  }
  w.crc();
}

Status decode_block_header(Span<const std::uint8_t> bytes, BlockHeader& out) {
  if (bytes.size() < kBlockHeaderBytes) {
    return Status::bad_data;
  }
  Reader r(bytes);
  if (r.u32() != kBlockMagic || decode_u32(bytes.subspan(kBlockCrcOffset, 4)) != crc32(bytes.first(kBlockCrcOffset))) {
    return Status::bad_data;
  }
  out.version = r.u16();
  out.side = r.u16();
  out.fingerprint = r.u64();
  out.sequence = r.u32();
  out.oldest_sequence = r.u32();
  out.erases = r.u32();
  out.block_size = r.u32();
  out.block_count = r.u32();
  out.program_unit = r.u32();
  out.cell_m = r.f32();
  out.erased_value = r.u8();
  const bool sane = number_in_range(out.sequence) && number_in_range(out.oldest_sequence) &&
                    out.oldest_sequence <= out.sequence && out.erases < kNumberLimit;
  return sane ? Status::ok : Status::bad_data;
}

void encode_record_header(const RecordHeader& header, Span<std::uint8_t> out) {
  Writer w(out);
  w.u8(kRecordMagic[0]);
  w.u8(kRecordMagic[1]);
  w.u8(static_cast<std::uint8_t>(header.type));
  w.u8(header.kind);
  w.u32(header.group);
  w.u32(header.id);
  w.u16(header.part);
  w.u16(header.parts);
  w.u16(header.length);
  w.u16(static_cast<std::uint16_t>(header.coding));
  w.u32(header.payload_crc);
  w.crc();
}

Status decode_record_header(Span<const std::uint8_t> bytes, RecordHeader& out) {
  if (bytes.size() < kRecordHeaderBytes || !is_record_magic(bytes[0], bytes[1]) ||
      decode_u32(bytes.subspan(kRecordCrcOffset, 4)) != crc32(bytes.first(kRecordCrcOffset))) {
    return Status::bad_data;
  }
  Reader r(bytes.subspan(2, bytes.size() - 2));
  const std::uint8_t type = r.u8();
  out.kind = r.u8();
  out.group = r.u32();
  out.id = r.u32();
  out.part = r.u16();
  out.parts = r.u16();
  out.length = r.u16();
  const std::uint16_t coding = r.u16();
  out.payload_crc = r.u32();
  if (type < static_cast<std::uint8_t>(RecordType::submap) || type > static_cast<std::uint8_t>(RecordType::commit) ||
      coding > static_cast<std::uint16_t>(GridCoding::raw)) {
    return Status::bad_data;
  }
  out.type = static_cast<RecordType>(type);
  out.coding = static_cast<GridCoding>(coding);
  const bool has_kind = out.type == RecordType::blob || (out.type == RecordType::remove && out.kind != 0);
  const bool sane = number_in_range(out.group) && out.length <= kMaxPayloadBytes && has_kind == (out.kind != 0);
  return sane ? Status::ok : Status::bad_data;
}

void encode_submap(const SubmapHeader& header, Span<std::uint8_t> out) {
  Writer w(out);
  w.u32(header.id);
  for (const std::uint8_t byte : header.session.bytes) {
    w.u8(byte);
  }
  w.pose(header.session_T_submap);
  w.pose(header.submap_T_robot);
  w.u64(static_cast<std::uint64_t>(header.stamp_us));
  w.u32(header.first_scan);
  w.u32(header.scan_count);
}

Status decode_submap(Span<const std::uint8_t> bytes, SubmapHeader& out) {
  if (bytes.size() != kSubmapPayloadBytes) {
    return Status::bad_data;
  }
  Reader r(bytes);
  out.id = r.u32();
  for (std::uint8_t& byte : out.session.bytes) {
    byte = r.u8();
  }
  out.session_T_submap = r.pose();
  out.submap_T_robot = r.pose();
  out.stamp_us = static_cast<std::int64_t>(r.u64());
  out.first_scan = r.u32();
  out.scan_count = r.u32();
  return is_finite(out.session_T_submap) && is_finite(out.submap_T_robot) ? Status::ok : Status::bad_data;
}

void encode_commit(const Commit& commit, Span<std::uint8_t> out) {
  Writer w(out);
  w.u32(commit.records);
  w.u32(commit.bytes);
  w.u32(commit.previous_group);
}

Status decode_commit(Span<const std::uint8_t> bytes, Commit& out) {
  if (bytes.size() != kCommitPayloadBytes) {
    return Status::bad_data;
  }
  Reader r(bytes);
  out.records = r.u32();
  out.bytes = r.u32();
  out.previous_group = r.u32();
  return Status::ok;
}

void encode_u32(std::uint32_t value, Span<std::uint8_t> out) { Writer(out).u32(value); }

std::uint32_t decode_u32(Span<const std::uint8_t> bytes) { return Reader(bytes).u32(); }

bool is_record_magic(std::uint8_t first, std::uint8_t second) {
  return first == kRecordMagic[0] && second == kRecordMagic[1];
}

}  // namespace mellin
