/* How fast the board's counter runs, measured, since it depends on the emulator's clock: a loop of two instructions,
 * half a million times. */
#include "board.h"

uint32_t board_ticks_per_million(void) {
  const uint64_t before = board_ticks();
  uint32_t rounds = 500000;
  __asm__ volatile(
      "1: subs %0, %0, #1\n"
      "bne 1b\n"
      : "+r"(rounds)
      :
      : "cc");
  return (uint32_t)(board_ticks() - before);
}
