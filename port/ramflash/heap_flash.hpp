// The flash model with memory of its own, for programs and tests that have a heap.
#pragma once

#include <cassert>
#include <cstdint>
#include <vector>

#include "ramflash/flash_model.hpp"

namespace mellin::port {

/// Requires a valid geometry.
class HeapFlash {
 public:
  explicit HeapFlash(const FlashGeometry& geometry)
      : bytes_(static_cast<std::size_t>(geometry.bytes()), kErasedByte),
        model_(geometry, Span<std::uint8_t>(bytes_.data(), bytes_.size())) {
    assert(geometry.valid());
  }

  /// Valid as long as this object.
  mellin_flash flash() { return model_.flash(); }
  const FlashCounts& counts() const { return model_.counts(); }
  std::vector<std::uint8_t>& bytes() { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
  FlashModel model_;
};

}  // namespace mellin::port
