// The port of the emulated boards: flash in RAM, the counter as a clock, the console as a log. They have no entropy.
#include <cstdint>

#include "board.h"
#include "board_port.h"
#include "ramflash/static_flash.hpp"

namespace {

/// The emulated processors run as if they did five hundred million instructions a second.
std::uint64_t now_us(void*) {
  static const std::uint32_t ticks_per_million = board_ticks_per_million();
  return board_ticks() * 2000 / ticks_per_million;
}

void write(void*, mellin_log_level level, const char* line) {
  board_print(level == MELLIN_LOG_WARNING ? "mellin: warning: " : "mellin: ");
  board_print(line);
  board_print("\n");
}

}  // namespace

mellin_port board_port(void) {
  mellin_port port = {};
  port.flash = mellin::port::static_flash();
  port.clock.now_us = now_us;
  port.log.write = write;
  return port;
}
