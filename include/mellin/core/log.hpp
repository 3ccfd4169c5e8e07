// The log facade: formats a line into a fixed buffer and hands it to the port's sink, if there is one.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/port.h"

namespace mellin {

/// Builds one line; what does not fit is cut. No printf, no locale.
class LogLine {
 public:
  LogLine& operator<<(const char* text);
  LogLine& operator<<(std::int64_t value);
  LogLine& operator<<(std::uint64_t value);
  LogLine& operator<<(std::int32_t value) { return *this << static_cast<std::int64_t>(value); }
  LogLine& operator<<(std::uint32_t value) { return *this << static_cast<std::uint64_t>(value); }
  /// Four decimals; "nan", "inf" and "-inf" as such.
  LogLine& operator<<(double value);

  /// The line, zero-terminated.
  const char* text() const { return text_; }

 private:
  void put(char c);
  static constexpr std::size_t kCapacity = 160;
  char text_[kCapacity] = {};
  std::size_t size_ = 0;
};

class Log {
 public:
  Log() = default;
  explicit Log(const mellin_log& sink) : sink_(sink) {}

  void write(mellin_log_level level, const LogLine& line) const {
    if (sink_.write != nullptr) {
      sink_.write(sink_.context, level, line.text());
    }
  }

 private:
  mellin_log sink_ = {};
};

}  // namespace mellin
