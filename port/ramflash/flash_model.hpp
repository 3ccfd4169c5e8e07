// Flash over the caller's memory: a plain model for images, emulators and tests. As strict as the real thing in what it
// takes (only aligned units, only into erased space), but nothing in it ever fails or loses power.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/span.hpp"
#include "mellin/port.h"

namespace mellin::port {

struct FlashGeometry {
  std::uint32_t block_size = 4096;    ///< bytes
  std::uint32_t block_count = 16384;  ///< 64 MiB
  std::uint32_t program_unit = 256;   ///< bytes

  constexpr std::uint64_t bytes() const { return std::uint64_t{block_size} * block_count; }
  /// Whether there can be such a device.
  constexpr bool valid() const {
    return program_unit != 0 && block_size != 0 && block_size % program_unit == 0 && block_count >= 2 &&
           bytes() <= std::uint64_t{1} << 32U;
  }
  constexpr bool inside(std::uint32_t address, std::uint32_t size) const {
    return std::uint64_t{address} + size <= bytes();
  }
  constexpr bool programmable(std::uint32_t address, std::uint32_t size) const {
    return inside(address, size) && address % program_unit == 0 && size % program_unit == 0;
  }
};

inline constexpr std::uint8_t kErasedByte = 0xFF;

/// The geometry as a device without functions.
mellin_flash describe(void* context, const FlashGeometry& geometry);

/// Whether all bytes are erased.
bool is_erased(Span<const std::uint8_t> bytes);

struct FlashCounts {
  std::uint64_t programs = 0;
  std::uint64_t programmed_bytes = 0;
  std::uint64_t erases = 0;
  std::uint64_t syncs = 0;
};

class FlashModel {
 public:
  FlashModel() = default;
  /// `bytes` holds what the device holds: geometry.bytes() of it, by the caller. Requires a valid geometry.
  FlashModel(const FlashGeometry& geometry, Span<std::uint8_t> bytes) : geometry_(geometry), bytes_(bytes) {}
  FlashModel(const FlashModel&) = delete;
  FlashModel& operator=(const FlashModel&) = delete;

  /// As it comes from the factory.
  void erase_all();
  /// Valid as long as this object. Its calls return -1 for what the contract of port.h excludes.
  mellin_flash flash();
  const FlashCounts& counts() const { return counts_; }
  Span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  static int read(void* context, std::uint32_t address, void* buffer, std::uint32_t size);
  static int program(void* context, std::uint32_t address, const void* data, std::uint32_t size);
  static int erase(void* context, std::uint32_t block);
  static int sync(void* context);

  FlashGeometry geometry_;
  Span<std::uint8_t> bytes_;
  FlashCounts counts_;
};

}  // namespace mellin::port
