#include "mellin/store/grid_slots.hpp"

namespace mellin {

GridSlots::GridSlots(const Memory& memory, std::uint16_t side, float cell_m)
    : slots_(memory.slots), cells_(memory.cells), side_(side), cell_m_(cell_m) {}

bool GridSlots::valid(const SlotHandle& handle) const {
  return !handle.empty() && handle.index_ < slots_.size() && slots_[handle.index_].generation == handle.generation_ &&
         slots_[handle.index_].pins > 0;
}

GridSlots::Slot* GridSlots::find(SubmapId id) const {
  if (id == kNoSubmap) {
    return nullptr;
  }
  for (Slot& slot : slots_) {
    if (slot.id == id) {
      return &slot;
    }
  }
  return nullptr;
}

SlotHandle GridSlots::pin(std::size_t index) {
  Slot& slot = slots_[index];
  ++slot.pins;
  slot.last_use = ++clock_;
  return {static_cast<std::uint16_t>(index), slot.generation};
}

Result<SlotHandle> GridSlots::acquire_free() {
  Slot* best = nullptr;
  for (Slot& slot : slots_) {
    if (slot.pins != 0) {
      continue;
    }
    const bool better =
        best == nullptr || (slot.id == kNoSubmap && best->id != kNoSubmap) ||
        ((slot.id == kNoSubmap) == (best->id == kNoSubmap) && clock_ - slot.last_use > clock_ - best->last_use);
    if (better) {
      best = &slot;
    }
  }
  if (best == nullptr) {
    return Status::busy;
  }
  best->id = kNoSubmap;
  best->generation = best->generation + 1 == 0 ? 1 : best->generation + 1;
  return pin(static_cast<std::size_t>(best - slots_.data()));
}

Result<SlotHandle> GridSlots::acquire(SubmapId id) {
  const Slot* const slot = find(id);
  if (slot == nullptr) {
    return Status::not_found;
  }
  return pin(static_cast<std::size_t>(slot - slots_.data()));
}

Result<SlotHandle> GridSlots::pin_again(const SlotHandle& handle) {
  if (!valid(handle)) {
    return Status::invalid_argument;
  }
  return pin(handle.index_);
}

Status GridSlots::release(SlotHandle& handle) {
  if (!valid(handle)) {
    handle.clear();
    return Status::invalid_argument;
  }
  --slots_[handle.index_].pins;
  handle.clear();
  return Status::ok;
}

Status GridSlots::assign(const SlotHandle& handle, SubmapId id) {
  if (!valid(handle)) {
    return Status::invalid_argument;
  }
  forget(id);
  slots_[handle.index_].id = id;
  return Status::ok;
}

void GridSlots::forget(SubmapId id) {
  if (Slot* const slot = find(id); slot != nullptr) {
    slot->id = kNoSubmap;
  }
}

void GridSlots::forget_all() {
  for (Slot& slot : slots_) {
    slot.id = kNoSubmap;
  }
}

bool GridSlots::is_resident(SubmapId id) const { return find(id) != nullptr; }

SubmapId GridSlots::id(const SlotHandle& handle) const { return valid(handle) ? slots_[handle.index_].id : kNoSubmap; }

Span<std::uint8_t> GridSlots::slot_cells(std::size_t index) const {
  const std::size_t size = static_cast<std::size_t>(side_) * side_;
  return cells_.subspan(index * size, size);
}

GridView GridSlots::view(const SlotHandle& handle) const {
  GridView grid;
  if (valid(handle)) {
    grid.cells = slot_cells(handle.index_);
    grid.side = side_;
    grid.cell_m = cell_m_;
  }
  return grid;
}

Span<std::uint8_t> GridSlots::cells(const SlotHandle& handle) {
  return valid(handle) ? slot_cells(handle.index_) : Span<std::uint8_t>();
}

std::size_t GridSlots::pinned() const {
  std::size_t count = 0;
  for (const Slot& slot : slots_) {
    count += slot.pins != 0 ? 1U : 0U;
  }
  return count;
}

}  // namespace mellin
