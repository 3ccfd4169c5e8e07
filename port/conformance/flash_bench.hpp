// A flash device under test: each call's error and each wrong byte is noted, the first one for the report. Contents are
// patterns of address and salt, so that nothing has to be remembered to know what a byte should be.
#pragma once

#include <cstdint>

#include "conformance/conformance.hpp"

namespace mellin::port {

class FlashBench {
 public:
  explicit FlashBench(Subject& subject) : subject_(subject), flash_(subject.port.flash) {}

  const mellin_flash& flash() const { return flash_; }
  std::uint32_t unit() const { return flash_.program_unit; }
  std::uint32_t block_size() const { return flash_.block_size; }
  std::uint32_t start_of(std::uint32_t block) const { return block * flash_.block_size; }
  std::uint32_t last_block() const { return flash_.block_count - 1; }
  /// Bytes of the device; 2^32 at most.
  std::uint64_t size() const { return std::uint64_t{flash_.block_size} * flash_.block_count; }

  /// Blocks that are tested: the first, the last, and some between, ascending.
  std::uint32_t sample_count() const { return flash_.block_count < kSamples ? flash_.block_count : kSamples; }
  std::uint32_t sample(std::uint32_t i) const;

  // Each returns whether it went well; a failure is noted, and the finding is then that.
  bool erase(std::uint32_t block);
  bool program(std::uint32_t address, std::uint32_t size, std::uint8_t salt);
  bool verify(std::uint32_t address, std::uint32_t size, std::uint8_t salt);
  bool verify_erased(std::uint32_t address, std::uint32_t size);
  bool sync();
  bool fill(std::uint32_t block, std::uint8_t salt) { return program(start_of(block), block_size(), salt); }
  bool holds(std::uint32_t block, std::uint8_t salt) { return verify(start_of(block), block_size(), salt); }

  /// What an address should hold: never the erased value, so that a byte left out is seen.
  std::uint8_t pattern(std::uint32_t address, std::uint8_t salt) const;
  /// Lays the pattern for an address into memory.
  void lay(std::uint8_t* to, std::uint32_t address, std::uint32_t size, std::uint8_t salt) const;
  /// Whether `bytes` are the pattern for an address.
  bool same(const std::uint8_t* bytes, std::uint32_t address, std::uint32_t size, std::uint8_t salt);
  /// Notes a failure; returns false.
  bool fail(const LogLine& what);
  /// Notes a call's negative result; returns whether it was 0.
  bool succeeded(const char* call, std::uint32_t where, int result);

  const Finding& finding() const { return finding_; }

 private:
  static constexpr std::uint32_t kSamples = 9;
  bool wrong_byte(std::uint32_t address, std::uint8_t found, std::uint8_t expected);
  bool read_chunk(std::uint32_t address, std::uint32_t size);

  Subject& subject_;
  mellin_flash flash_;
  Finding finding_;
};

}  // namespace mellin::port
