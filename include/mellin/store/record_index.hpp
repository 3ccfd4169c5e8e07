// Where the live records lie: 12 bytes for each submap and blob, sorted by (kind, id).
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"

namespace mellin {

struct IndexEntry {
  std::uint32_t id = 0;
  std::uint32_t address = 0;         ///< of its first record
  std::uint32_t kind_and_bytes = 0;  ///< kind in the upper 8 bits; bytes of its records below, at most 16 MiB - 1

  std::uint8_t kind() const { return static_cast<std::uint8_t>(kind_and_bytes >> 24); }
  std::uint32_t bytes() const { return kind_and_bytes & 0xFFFFFFU; }
};

class RecordIndex {
 public:
  struct Memory {
    Span<IndexEntry> entries;
  };
  template <class A>
  static constexpr Memory carve(A& arena, std::size_t capacity) {
    return {arena.template take<IndexEntry>(capacity, Part::store)};
  }

  RecordIndex() = default;
  explicit RecordIndex(const Memory& memory) : entries_(memory.entries) {}

  /// Adds or replaces an entry; a search and a move of what lies behind. Statuses: ok; full; invalid_argument for more
  /// than 16 MiB.
  Status put(std::uint8_t kind, std::uint32_t id, std::uint32_t address, std::uint32_t bytes);
  /// Adds to the bytes of an entry, if there is one.
  void grow(std::uint8_t kind, std::uint32_t id, std::uint32_t bytes);
  /// Whether there was one.
  bool remove(std::uint8_t kind, std::uint32_t id);
  /// nullptr where there is none; valid until the next change.
  const IndexEntry* find(std::uint8_t kind, std::uint32_t id) const;
  bool contains(std::uint8_t kind, std::uint32_t id) const { return find(kind, id) != nullptr; }
  /// The entries of a kind, by ascending id; valid until the next change.
  Span<const IndexEntry> of_kind(std::uint8_t kind) const;
  std::size_t size() const { return size_; }
  std::uint64_t bytes() const;
  void clear() { size_ = 0; }

 private:
  std::size_t lower_bound(std::uint8_t kind, std::uint32_t id) const;
  bool holds(std::size_t i, std::uint8_t kind, std::uint32_t id) const;

  Span<IndexEntry> entries_;
  std::size_t size_ = 0;
};

}  // namespace mellin
