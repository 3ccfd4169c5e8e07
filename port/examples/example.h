/* What the examples ask of a board, and main() of its start-up code. Beside that they use the library alone: no
 * operating system, no stdio, no heap. An example returns 0 and prints `passed` last, or 1 and `failed: why`. */
#ifndef MELLIN_EXAMPLE_H
#define MELLIN_EXAMPLE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Shows a line; it is zero-terminated, without a newline. */
void example_print(const char* line);

/* Microseconds that this program has had the processor, from any fixed moment on; never goes back. */
uint64_t example_now_us(void);

#ifdef __cplusplus
}
#endif

#endif
