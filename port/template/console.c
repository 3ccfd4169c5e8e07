/* The board's console, arguments, files and exit without a debugger (MELLIN_TEMPLATE_SEMIHOSTING=OFF). There is nothing
 * to print on before put() is written, so it stops the processor with the message at hand. */
#include <stddef.h>

#include "board.h"

/* What the debugger shows when the processor has stopped in put(). */
const char* volatile board_message;

static void put(char character) {
  (void)character;
  board_message = "console.c: put is not written yet: wait until the UART takes a byte, and give it this one";
  for (;;) {
    __asm__ volatile("bkpt 1");
  }
}

void board_print(const char* text) {
  for (; *text != '\0'; ++text) {
    if (*text == '\n') {
      put('\r'); /* as terminals have it */
    }
    put(*text);
  }
}

/* The image's command line: none, unless the board gets one from somewhere. map.elf needs it. */
int board_arguments(char* buffer, uint32_t size) {
  (void)buffer;
  (void)size;
  return -1;
}

/* Files: none. map.elf needs them, on an SD card for instance; porttest.elf and selftest.elf do not. */
int board_open(const char* path, int mode) {
  (void)path;
  (void)mode;
  return -1;
}

uint32_t board_read(int file, void* buffer, uint32_t size) {
  (void)file;
  (void)buffer;
  (void)size;
  return 0;
}

uint32_t board_write(int file, const void* data, uint32_t size) {
  (void)file;
  (void)data;
  (void)size;
  return 0;
}

int board_seek(int file, uint32_t position) {
  (void)file;
  (void)position;
  return -1;
}

int board_close(int file) {
  (void)file;
  return -1;
}

/* There is nowhere to go: the status is printed, and the processor sleeps. */
void board_exit(int status) {
  board_print(status == 0 ? "ended well\n" : "ended with a failure\n");
  for (;;) {
    __asm__ volatile("wfi");
  }
}
