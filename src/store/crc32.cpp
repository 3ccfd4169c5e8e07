#include "mellin/store/crc32.hpp"

#include <array>

namespace mellin {
namespace {

constexpr std::uint32_t kPolynomial = 0xEDB88320U;

/// Remainders of the sixteen half-bytes.
constexpr std::array<std::uint32_t, 16> remainders() {
  std::array<std::uint32_t, 16> table{};
  for (std::uint32_t i = 0; i < 16; ++i) {
    std::uint32_t r = i;
    for (int bit = 0; bit < 4; ++bit) {
      r = (r >> 1U) ^ ((r & 1U) != 0 ? kPolynomial : 0U);
    }
    table[i] = r;
  }
  return table;
}

constexpr std::array<std::uint32_t, 16> kRemainders = remainders();

}  // namespace

std::uint32_t crc32(Span<const std::uint8_t> bytes, std::uint32_t crc) {
  crc = ~crc;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    crc = (crc >> 4U) ^ kRemainders[crc & 15U];
    crc = (crc >> 4U) ^ kRemainders[crc & 15U];
  }
  return ~crc;
}

}  // namespace mellin
