# The virt board of QEMU's 32-bit RISC-V.
set(MELLIN_PROFILE micro)
set(MELLIN_BOARD_SOURCES ${MELLIN_BARE_METAL_SOURCES} ${CMAKE_CURRENT_SOURCE_DIR}/riscv-virt/reset.S
  ${CMAKE_CURRENT_SOURCE_DIR}/riscv-virt/counter.c)
set(MELLIN_LINKER_SCRIPT ${CMAKE_CURRENT_SOURCE_DIR}/riscv-virt/virt.ld)
