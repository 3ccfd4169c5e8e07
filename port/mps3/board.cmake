# ARM's MPS3 board as QEMU emulates it, with the FPGA image of application note AN547.
set(MELLIN_PROFILE micro)
set(MELLIN_ARENA_BYTES 2097152)
set(MELLIN_BOARD_SOURCES ${MELLIN_CORTEX_M_SOURCES} ${CMAKE_CURRENT_SOURCE_DIR}/mps3/counter_sse300.c)
set(MELLIN_BOARD_PORT ${MELLIN_BARE_METAL}/emulated_port.cpp)
set(MELLIN_LINKER_SCRIPT ${CMAKE_CURRENT_SOURCE_DIR}/mps3/an547.ld)
set(MELLIN_BOARD_LINK_OPTIONS --specs=nano.specs)
