/* The board's counter: a timer of ARM's Cortex-M System Design Kit, at the address that the board's CMake file gives.
 * It counts down 32 bits with the processor's clock; read at least once a round (2.7 thousand million instructions), it
 * makes 64. Emulated with -icount, the clock runs with the instructions. */
#include "board.h"

typedef struct timer {
  volatile uint32_t control;
  volatile uint32_t value;
  volatile uint32_t reload;
} timer;

enum { ENABLE = 1 };

uint64_t board_ticks(void) {
  static uint64_t elapsed;
  static uint32_t last;
  timer* const counter = (timer*)MELLIN_CMSDK_TIMER;
  if ((counter->control & ENABLE) == 0) {
    counter->reload = 0xFFFFFFFFU;
    counter->value = 0xFFFFFFFFU;
    counter->control = ENABLE;
    last = counter->value;
  }
  const uint32_t now = counter->value;
  elapsed += last - now;
  last = now;
  return elapsed;
}
