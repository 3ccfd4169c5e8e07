/* The board of the firmware images on a POSIX system: the same images run there as programs. */
#define _POSIX_C_SOURCE 200809L
#include "board.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

void board_print(const char* text) {
  fputs(text, stdout);
  fflush(stdout);
}

/* main() takes no arguments on a board; the kernel keeps them at hand. */
int board_arguments(char* buffer, uint32_t size) {
  const int file = open("/proc/self/cmdline", O_RDONLY | O_CLOEXEC);
  if (file < 0) {
    return -1;
  }
  const uint32_t got = board_read(file, buffer, size);
  close(file);
  if (got == 0 || got == size) {
    return -1;
  }
  for (uint32_t i = 0; i + 1 < got; ++i) {
    if (buffer[i] == '\0') {
      buffer[i] = ' ';
    }
  }
  buffer[got] = '\0';
  return 0;
}

int board_open(const char* path, int mode) {
  const int flags = mode == BOARD_READ ? O_RDONLY : O_WRONLY | O_CREAT | O_TRUNC;
  return open(path, flags | O_CLOEXEC, 0644);
}

uint32_t board_read(int file, void* buffer, uint32_t size) {
  uint32_t done = 0;
  while (done < size) {
    const ssize_t got = read(file, (char*)buffer + done, size - done);
    if (got <= 0) {
      break;
    }
    done += (uint32_t)got;
  }
  return done;
}

uint32_t board_write(int file, const void* data, uint32_t size) {
  uint32_t done = 0;
  while (done < size) {
    const ssize_t put = write(file, (const char*)data + done, size - done);
    if (put <= 0) {
      break;
    }
    done += (uint32_t)put;
  }
  return done;
}

int board_seek(int file, uint32_t position) { return lseek(file, (off_t)position, SEEK_SET) < 0 ? -1 : 0; }

int board_close(int file) { return close(file); }

/* No counter of instructions here: the processor's time. */
uint64_t board_ticks(void) {
  struct timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (uint64_t)now.tv_sec * 1000000000U + (uint64_t)now.tv_nsec;
}

uint32_t board_ticks_per_million(void) { return 0; }

uint32_t board_stack_size(void) { return 0; }
uint32_t board_stack_untouched(void) { return 0; }

void board_exit(int status) { exit(status); }
