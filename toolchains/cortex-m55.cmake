# Cortex-M55. Debian's assembler (2.40) takes the conditional instruction vcvtne.f32.u32 for a rounding mode of the
# vector unit and refuses it: no conditional instructions from branches.
set(MELLIN_CPU_FLAGS "-mcpu=cortex-m55 -fno-if-conversion -fno-if-conversion2")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
