# Cortex-M4 with its single-precision floating-point unit.
set(MELLIN_CPU_FLAGS "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
