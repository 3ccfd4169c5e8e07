// The port of a POSIX system as a board: flash in RAM, the system's clock and entropy, the console as a log.
#include "board_port.h"

#include "board.h"
#include "posix/clock.hpp"
#include "posix/entropy.hpp"
#include "ramflash/static_flash.hpp"

mellin_port board_port(void) {
  mellin_port port = {};
  port.flash = mellin::port::static_flash();
  port.clock = mellin::posix::monotonic_clock();
  port.entropy = mellin::posix::system_entropy();
  port.log.write = [](void*, mellin_log_level, const char* line) {
    board_print("mellin: ");
    board_print(line);
    board_print("\n");
  };
  return port;
}
