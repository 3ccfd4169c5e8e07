/* What the firmware images of port/images ask of a board: a console, files of the machine that debugs or emulates it, a
 * counter, and the way out. The library knows nothing of this; what it asks of a platform is mellin/port.h. A real
 * board answers through its debugger's semihosting, or with an UART and a RAM disk. */
#ifndef MELLIN_BOARD_H
#define MELLIN_BOARD_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Writes to the console. */
void board_print(const char* text);

/* The command line: words with single spaces between them, zero-terminated; the first is the program. Returns 0, or -1
 * where there is none or it does not fit. */
int board_arguments(char* buffer, uint32_t size);

/* Files of the host. */
enum { BOARD_READ = 0, BOARD_WRITE = 1 };
/* Returns a handle of 0 or more, or -1. */
int board_open(const char* path, int mode);
/* Returns the bytes read or written, fewer at the end of the file or where it failed. */
uint32_t board_read(int file, void* buffer, uint32_t size);
uint32_t board_write(int file, const void* data, uint32_t size);
/* Returns 0, or -1. */
int board_seek(int file, uint32_t position);
int board_close(int file);

/* A counter that runs with the instructions executed, and never back. */
uint64_t board_ticks(void);
/* Its ticks for a million instructions; 0 where it counts something else (nanoseconds of processor time). */
uint32_t board_ticks_per_million(void);

/* The stack: bytes there are, and bytes never touched since the start (it is painted then). 0 where not known. */
uint32_t board_stack_size(void);
uint32_t board_stack_untouched(void);

/* Ends the program with an exit status. */
void board_exit(int status) __attribute__((noreturn));

#ifdef __cplusplus
}
#endif

#endif
