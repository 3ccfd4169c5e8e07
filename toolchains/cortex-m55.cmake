# Cortex-M55.
set(MELLIN_CPU_FLAGS "-mcpu=cortex-m55")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
