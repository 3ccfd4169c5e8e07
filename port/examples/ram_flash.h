/* Flash in RAM, for boards that have none to spare: what lies in it is gone with the power. */
#ifndef MELLIN_RAM_FLASH_H
#define MELLIN_RAM_FLASH_H

#include "mellin/port.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RAM_FLASH_BLOCK = 4096, RAM_FLASH_BLOCKS = 64, RAM_FLASH_PROGRAM_UNIT = 16 };

typedef struct ram_flash {
  uint8_t bytes[RAM_FLASH_BLOCK * RAM_FLASH_BLOCKS];
} ram_flash;

/* Erases all of it and gives the port's part; `memory` stays the caller's and must outlive it. */
mellin_flash ram_flash_create(ram_flash* memory);

#ifdef __cplusplus
}
#endif

#endif
