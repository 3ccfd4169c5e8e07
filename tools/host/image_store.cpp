#include "host/image_store.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <optional>
#include <stdexcept>

namespace mellin::host {
namespace {

/// No image holds more records than this many bytes each allow, nor is an index larger than 48 MB worth having.
constexpr std::uint64_t kLeastItemBytes = kRecordHeaderBytes;
constexpr std::uint64_t kMostItems = 4'000'000;

StoreConfig config_of(const posix::ImageInfo& info) {
  const std::uint64_t bytes = std::uint64_t{info.geometry.block_size} * info.geometry.block_count;
  const auto items = static_cast<std::uint32_t>(std::min(bytes / kLeastItemBytes, kMostItems));
  StoreConfig config;
  config.side = info.newest.side;
  config.cell_m = info.newest.cell_m;
  config.fingerprint = info.newest.fingerprint;
  config.max_submaps = items;
  config.max_blobs = items;
  config.grid_slots = 1;
  config.page_bytes = static_cast<std::uint16_t>(std::clamp(info.geometry.program_unit, 1U, 2048U));
  return config;
}

std::optional<StoredLine> parse_stored(const std::string& line) {
  constexpr std::ptrdiff_t kDigits = 8;
  StoredLine stored;
  const char* const end = line.data() + line.size();
  const auto id = std::from_chars(line.data(), end, stored.id);
  if (id.ec != std::errc() || end - id.ptr != kDigits + 1 || *id.ptr != ' ') {
    return std::nullopt;
  }
  const auto crc = std::from_chars(id.ptr + 1, end, stored.crc32, 16);
  return crc.ec == std::errc() && crc.ptr == end ? std::optional(stored) : std::nullopt;
}

[[noreturn]] void refuse_line(const std::string& path, int number, const std::string& line) {
  throw std::runtime_error(path + ":" + std::to_string(number) +
                           ": expected an id and a checksum of eight hexadecimal digits, found: " + line);
}

}  // namespace

ImageStore::ImageStore(const std::string& path)
    : path_(path), info_(posix::probe_image(path)), image_(path, info_.geometry, true) {
  if (info_.newest.version != kStoreFormatVersion) {
    throw std::runtime_error(path + ": format version " + std::to_string(info_.newest.version) + ", expected " +
                             std::to_string(kStoreFormatVersion));
  }
  const StoreConfig config = config_of(info_);
  if (config.side > kMaxStoreSide) {
    throw std::runtime_error(path + ": grids of side " + std::to_string(config.side) + ", expected at most " +
                             std::to_string(kMaxStoreSide));
  }
  const SubmapStore::Memory memory = memory_.carve([&](auto& arena) { return SubmapStore::carve(arena, config); });
  const mellin_log sink = {&messages_, [](void* context, mellin_log_level, const char* line) {
                             static_cast<std::vector<std::string>*>(context)->emplace_back(line);
                           }};
  Status status = store_.init(config, memory, image_.flash(), Log(sink));
  if (status == Status::ok) {
    status = store_.mount();
  }
  if (status != Status::ok) {
    throw std::runtime_error(path + ": cannot be mounted: " + mellin::to_string(status));
  }
}

std::vector<std::uint8_t> ImageStore::fetch(SubmapId id) {
  Status status = store_.begin_fetch(id);
  if (status == Status::ok) {
    do {
      status = store_.step_fetch();
    } while (status == Status::busy);
  }
  if (status == Status::device_error) {
    throw std::runtime_error(path_ + ": cannot be read");
  }
  Result<SlotHandle> slot = status == Status::ok ? store_.slot(id) : Result<SlotHandle>(status);
  if (!slot.ok()) {
    return {};
  }
  const GridView grid = store_.slots().view(slot.value());
  std::vector<std::uint8_t> cells(grid.cells.begin(), grid.cells.end());
  static_cast<void>(store_.slots().release(slot.value()));
  return cells;
}

Status ImageStore::read_blob(BlobKind kind, std::uint32_t id, std::vector<std::uint8_t>& out) const {
  out.resize(std::max<std::size_t>(out.size(), 4096));
  Result<std::size_t> size = Status::invalid_argument;
  constexpr std::size_t kMostBytes = std::size_t{1} << 24U;  // what an index entry can count
  for (;; out.resize(out.size() * 2)) {
    size = store_.read_blob(kind, id, Span<std::uint8_t>(out.data(), out.size()));
    if (size.status() != Status::invalid_argument || out.size() >= kMostBytes) {
      break;
    }
  }
  out.resize(size.ok() ? size.value() : 0);
  return size.status();
}

std::string to_string(const StoredLine& line) {
  std::array<char, 32> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%u %08x", line.id, line.crc32));
  return text.data();
}

std::vector<StoredLine> read_stored(const std::string& path) {
  std::ifstream in(path);
  if (!in) {
    throw std::runtime_error(path + ": cannot be opened");
  }
  std::vector<StoredLine> lines;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (const std::optional<StoredLine> stored = parse_stored(line)) {
      lines.push_back(*stored);
    } else if (!in.eof()) {
      refuse_line(path, number, line);
    }
  }
  return lines;
}

}  // namespace mellin::host
