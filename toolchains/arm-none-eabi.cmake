# What the Cortex-M toolchains share: GCC for bare-metal ARM with newlib. The file of a core sets MELLIN_CPU_FLAGS and
# includes this one.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # a program needs a board's linker script

# Vector units round subnormals to zero, which the scalar ones do not: results would depend on what GCC vectorised.
set(MELLIN_TARGET_FLAGS "-mthumb ${MELLIN_CPU_FLAGS} -mfloat-abi=hard -ffunction-sections -fdata-sections -fno-tree-vectorize")
set(CMAKE_C_FLAGS_INIT "${MELLIN_TARGET_FLAGS}")
set(CMAKE_CXX_FLAGS_INIT "${MELLIN_TARGET_FLAGS}")
set(CMAKE_ASM_FLAGS_INIT "${MELLIN_TARGET_FLAGS}")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,--gc-sections")
