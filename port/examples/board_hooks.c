/* The examples' hooks over board.h. */
#include "board.h"
#include "example.h"

void example_print(const char* line) {
  board_print(line);
  board_print("\n");
}

/* Where the board counts instructions and no time: as if it did five hundred million of them a second. */
uint64_t example_now_us(void) {
  const uint32_t ticks_per_million = board_ticks_per_million();
  return ticks_per_million == 0 ? board_ticks() / 1000 : board_ticks() * 2000 / ticks_per_million;
}
