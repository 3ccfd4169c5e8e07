/* The board's console, files and exit through semihosting: requests that a debugger or an emulator answers. The
 * numbers and parameter blocks are those of ARM's "Semihosting for AArch32 and AArch64", which RISC-V took over. */
#include <stddef.h>
#include <string.h>

#include "board.h"

enum {
  SYS_OPEN = 0x01,
  SYS_CLOSE = 0x02,
  SYS_WRITE = 0x05,
  SYS_READ = 0x06,
  SYS_SEEK = 0x0A,
  SYS_GET_CMDLINE = 0x15,
  SYS_EXIT_EXTENDED = 0x20
};
enum { OPEN_READ_BINARY = 1, OPEN_WRITE = 4, OPEN_WRITE_BINARY = 5 };
enum { APPLICATION_EXIT = 0x20026 };

static uintptr_t request(uintptr_t operation, const void* block) {
#if defined(__arm__)
  register uintptr_t r0 __asm__("r0") = operation;
  register const void* r1 __asm__("r1") = block;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
#elif defined(__riscv)
  register uintptr_t a0 __asm__("a0") = operation;
  register const void* a1 __asm__("a1") = block;
  /* The emulator knows the request by the two shifts round the break, uncompressed and in one page. */
  __asm__ volatile(
      ".balign 16\n"
      ".option push\n"
      ".option norvc\n"
      "slli zero, zero, 0x1f\n"
      "ebreak\n"
      "srai zero, zero, 7\n"
      ".option pop\n"
      : "+r"(a0)
      : "r"(a1)
      : "memory");
  return a0;
#else
#error "no semihosting known for this processor"
#endif
}

int board_arguments(char* buffer, uint32_t size) {
  const uintptr_t block[2] = {(uintptr_t)buffer, size};
  return request(SYS_GET_CMDLINE, block) == 0 ? 0 : -1;
}

int board_open(const char* path, int mode) {
  const uintptr_t block[3] = {(uintptr_t)path, mode == BOARD_READ ? OPEN_READ_BINARY : OPEN_WRITE_BINARY, strlen(path)};
  return (int)request(SYS_OPEN, block);
}

uint32_t board_read(int file, void* buffer, uint32_t size) {
  const uintptr_t block[3] = {(uintptr_t)file, (uintptr_t)buffer, size};
  const uintptr_t missing = request(SYS_READ, block);
  return missing <= size ? size - (uint32_t)missing : 0;
}

uint32_t board_write(int file, const void* data, uint32_t size) {
  const uintptr_t block[3] = {(uintptr_t)file, (uintptr_t)data, size};
  const uintptr_t missing = request(SYS_WRITE, block);
  return missing <= size ? size - (uint32_t)missing : 0;
}

/* The special file that stands for the console: the standard output of whoever answers. */
void board_print(const char* text) {
  static int console = -1;
  if (console < 0) {
    static const char name[] = ":tt";
    const uintptr_t block[3] = {(uintptr_t)name, OPEN_WRITE, sizeof name - 1};
    console = (int)request(SYS_OPEN, block);
  }
  (void)board_write(console, text, (uint32_t)strlen(text));
}

int board_seek(int file, uint32_t position) {
  const uintptr_t block[2] = {(uintptr_t)file, position};
  return request(SYS_SEEK, block) == 0 ? 0 : -1;
}

int board_close(int file) {
  const uintptr_t block[1] = {(uintptr_t)file};
  return request(SYS_CLOSE, block) == 0 ? 0 : -1;
}

void board_exit(int status) {
  const uintptr_t block[2] = {APPLICATION_EXIT, (uintptr_t)status};
  for (;;) {
    (void)request(SYS_EXIT_EXTENDED, block);
  }
}
