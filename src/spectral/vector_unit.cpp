#include "mellin/spectral/vector_unit.hpp"

#if defined(MELLIN_AVX2) && defined(__x86_64__)
#include <cpuid.h>
#endif

namespace mellin {

#if defined(MELLIN_AVX2) && defined(__x86_64__)

VectorUnit best_vector_unit() {
  constexpr unsigned kOsSavesRegisters = 1U << 27U;  // leaf 1, ecx: XGETBV may be asked
  constexpr unsigned kAvx2 = 1U << 5U;               // leaf 7, ebx
  constexpr unsigned kWideRegisters = 6U;            // XCR0: lower and upper halves of the registers are kept
  unsigned a = 0;
  unsigned b = 0;
  unsigned c = 0;
  unsigned d = 0;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & kOsSavesRegisters) == 0) {
    return VectorUnit::portable;
  }
  unsigned low = 0;
  unsigned high = 0;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  if ((low & kWideRegisters) != kWideRegisters || __get_cpuid_count(7, 0, &a, &b, &c, &d) == 0 || (b & kAvx2) == 0) {
    return VectorUnit::portable;
  }
  return VectorUnit::avx2;
}

#else

VectorUnit best_vector_unit() { return VectorUnit::portable; }

#endif

}  // namespace mellin
