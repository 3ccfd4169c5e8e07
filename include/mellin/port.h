/* What the library asks of a platform: a flash device, a monotonic clock, entropy and a log sink. Plain C: function
 * pointers and a context, all owned by the caller and alive as long as what was created with them. The library calls
 * nothing else of a platform. Functions return 0 for success, a negative number of the port's own for an error; the
 * library passes it on as Status::device_error and keeps what it had. A struct of zeros is a port without that part. */
#ifndef MELLIN_PORT_H
#define MELLIN_PORT_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Raw flash. Addresses are bytes from the start of the device. What reaches outside of it is refused, with nothing
 * touched. Buffers have any alignment. port/conformance tests a device for all that is said here. */
typedef struct mellin_flash {
  void* context;
  /* Copies `size` bytes from `address` to `buffer`. Any address and size inside the device. */
  int (*read)(void* context, uint32_t address, void* buffer, uint32_t size);
  /* Programs `size` bytes at `address`, both multiples of program_unit, into space erased since it was last
   * programmed; elsewhere it may fail or spoil what was there, but nothing beside it. A power cut meanwhile may leave
   * any of the bits programmed. */
  int (*program)(void* context, uint32_t address, const void* data, uint32_t size);
  /* Erases block number `block`: afterwards each of its bytes reads erased_value. */
  int (*erase)(void* context, uint32_t block);
  /* Returns when everything programmed or erased before survives a power cut. */
  int (*sync)(void* context);
  uint32_t block_size;   /* bytes an erase takes; a multiple of program_unit */
  uint32_t block_count;  /* at least 2; 0: there is no flash */
  uint32_t program_unit; /* bytes a program takes at least: 1 to 2048, a power of two */
  uint8_t erased_value;  /* 0xFF for NOR and NAND */
} mellin_flash;

typedef struct mellin_clock {
  void* context;
  /* Microseconds since any fixed moment; never goes back. Used for statistics only, never for results. */
  uint64_t (*now_us)(void* context);
} mellin_clock;

typedef struct mellin_entropy {
  void* context;
  /* Fills `buffer` with `size` unpredictable bytes, for the UUIDs of mapping sessions. */
  int (*fill)(void* context, void* buffer, uint32_t size);
} mellin_entropy;

typedef enum mellin_log_level { MELLIN_LOG_DEBUG = 0, MELLIN_LOG_INFO = 1, MELLIN_LOG_WARNING = 2 } mellin_log_level;

typedef struct mellin_log {
  void* context;
  /* `line` is zero-terminated, without a newline, and valid during the call only. */
  void (*write)(void* context, mellin_log_level level, const char* line);
} mellin_log;

typedef struct mellin_port {
  mellin_flash flash;
  mellin_clock clock;
  mellin_entropy entropy;
  mellin_log log;
} mellin_port;

#ifdef __cplusplus
}
#endif

#endif
