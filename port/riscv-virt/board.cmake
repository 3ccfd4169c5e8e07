# The virt board of QEMU's 32-bit RISC-V.
set(MELLIN_PROFILE micro)
set(MELLIN_ARENA_BYTES 2097152)
set(MELLIN_BOARD_SOURCES ${MELLIN_BARE_METAL_SOURCES} ${CMAKE_CURRENT_SOURCE_DIR}/riscv-virt/reset.S
  ${CMAKE_CURRENT_SOURCE_DIR}/riscv-virt/counter.c)
set(MELLIN_BOARD_PORT ${MELLIN_BARE_METAL}/emulated_port.cpp)
set(MELLIN_LINKER_SCRIPT ${CMAKE_CURRENT_SOURCE_DIR}/riscv-virt/virt.ld)
set(MELLIN_BOARD_LINK_OPTIONS -Wl,--no-warn-rwx-segments) # one RAM holds all
