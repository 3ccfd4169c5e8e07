# A board that has an operating system.
set(MELLIN_PROFILE micro)
set(MELLIN_ARENA_BYTES 16777216)
set(MELLIN_BOARD_SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/posix/board.c)
set(MELLIN_BOARD_PORT ${CMAKE_CURRENT_SOURCE_DIR}/posix/board_port.cpp ${CMAKE_CURRENT_SOURCE_DIR}/posix/clock.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/posix/entropy.cpp)
set(MELLIN_LINKER_SCRIPT "")
