// A hash that tells whether two runs gave the same bits: FNV-1a over 64 bits (Fowler, Noll, Vo), fed with numbers as
// little-endian bytes, so that every machine hashes alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace mellin::image {

class Hash {
 public:
  void add_byte(std::uint8_t byte) { value_ = (value_ ^ byte) * 0x100000001B3U; }
  void add(std::uint64_t bits) {
    for (int shift = 0; shift < 64; shift += 8) {
      add_byte(static_cast<std::uint8_t>(bits >> shift));
    }
  }
  void add(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    add(bits);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325U;
};

}  // namespace mellin::image
