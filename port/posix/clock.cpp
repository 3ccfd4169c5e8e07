#include "posix/clock.hpp"

#include <cstdint>
#include <ctime>

namespace mellin::posix {
namespace {

std::uint64_t now_us(void*) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1'000'000U + static_cast<std::uint64_t>(now.tv_nsec) / 1000U;
}

}  // namespace

mellin_clock monotonic_clock() { return {nullptr, now_us}; }

}  // namespace mellin::posix
