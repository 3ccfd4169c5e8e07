# A board of your own: copy this folder, and see port/README.md. Everything that is to be changed is in it.
get_filename_component(here ${CMAKE_CURRENT_LIST_FILE} DIRECTORY)

# Sizes: nano or micro, and the bytes that map.elf gives the library (porttest.elf takes what its own map needs).
set(MELLIN_PROFILE nano)
set(MELLIN_ARENA_BYTES 393216)

# Console, files and exit through a debugger (semihosting), which needs nothing written; or through console.c.
option(MELLIN_TEMPLATE_SEMIHOSTING "The template's console is the debugger's" ON)
set(MELLIN_BOARD_SOURCES ${MELLIN_BARE_METAL}/cortex_m.c ${MELLIN_BARE_METAL}/start.c ${MELLIN_BARE_METAL}/libc.c
  ${MELLIN_BARE_METAL}/cxx_runtime.cpp ${here}/board.c)
if(MELLIN_TEMPLATE_SEMIHOSTING)
  list(APPEND MELLIN_BOARD_SOURCES ${MELLIN_BARE_METAL}/semihosting.c)
else()
  list(APPEND MELLIN_BOARD_SOURCES ${here}/console.c)
endif()

set(MELLIN_BOARD_PORT ${here}/port.c)
set(MELLIN_LINKER_SCRIPT ${here}/board.ld)
set(MELLIN_BOARD_LINK_OPTIONS --specs=nano.specs)
