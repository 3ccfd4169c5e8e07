# ARM's MPS3 board as QEMU emulates it, with the FPGA image of application note AN547.
set(MELLIN_PROFILE micro)
set(MELLIN_ARENA_BYTES 2097152)
set(MELLIN_BOARD_SOURCES ${MELLIN_CORTEX_M_SOURCES} ${MELLIN_BARE_METAL}/counter_cmsdk.c)
set(MELLIN_CMSDK_TIMER 0x58000000) # the secure alias
set(MELLIN_LINKER_SCRIPT ${CMAKE_CURRENT_SOURCE_DIR}/mps3/an547.ld)
set(MELLIN_BOARD_LINK_OPTIONS --specs=nano.specs)
