/* The board's counter: the system counter of the Corstone SSE-300, through its first timer. Emulated with -icount, it
 * runs with the instructions. */
#include <stdint.h>

#include "board.h"

#define COUNTER_CONTROL (*(volatile uint32_t*)0x58100000U) /* secure aliases */
#define COUNT_LOW (*(volatile uint32_t*)0x58000000U)
#define COUNT_HIGH (*(volatile uint32_t*)0x58000004U)

enum { ENABLE = 1 };

uint64_t board_ticks(void) {
  COUNTER_CONTROL = ENABLE;
  uint32_t high = COUNT_HIGH;
  for (;;) {
    const uint32_t low = COUNT_LOW;
    const uint32_t again = COUNT_HIGH;
    if (again == high) {
      return (uint64_t)high << 32 | low;
    }
    high = again;
  }
}
