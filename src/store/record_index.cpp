#include "mellin/store/record_index.hpp"

namespace mellin {
namespace {

constexpr std::uint32_t kMostBytes = 0xFFFFFFU;

constexpr std::uint32_t pack(std::uint8_t kind, std::uint32_t bytes) {
  return static_cast<std::uint32_t>(kind) << 24U | bytes;
}

bool before(const IndexEntry& entry, std::uint8_t kind, std::uint32_t id) {
  return entry.kind() != kind ? entry.kind() < kind : entry.id < id;
}

}  // namespace

std::size_t RecordIndex::lower_bound(std::uint8_t kind, std::uint32_t id) const {
  std::size_t low = 0;
  std::size_t high = size_;
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (before(entries_[middle], kind, id)) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

bool RecordIndex::holds(std::size_t i, std::uint8_t kind, std::uint32_t id) const {
  return i < size_ && entries_[i].kind() == kind && entries_[i].id == id;
}

Status RecordIndex::put(std::uint8_t kind, std::uint32_t id, std::uint32_t address, std::uint32_t bytes) {
  if (bytes > kMostBytes) {
    return Status::invalid_argument;
  }
  const std::size_t at = lower_bound(kind, id);
  if (!holds(at, kind, id)) {
    if (size_ == entries_.size()) {
      return Status::full;
    }
    for (std::size_t i = size_; i > at; --i) {
      entries_[i] = entries_[i - 1];
    }
    ++size_;
  }
  entries_[at] = {id, address, pack(kind, bytes)};
  return Status::ok;
}

void RecordIndex::grow(std::uint8_t kind, std::uint32_t id, std::uint32_t bytes) {
  const std::size_t at = lower_bound(kind, id);
  if (holds(at, kind, id)) {
    const std::uint64_t sum = std::uint64_t{entries_[at].bytes()} + bytes;
    entries_[at].kind_and_bytes = pack(kind, sum < kMostBytes ? static_cast<std::uint32_t>(sum) : kMostBytes);
  }
}

bool RecordIndex::remove(std::uint8_t kind, std::uint32_t id) {
  const std::size_t at = lower_bound(kind, id);
  if (!holds(at, kind, id)) {
    return false;
  }
  for (std::size_t i = at + 1; i < size_; ++i) {
    entries_[i - 1] = entries_[i];
  }
  --size_;
  return true;
}

const IndexEntry* RecordIndex::find(std::uint8_t kind, std::uint32_t id) const {
  const std::size_t at = lower_bound(kind, id);
  return holds(at, kind, id) ? &entries_[at] : nullptr;
}

Span<const IndexEntry> RecordIndex::of_kind(std::uint8_t kind) const {
  const std::size_t from = lower_bound(kind, 0);
  const std::size_t to = kind == 0xFF ? size_ : lower_bound(static_cast<std::uint8_t>(kind + 1), 0);
  return {entries_.data() + from, to - from};
}

std::uint64_t RecordIndex::bytes() const {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    sum += entries_[i].bytes();
  }
  return sum;
}

}  // namespace mellin
