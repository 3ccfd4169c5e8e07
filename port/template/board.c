/* What firmware images ask of the board (board.h), but for the console, which is semihosting's or console.c's, and the
 * stack, which the start-up code knows. The library needs nothing of this file. */
#include "board.h"

#include "not_written.h"
#include "start.h"

/* Before main() and before variables have their values: the clock tree, external memory, caches, the watchdog. May stay
 * empty where the chip's state after reset will do. Must not use variables with static storage. */
void board_initialise(void) {}

/* A counter that runs with the instructions executed, or with the processor's clock, and never back: 64 bits, so that
 * one of 32 has to be extended. For a Cortex-M the cycle counter DWT->CYCCNT does, or a timer. Only map.elf,
 * selftest.elf and the examples use it. */
uint64_t board_ticks(void) {
  NOT_WRITTEN("return a counter that runs with the processor's clock, and starts itself at the first call");
}

/* Ticks for a million instructions: measured by a loop (baremetal/calibrate.c does), or 0 where ticks are nanoseconds.
 */
uint32_t board_ticks_per_million(void) {
  NOT_WRITTEN(
      "return 0 where board_ticks() counts nanoseconds; else take baremetal/calibrate.c into board.cmake instead");
}

static void put_number(unsigned number) {
  char digits[11] = {0};
  char* at = digits + sizeof digits - 1;
  do {
    *--at = (char)('0' + number % 10);
    number /= 10;
  } while (number != 0);
  board_print(at);
}

/* Goes when nothing calls it any more. */
void not_written(const char* file, unsigned line, const char* function, const char* what) {
  board_print(file);
  board_print(":");
  put_number(line);
  board_print(": ");
  board_print(function);
  board_print(" is not written yet: ");
  board_print(what);
  board_print("\n");
  board_exit(73);
}
