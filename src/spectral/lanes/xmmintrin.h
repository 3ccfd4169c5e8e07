/* Found by KissFFT's USE_SIMD build instead of the compiler's own: floats side by side for any vector unit, aligned as
   the arena aligns. */
#ifndef MELLIN_LANES_XMMINTRIN_H
#define MELLIN_LANES_XMMINTRIN_H

#include "mellin/spectral/fft_lanes.h"

typedef float __m128 __attribute__((vector_size(4 * MELLIN_FFT_LANES), aligned(8), may_alias));

static inline __m128 _mm_set1_ps(double value) {
  const float v = (float)value;
#if MELLIN_FFT_LANES == 8
  return (__m128){v, v, v, v, v, v, v, v};
#else
  return (__m128){v, v, v, v};
#endif
}

#endif
