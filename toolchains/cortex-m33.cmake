# Cortex-M33 with its floating-point unit.
set(MELLIN_CPU_FLAGS "-mcpu=cortex-m33 -mfpu=fpv5-sp-d16")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
