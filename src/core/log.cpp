#include "mellin/core/log.hpp"

#include "mellin/core/math.hpp"

namespace mellin {

void LogLine::put(char c) {
  if (size_ + 1 < kCapacity) {
    text_[size_++] = c;
    text_[size_] = '\0';
  }
}

LogLine& LogLine::operator<<(const char* text) {
  for (; *text != '\0'; ++text) {
    put(*text);
  }
  return *this;
}

LogLine& LogLine::operator<<(std::uint64_t value) {
  char digits[20];
  std::size_t n = 0;
  do {
    digits[n++] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value != 0);
  while (n > 0) {
    put(digits[--n]);
  }
  return *this;
}

LogLine& LogLine::operator<<(std::int64_t value) {
  if (value < 0) {
    put('-');
    return *this << (~static_cast<std::uint64_t>(value) + 1);
  }
  return *this << static_cast<std::uint64_t>(value);
}

LogLine& LogLine::operator<<(double value) {
  if (!is_finite(value)) {
    return *this << (value > 0.0 ? "inf" : value < 0.0 ? "-inf" : "nan");
  }
  if (value < 0.0) {
    put('-');
    value = -value;
  }
  if (value >= 1e15) {
    return *this << "1e15 or more";
  }
  const auto scaled = static_cast<std::uint64_t>(value * 1e4 + 0.5);
  *this << scaled / 10000;
  put('.');
  std::uint64_t rest = scaled % 10000;
  for (std::uint64_t unit = 1000; unit > 0; unit /= 10) {
    put(static_cast<char>('0' + rest / unit));
    rest %= unit;
  }
  return *this;
}

}  // namespace mellin
