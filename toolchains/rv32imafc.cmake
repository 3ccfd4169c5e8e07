# 32-bit RISC-V with single-precision floating point, bare metal, GCC with picolibc.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR riscv32)
set(CMAKE_C_COMPILER riscv64-unknown-elf-gcc)
set(CMAKE_CXX_COMPILER riscv64-unknown-elf-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # a program needs a board's linker script

set(MELLIN_TARGET_FLAGS "-march=rv32imafc -mabi=ilp32f -mcmodel=medany --specs=picolibc.specs -ffunction-sections -fdata-sections")
# Debian has no C++ library for bare-metal RISC-V. The headers of the one for ARM serve: the library uses nothing else
# of it, and they hold nothing of the machine.
file(GLOB MELLIN_CXX_HEADERS /usr/include/newlib/c++/*/algorithm)
if(NOT MELLIN_CXX_HEADERS)
  message(FATAL_ERROR "no C++ headers in /usr/include/newlib/c++: install libstdc++-arm-none-eabi-newlib")
endif()
list(GET MELLIN_CXX_HEADERS -1 MELLIN_CXX_HEADERS)
get_filename_component(MELLIN_CXX_HEADERS ${MELLIN_CXX_HEADERS} DIRECTORY)
set(CMAKE_C_FLAGS_INIT "${MELLIN_TARGET_FLAGS}")
set(CMAKE_CXX_FLAGS_INIT "${MELLIN_TARGET_FLAGS} -isystem ${MELLIN_CXX_HEADERS} -isystem ${MELLIN_CXX_HEADERS}/arm-none-eabi/thumb/nofp")
set(CMAKE_ASM_FLAGS_INIT "${MELLIN_TARGET_FLAGS}")
