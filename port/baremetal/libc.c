/* What newlib and picolibc ask for where the tests' own code takes memory from the heap, or ends. */
#include <errno.h>
#include <stddef.h>

#include "board.h"

extern char __heap_start[], __heap_end[];

void* sbrk(ptrdiff_t increment);
void* sbrk(ptrdiff_t increment) {
  static char* top = __heap_start;
  if (increment > __heap_end - top || increment < __heap_start - top) {
    errno = ENOMEM;
    return (void*)-1;
  }
  char* const before = top;
  top += increment;
  return before;
}
void* _sbrk(ptrdiff_t increment) __attribute__((alias("sbrk")));

void _exit(int status);
void _exit(int status) { board_exit(status); }

void abort(void) {
  board_print("aborted\n");
  board_exit(71);
}
