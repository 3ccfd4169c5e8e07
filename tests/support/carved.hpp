// Memory for one part of the library, as its carve() asks for.
#pragma once

#include <cstdint>
#include <vector>

#include "mellin/core/arena.hpp"

namespace mellin::test {

/// The part's memory, in `words`, which must outlive it.
template <class Part, class Config>
typename Part::Memory give(std::vector<std::uint64_t>& words, const Config& config) {
  MeasureArena measured;
  (void)Part::carve(measured, config);
  words.assign(measured.use().total() / 8, 0);
  Arena arena({reinterpret_cast<std::byte*>(words.data()), words.size() * 8});
  return Part::carve(arena, config);
}

}  // namespace mellin::test
