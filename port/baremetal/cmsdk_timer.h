/* A timer of ARM's Cortex-M System Design Kit as the board's counter: 32 bits, counting down with the processor's clock,
 * extended to 64 bits by whoever reads it often enough (a 32-bit round lasts 2.7 thousand million instructions). */
#ifndef MELLIN_CMSDK_TIMER_H
#define MELLIN_CMSDK_TIMER_H

#include <stdint.h>

/* Ticks since the first call, at the timer with the given base address. */
uint64_t cmsdk_timer_ticks(uintptr_t base);

#endif
