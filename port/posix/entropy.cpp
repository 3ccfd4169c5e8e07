#include "posix/entropy.hpp"

#include <sys/random.h>

#include <cerrno>
#include <cstdint>

namespace mellin::posix {
namespace {

int fill(void*, void* buffer, std::uint32_t size) {
  auto* at = static_cast<std::uint8_t*>(buffer);
  while (size > 0) {
    const ssize_t got = ::getrandom(at, size, 0);
    if (got < 0) {
      if (errno == EINTR) {
        continue;
      }
      return -1;
    }
    at += got;
    size -= static_cast<std::uint32_t>(got);
  }
  return 0;
}

}  // namespace

mellin_entropy system_entropy() { return {nullptr, fill}; }

}  // namespace mellin::posix
