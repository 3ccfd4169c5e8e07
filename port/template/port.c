/* The board's port: what the library asks of it (mellin/port.h has the contract, porttest.elf tests it). Firmware takes
 * this file as it is; the functions that are not written yet stop the program and say so. */
#include <stddef.h>

#include "board.h"
#include "board_port.h"
#include "not_written.h"

/* The part of the flash that maps are kept in; not where the image lies. Examples: internal flash of large sectors, 8
 * blocks of 131072 bytes, unit 32; external NOR flash, 2048 blocks of 4096 bytes, unit 256 (its page, or any power of
 * two below). Small units waste less. */
enum { FLASH_BLOCK_SIZE = 4096, FLASH_BLOCK_COUNT = 64, FLASH_PROGRAM_UNIT = 256, FLASH_ERASED = 0xFF };

/* Whether a call stays within the device; kept from wrapping round. */
static int outside(uint32_t address, uint32_t size) {
  const uint64_t all = (uint64_t)FLASH_BLOCK_SIZE * FLASH_BLOCK_COUNT;
  return address > all || size > all - address;
}

/* `context` is what board_port() puts into the struct: the driver's handle, where it needs one. */
static int flash_read(void* context, uint32_t address, void* buffer, uint32_t size) {
  (void)context;
  (void)buffer;
  if (outside(address, size)) {
    return -1;
  }
  NOT_WRITTEN("copy size bytes from address on, counted from the first of the map's blocks, to buffer; return 0");
}

static int flash_program(void* context, uint32_t address, const void* data, uint32_t size) {
  (void)context;
  (void)data;
  if (outside(address, size) || address % FLASH_PROGRAM_UNIT != 0 || size % FLASH_PROGRAM_UNIT != 0) {
    return -1;
  }
  NOT_WRITTEN(
      "program size bytes at address, page by page where the device wants it; wait; return 0, or -1 on its error");
}

static int flash_erase(void* context, uint32_t block) {
  (void)context;
  if (block >= FLASH_BLOCK_COUNT) {
    return -1;
  }
  NOT_WRITTEN(
      "erase the block, counted from the first of the map's blocks; wait; return 0, or -1 on the device's error");
}

static int flash_sync(void* context) {
  (void)context;
  NOT_WRITTEN("return 0 once all that was programmed is in the device; at once where program and erase wait for it");
}

static uint64_t now_us(void* context) {
  (void)context;
  NOT_WRITTEN("return microseconds since the start, 64 bits that never go back; or set port.clock to zeros");
}

static int entropy_fill(void* context, void* buffer, uint32_t size) {
  (void)context;
  (void)buffer;
  (void)size;
  NOT_WRITTEN("fill buffer from the chip's random generator and return 0; or set port.entropy to zeros");
}

/* Takes the library's warnings to wherever somebody reads them. */
static void log_write(void* context, mellin_log_level level, const char* line) {
  (void)context;
  board_print(level == MELLIN_LOG_WARNING ? "mellin: warning: " : "mellin: ");
  board_print(line);
  board_print("\n");
}

mellin_port board_port(void) {
  const mellin_port port = {
      .flash = {.context = NULL,
                .read = flash_read,
                .program = flash_program,
                .erase = flash_erase,
                .sync = flash_sync,
                .block_size = FLASH_BLOCK_SIZE,
                .block_count = FLASH_BLOCK_COUNT,
                .program_unit = FLASH_PROGRAM_UNIT,
                .erased_value = FLASH_ERASED},
      .clock = {NULL, now_us},
      .entropy = {NULL, entropy_fill},
      .log = {NULL, log_write},
  };
  return port;
}
