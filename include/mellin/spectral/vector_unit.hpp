// The vector unit that the transforms and the other hot loops of this layer run on. Each gives the same bits: lanes are
// independent of each other, and nothing is fused or reordered.
#pragma once

#include <cstdint>

namespace mellin {

enum class VectorUnit : std::uint8_t {
  portable,  ///< what the library was compiled for: SSE2 on x86-64, NEON on AArch64, none on microcontrollers
  avx2       ///< x86-64: eight lanes in one register
};

/// The widest unit that this processor has, its operating system keeps, and this build has code for. Asks the
/// processor, which under a hypervisor may take microseconds: once at set-up, not in a loop.
VectorUnit best_vector_unit();

}  // namespace mellin
