#include "cmsdk_timer.h"

typedef struct registers {
  volatile uint32_t control;
  volatile uint32_t value;
  volatile uint32_t reload;
} registers;

enum { ENABLE = 1 };

uint64_t cmsdk_timer_ticks(uintptr_t base) {
  static uint64_t elapsed;
  static uint32_t last;
  registers* const timer = (registers*)base;
  if ((timer->control & ENABLE) == 0) {
    timer->reload = 0xFFFFFFFFU;
    timer->value = 0xFFFFFFFFU;
    timer->control = ENABLE;
    last = timer->value;
  }
  const uint32_t now = timer->value;
  elapsed += last - now;
  last = now;
  return elapsed;
}
