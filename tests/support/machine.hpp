// A whole system in its memory, and a robot that circles in the room made by hand.
#pragma once

#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <new>
#include <string>
#include <vector>

#include "mellin/slam.hpp"
#include "tests/support/room.hpp"

namespace mellin::test {

inline Config with_laser(Config config, std::uint16_t beams = 180) {
  config.lasers[0].beams = beams;
  config.lasers[0].angle_increment_rad = static_cast<float>(kPi) / static_cast<float>(beams);
  config.lasers[0].max_range_m = 20.0F;
  return config;
}

/// A small configuration, quick to make and to run.
inline Config small() {
  Config config = with_laser(nano_profile(), 90);
  config.cell_m = 0.1F;
  config.screening.hold_digests = true;  // it shall run without flash
  config.submaps.every_scans = 4;
  return config;
}

/// Memory of exactly `size` bytes, filled with a pattern, between guard bytes. Under AddressSanitizer it is a block of
/// the heap of just that size instead, so that any access beside it is caught, reads too.
class GuardedMemory {
 public:
  using Fill = std::function<std::byte(std::size_t)>;

  explicit GuardedMemory(
      std::size_t size, const Fill& fill = [](std::size_t) { return kGuardByte; })
      : size_(size), bytes_(allocated(size + 2 * kGuard)) {
    std::fill_n(bytes_, size + 2 * kGuard, kGuardByte);
    for (std::size_t i = 0; i < size; ++i) {
      bytes_[kGuard + i] = fill(i);
    }
  }
  ~GuardedMemory() { std::free(bytes_); }
  GuardedMemory(const GuardedMemory&) = delete;
  GuardedMemory& operator=(const GuardedMemory&) = delete;

  Span<std::byte> span() { return {bytes_ + kGuard, size_}; }
  bool intact() const {
    const auto untouched = [](std::byte b) { return b == kGuardByte; };
    return std::all_of(bytes_, bytes_ + kGuard, untouched) &&
           std::all_of(bytes_ + kGuard + size_, bytes_ + size_ + 2 * kGuard, untouched);
  }

 private:
  static std::byte* allocated(std::size_t bytes) {
    if (bytes > ~std::size_t{0} / 2) {
      throw std::bad_alloc();  // what a configuration needs that no size_t can count
    }
    return static_cast<std::byte*>(std::malloc(bytes));
  }

#if defined(__SANITIZE_ADDRESS__)
  static constexpr std::size_t kGuard = 0;
#else
  static constexpr std::size_t kGuard = 4096;
#endif
  static constexpr auto kGuardByte = std::byte{0xA5};
  std::size_t size_;
  std::byte* bytes_;
};

inline mellin_log sink_to(std::vector<std::string>& lines) {
  return {&lines, [](void* context, mellin_log_level, const char* line) {
            static_cast<std::vector<std::string>*>(context)->emplace_back(line);
          }};
}

/// A robot that circles in the room, with perfect odometry.
inline Pose2 on_circle(int step) {
  const double angle = 0.15 * step;
  return {2.0 * std::cos(angle) - 1.0, 1.5 * std::sin(angle), angle + kHalfPi};
}

inline Result<ScanOutcome> add_at(Slam& slam, const Pose2& pose, std::int64_t stamp_us = 0) {
  const std::vector<float> ranges = measure(room(), pose, slam.config().lasers[0]);
  return slam.add({stamp_us, span(ranges), pose, 0});
}

inline void drain(Slam& slam) {
  while (slam.work(64)) {
  }
}

inline void circle(Slam& slam, int from, int to) {
  for (int i = from; i < to; ++i) {
    REQUIRE(add_at(slam, on_circle(i), i * 100000).ok());
    drain(slam);
  }
}

/// A system with its memory; no flash unless it is given.
struct Machine {
  GuardedMemory memory;
  Slam* slam = nullptr;
  Status status = Status::ok;

  explicit Machine(const Config& config, const mellin_port& port = {}) : memory(required_bytes(config)) {
    Result<Slam*> made = Slam::create(config, memory.span(), port);
    status = made.status();
    slam = made.ok() ? made.value() : nullptr;
  }
  Slam& operator*() { return *slam; }
  Slam* operator->() { return slam; }
};

}  // namespace mellin::test
