# Cortex-M7; the single-precision unit, which every M7 with a floating-point unit has.
set(MELLIN_CPU_FLAGS "-mcpu=cortex-m7 -mfpu=fpv5-sp-d16")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
