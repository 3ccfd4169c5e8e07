/* Found by KissFFT's USE_SIMD build instead of the compiler's own: four floats side by side for any vector unit,
   aligned as the arena aligns. */
#ifndef MELLIN_LANES_XMMINTRIN_H
#define MELLIN_LANES_XMMINTRIN_H

typedef float __m128 __attribute__((vector_size(16), aligned(8), may_alias));

static inline __m128 _mm_set1_ps(double value) {
  const float v = (float)value;
  return (__m128){v, v, v, v};
}

#endif
