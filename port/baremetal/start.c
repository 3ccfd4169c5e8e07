/* From the reset handler to main(): memory as C and C++ expect it, and a painted stack. Symbols in double underscores
 * are the linker script's (sections.ld). */
#include "start.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "board.h"

extern uint32_t __data_load[], __data_start[], __data_end[];
extern uint32_t __bss_start[], __bss_end[];
extern uint32_t __stack_bottom[], __stack_top[];
extern void (*__init_array_start[])(void);
extern void (*__init_array_end[])(void);

int main(void);

static const uint32_t kPaint = 0x5AFEC0DEU;

/* What is above the address here is in use by the start-up itself. */
static void paint_stack(void) {
  const uintptr_t in_use = (uintptr_t)__builtin_frame_address(0) - 64;
  for (uint32_t* word = __stack_bottom; (uintptr_t)word < in_use; ++word) {
    *word = kPaint;
  }
}

/* Most boards need nothing. */
__attribute__((weak)) void board_initialise(void) {}

void start(void) {
  board_initialise();
  memcpy(__data_start, __data_load, (size_t)((char*)__data_end - (char*)__data_start));
  memset(__bss_start, 0, (size_t)((char*)__bss_end - (char*)__bss_start));
  paint_stack();
  const size_t constructors = (size_t)(__init_array_end - __init_array_start);
  for (size_t i = 0; i < constructors; ++i) {
    __init_array_start[i]();
  }
  board_exit(main());
}

uint32_t board_stack_size(void) { return (uint32_t)((char*)__stack_top - (char*)__stack_bottom); }

uint32_t board_stack_untouched(void) {
  const uint32_t* word = __stack_bottom;
  while (word < __stack_top && *word == kPaint) {
    ++word;
  }
  return (uint32_t)((const char*)word - (const char*)__stack_bottom);
}

void fault(const char* what) {
  board_print("stopped by a ");
  board_print(what);
  board_print("\n");
  board_exit(70);
}
