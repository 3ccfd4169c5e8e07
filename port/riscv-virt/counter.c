/* The board's counter: the instructions retired. */
#include "board.h"

static uint32_t high(void) {
  uint32_t value;
  __asm__ volatile("rdinstreth %0" : "=r"(value));
  return value;
}

uint64_t board_ticks(void) {
  uint32_t upper = high();
  for (;;) {
    uint32_t lower;
    __asm__ volatile("rdinstret %0" : "=r"(lower));
    const uint32_t again = high();
    if (again == upper) {
      return (uint64_t)upper << 32 | lower;
    }
    upper = again;
  }
}

uint32_t board_ticks_per_million(void) { return 1000000; }
