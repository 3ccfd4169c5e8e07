#include "ram_flash.h"

#include <string.h>

static const uint8_t erased = 0xFF;

static int outside(uint32_t address, uint32_t size) {
  const uint32_t all = RAM_FLASH_BLOCK * RAM_FLASH_BLOCKS;
  return address > all || size > all - address;
}

static int flash_read(void* context, uint32_t address, void* buffer, uint32_t size) {
  const ram_flash* flash = context;
  if (outside(address, size)) {
    return -1;
  }
  memcpy(buffer, flash->bytes + address, size);
  return 0;
}

static int flash_program(void* context, uint32_t address, const void* data, uint32_t size) {
  ram_flash* flash = context;
  const uint8_t* from = data;
  uint32_t i;
  if (outside(address, size) || address % RAM_FLASH_PROGRAM_UNIT != 0 || size % RAM_FLASH_PROGRAM_UNIT != 0) {
    return -1;
  }
  for (i = 0; i < size; ++i) {
    flash->bytes[address + i] &= from[i]; /* programming takes bits away, erasing brings them back */
  }
  return 0;
}

static int flash_erase(void* context, uint32_t block) {
  ram_flash* flash = context;
  if (block >= RAM_FLASH_BLOCKS) {
    return -1;
  }
  memset(flash->bytes + block * RAM_FLASH_BLOCK, erased, RAM_FLASH_BLOCK);
  return 0;
}

static int flash_sync(void* context) {
  (void)context;
  return 0;
}

mellin_flash ram_flash_create(ram_flash* memory) {
  mellin_flash flash = {0};
  memset(memory->bytes, erased, sizeof memory->bytes);
  flash.context = memory;
  flash.read = flash_read;
  flash.program = flash_program;
  flash.erase = flash_erase;
  flash.sync = flash_sync;
  flash.block_size = RAM_FLASH_BLOCK;
  flash.block_count = RAM_FLASH_BLOCKS;
  flash.program_unit = RAM_FLASH_PROGRAM_UNIT;
  flash.erased_value = erased;
  return flash;
}
