// The grids in RAM: a fixed number of slots of one full-resolution grid each, the least recently used one given up when
// another is needed (paper, Section III-D: submaps are brought back into memory on demand).
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "mellin/core/arena.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

/// A pin on a slot: as long as it is held, the slot keeps its grid. Cannot be copied; give it back with release(). A
/// handle that was released or moved from is empty, and an empty or stale one gets a status, never another's grid.
class SlotHandle {
 public:
  SlotHandle() = default;
  SlotHandle(const SlotHandle&) = delete;
  SlotHandle& operator=(const SlotHandle&) = delete;
  SlotHandle(SlotHandle&& other) noexcept : index_(other.index_), generation_(other.generation_) { other.clear(); }
  SlotHandle& operator=(SlotHandle&& other) noexcept {
    std::swap(index_, other.index_);
    std::swap(generation_, other.generation_);
    return *this;
  }
  bool empty() const { return generation_ == 0; }

 private:
  friend class GridSlots;
  SlotHandle(std::uint16_t index, std::uint32_t generation) : index_(index), generation_(generation) {}
  void clear() { generation_ = 0; }
  std::uint16_t index_ = 0;
  std::uint32_t generation_ = 0;  ///< 0: empty
};

class GridSlots {
 public:
  struct Slot {
    SubmapId id = kNoSubmap;
    std::uint32_t generation = 0;  ///< counts up when the slot gets another content
    std::uint32_t last_use = 0;
    std::uint32_t pins = 0;
  };
  struct Memory {
    Span<Slot> slots;
    Span<std::uint8_t> cells;
  };
  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t side, std::uint16_t slots) {
    return {arena.template take<Slot>(slots, Part::store),
            arena.template take<std::uint8_t>(static_cast<std::size_t>(side) * side * slots, Part::store)};
  }

  GridSlots() = default;
  GridSlots(const Memory& memory, std::uint16_t side, float cell_m);

  /// A pinned slot without an id: an unused one, else the least recently used that nobody pins. Its cells hold
  /// anything. Statuses: ok; busy where all are pinned.
  Result<SlotHandle> acquire_free();
  /// A pin on the slot that holds `id`, which thereby becomes the most recently used. Statuses: ok; not_found.
  Result<SlotHandle> acquire(SubmapId id);
  /// Another pin on the same slot. Statuses: ok; invalid_argument for an empty or stale handle.
  Result<SlotHandle> pin_again(const SlotHandle& handle);
  /// Gives the pin back and empties the handle. Statuses: ok; invalid_argument for an empty or stale handle.
  Status release(SlotHandle& handle);

  /// Says that the slot now holds submap `id`; another slot that held it forgets it. Statuses: ok; invalid_argument for
  /// an empty or stale handle.
  Status assign(const SlotHandle& handle, SubmapId id);
  /// Lets nobody find `id` any more; pins on it stay valid.
  void forget(SubmapId id);
  /// Forgets all ids.
  void forget_all();

  bool is_resident(SubmapId id) const;
  /// The submap in the slot, kNoSubmap where it has none or the handle is empty or stale.
  SubmapId id(const SlotHandle& handle) const;
  /// The grid, valid while the handle is held. An empty or stale handle gives no cells.
  GridView view(const SlotHandle& handle) const;
  /// The same to write to.
  Span<std::uint8_t> cells(const SlotHandle& handle);
  std::size_t capacity() const { return slots_.size(); }
  std::size_t pinned() const;

 private:
  bool valid(const SlotHandle& handle) const;
  Slot* find(SubmapId id) const;
  SlotHandle pin(std::size_t index);
  Span<std::uint8_t> slot_cells(std::size_t index) const;

  Span<Slot> slots_;
  Span<std::uint8_t> cells_;
  std::uint16_t side_ = 0;
  float cell_m_ = 0.0F;
  std::uint32_t clock_ = 0;
};

}  // namespace mellin
