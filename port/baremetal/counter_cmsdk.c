/* The board's counter: the timer whose address the board's CMake file gives. Emulated with -icount, the clock runs with
 * the instructions. */
#include "board.h"
#include "cmsdk_timer.h"

uint64_t board_ticks(void) { return cmsdk_timer_ticks(MELLIN_CMSDK_TIMER); }

/* Measured, since it depends on the emulator's clock: a loop of two instructions, half a million times. */
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
