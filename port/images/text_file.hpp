// Lines of text in a file of the board's host, written in large pieces, since each request stops the processor.
#pragma once

#include <cstdint>
#include <cstring>

#include "board.h"
#include "mellin/core/se2.hpp"

namespace mellin::image {

class TextFile {
 public:
  TextFile() = default;
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;
  ~TextFile() { (void)close(); }

  bool open(const char* path) {
    file_ = board_open(path, BOARD_WRITE);
    good_ = file_ >= 0;
    return good_;
  }
  /// Whether everything was written.
  bool close() {
    if (file_ >= 0) {
      flush();
      good_ = board_close(file_) == 0 && good_;
      file_ = -1;
    }
    return good_;
  }

  TextFile& operator<<(const char* text) {
    for (; *text != '\0'; ++text) {
      put(*text);
    }
    return *this;
  }
  TextFile& operator<<(std::uint64_t number) {
    char digits[20];
    int n = 0;
    do {
      digits[n++] = static_cast<char>('0' + number % 10);
      number /= 10;
    } while (number != 0);
    while (n > 0) {
      put(digits[--n]);
    }
    return *this;
  }
  TextFile& operator<<(std::uint32_t number) { return *this << std::uint64_t{number}; }
  /// Nine decimals, rounded half away from zero; the same text for the same bits everywhere.
  TextFile& operator<<(double number) {
    if (number < 0.0) {
      put('-');
      number = -number;
    }
    if (!(number < 9e9)) {
      return *this << "9e9";  // NaN and what no map holds
    }
    const auto whole = static_cast<std::uint64_t>(number);
    auto part = static_cast<std::uint64_t>((number - static_cast<double>(whole)) * 1e9 + 0.5);
    *this << whole + part / 1000000000U;
    part %= 1000000000U;
    put('.');
    for (std::uint64_t unit = 100000000U; unit > 0; unit /= 10) {
      put(static_cast<char>('0' + part / unit % 10));
    }
    return *this;
  }

 private:
  void put(char c) {
    buffer_[size_++] = c;
    if (size_ == sizeof buffer_) {
      flush();
    }
  }
  void flush() {
    good_ = good_ && board_write(file_, buffer_, size_) == size_;
    size_ = 0;
  }

  int file_ = -1;
  bool good_ = false;
  std::uint32_t size_ = 0;
  char buffer_[512] = {};
};

/// A line `timestamp x y 0 0 0 qz qw` as trajectories have it (TUM).
inline void put_tum(TextFile& file, std::int64_t stamp_us, const Pose2& pose) {
  const SinCos half = sincos(pose.theta / 2.0);
  const auto us = static_cast<std::uint64_t>(stamp_us < 0 ? -stamp_us : stamp_us);
  file << (stamp_us < 0 ? "-" : "") << us / 1000000U << ".";
  for (std::uint64_t unit = 100000; unit > 0; unit /= 10) {
    const char digit[2] = {static_cast<char>('0' + us / unit % 10), '\0'};
    file << digit;
  }
  file << " " << pose.x << " " << pose.y << " 0 0 0 " << half.sin << " " << half.cos << "\n";
}

}  // namespace mellin::image
