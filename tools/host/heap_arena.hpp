// Memory from the heap for one part of the library, exactly as large as its carve() says.
#pragma once

#include <cstdint>
#include <vector>

#include "mellin/core/arena.hpp"

namespace mellin::host {

class HeapArena {
 public:
  /// carve(arena) is run twice: to measure, and over the memory. What it returns lives as long as this does, moved or
  /// not.
  template <class Carve>
  auto carve(Carve&& carve) {
    MeasureArena measure;
    carve(measure);
    words_.assign(measure.use().total() / sizeof(std::uint64_t), 0);
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(words_.data()), bytes()));
    return carve(arena);
  }
  std::size_t bytes() const { return words_.size() * sizeof(std::uint64_t); }

 private:
  std::vector<std::uint64_t> words_;
};

}  // namespace mellin::host
