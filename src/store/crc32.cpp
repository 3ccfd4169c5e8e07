#include "mellin/store/crc32.hpp"

#include <array>

namespace mellin {
namespace {

constexpr std::uint32_t kPolynomial = 0xEDB88320U;

/// Remainders of all bytes.
constexpr std::array<std::uint32_t, 256> remainders() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t r = i;
    for (int bit = 0; bit < 8; ++bit) {
      r = (r >> 1U) ^ ((r & 1U) != 0 ? kPolynomial : 0U);
    }
    table[i] = r;
  }
  return table;
}

constexpr std::array<std::uint32_t, 256> kRemainders = remainders();

}  // namespace

std::uint32_t crc32(Span<const std::uint8_t> bytes, std::uint32_t crc) {
  crc = ~crc;
  for (const std::uint8_t byte : bytes) {
    crc = (crc >> 8U) ^ kRemainders[(crc ^ byte) & 255U];
  }
  return ~crc;
}

}  // namespace mellin
