// The examples' hooks on a POSIX host.
#include <cstdint>
#include <cstdio>
#include <ctime>

#include "example.h"

void example_print(const char* line) { std::puts(line); }

std::uint64_t example_now_us() {
  timespec used{};
  (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<std::uint64_t>(used.tv_sec) * 1000000U + static_cast<std::uint64_t>(used.tv_nsec) / 1000U;
}
