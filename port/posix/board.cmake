# A board that has an operating system.
set(MELLIN_PROFILE micro)
set(MELLIN_ARENA_BYTES 16777216)
set(MELLIN_BOARD_SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/posix/board.c)
set(MELLIN_LINKER_SCRIPT "")
