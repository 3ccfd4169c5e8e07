// Text on the board's console, without stdio.
#pragma once

#include <type_traits>

#include "board.h"
#include "mellin/core/log.hpp"

namespace mellin::image {

inline void print_part(const char* text) { board_print(text); }

template <class T, std::enable_if_t<std::is_arithmetic_v<T>, bool> = true>
void print_part(T number) {
  using Widest = std::conditional_t<std::is_floating_point_v<T>, double,
                                    std::conditional_t<std::is_signed_v<T>, std::int64_t, std::uint64_t>>;
  LogLine line;
  line << static_cast<Widest>(number);
  board_print(line.text());
}

/// Prints strings and numbers one after the other.
template <class... Parts>
void print(const Parts&... parts) {
  (print_part(parts), ...);
}

}  // namespace mellin::image
