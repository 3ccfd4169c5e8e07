#include "conformance/flash_bench.hpp"

namespace mellin::port {

std::uint32_t FlashBench::sample(std::uint32_t i) const {
  return static_cast<std::uint32_t>(std::uint64_t{i} * last_block() / (sample_count() - 1));
}

std::uint8_t FlashBench::pattern(std::uint32_t address, std::uint8_t salt) const {
  std::uint32_t mixed = (address + 1) * 0x9E3779B1U ^ salt * 0x85EBCA6BU;
  mixed = (mixed ^ mixed >> 15U) * 0x2C1B3C6DU;
  const auto byte = static_cast<std::uint8_t>(mixed >> 24U);
  return byte == flash_.erased_value ? static_cast<std::uint8_t>(byte ^ 0x5AU) : byte;
}

void FlashBench::lay(std::uint8_t* to, std::uint32_t address, std::uint32_t size, std::uint8_t salt) const {
  for (std::uint32_t i = 0; i < size; ++i) {
    to[i] = pattern(address + i, salt);
  }
}

bool FlashBench::fail(const LogLine& what) {
  if (finding_.outcome != Outcome::failed) {
    finding_ = {Outcome::failed, what};
  }
  return false;
}

bool FlashBench::succeeded(const char* call, std::uint32_t where, int result) {
  return result == 0 || fail(LogLine() << call << "(" << where << ") returned " << std::int32_t{result});
}

bool FlashBench::wrong_byte(std::uint32_t address, std::uint8_t found, std::uint8_t expected) {
  return fail(LogLine() << "byte " << address << " (block " << address / block_size() << ") reads "
                        << std::uint32_t{found} << " instead of " << std::uint32_t{expected});
}

bool FlashBench::same(const std::uint8_t* bytes, std::uint32_t address, std::uint32_t size, std::uint8_t salt) {
  for (std::uint32_t i = 0; i < size; ++i) {
    if (bytes[i] != pattern(address + i, salt)) {
      return wrong_byte(address + i, bytes[i], pattern(address + i, salt));
    }
  }
  return true;
}

bool FlashBench::erase(std::uint32_t block) { return succeeded("erase", block, flash_.erase(flash_.context, block)); }

bool FlashBench::sync() { return succeeded("sync", 0, flash_.sync(flash_.context)); }

bool FlashBench::program(std::uint32_t address, std::uint32_t size, std::uint8_t salt) {
  while (size > 0) {
    const std::uint32_t chunk = size < Subject::kBuffer ? size : Subject::kBuffer;
    lay(subject_.out, address, chunk, salt);
    if (!succeeded("program", address, flash_.program(flash_.context, address, subject_.out, chunk))) {
      return false;
    }
    address += chunk;
    size -= chunk;
  }
  return true;
}

bool FlashBench::read_chunk(std::uint32_t address, std::uint32_t size) {
  for (std::uint32_t i = 0; i < size; ++i) {
    subject_.in[i] = static_cast<std::uint8_t>(~flash_.erased_value);  // what a read leaves out is seen
  }
  return succeeded("read", address, flash_.read(flash_.context, address, subject_.in, size));
}

bool FlashBench::verify(std::uint32_t address, std::uint32_t size, std::uint8_t salt) {
  while (size > 0) {
    const std::uint32_t chunk = size < Subject::kBuffer ? size : Subject::kBuffer;
    if (!read_chunk(address, chunk) || !same(subject_.in, address, chunk, salt)) {
      return false;
    }
    address += chunk;
    size -= chunk;
  }
  return true;
}

bool FlashBench::verify_erased(std::uint32_t address, std::uint32_t size) {
  while (size > 0) {
    const std::uint32_t chunk = size < Subject::kBuffer ? size : Subject::kBuffer;
    if (!read_chunk(address, chunk)) {
      return false;
    }
    for (std::uint32_t i = 0; i < chunk; ++i) {
      if (subject_.in[i] != flash_.erased_value) {
        return wrong_byte(address + i, subject_.in[i], flash_.erased_value);
      }
    }
    address += chunk;
    size -= chunk;
  }
  return true;
}

}  // namespace mellin::port
