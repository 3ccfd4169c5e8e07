/* Reset and exceptions of a Cortex-M: the vector table, the floating-point unit switched on. */
#include <stdint.h>

#include "start.h"

extern uint32_t __stack_top[];

/* Coprocessor access control: full access to CP10 and CP11, the floating-point (and vector) unit. */
#define CPACR (*(volatile uint32_t*)0xE000ED88U)

void __reset(void) __attribute__((noreturn));
void __reset(void) {
  CPACR |= 0xFU << 20;
  __asm__ volatile("dsb\n\tisb" ::: "memory");
  start();
}

static void hard_fault(void) { fault("hard fault"); }
static void memory_fault(void) { fault("memory management fault"); }
static void bus_fault(void) { fault("bus fault"); }
static void usage_fault(void) { fault("usage fault"); }
static void unexpected(void) { fault("unexpected exception"); }

typedef union vector {
  const void* stack;
  void (*handler)(void);
} vector;

__attribute__((section(".vectors"), used)) static const vector vectors[16] = {{__stack_top},
                                                                              {.handler = __reset},
                                                                              {.handler = unexpected},
                                                                              {.handler = hard_fault},
                                                                              {.handler = memory_fault},
                                                                              {.handler = bus_fault},
                                                                              {.handler = usage_fault},
                                                                              {.handler = unexpected},
                                                                              {0},
                                                                              {0},
                                                                              {0},
                                                                              {.handler = unexpected},
                                                                              {.handler = unexpected},
                                                                              {0},
                                                                              {.handler = unexpected},
                                                                              {.handler = unexpected}};
