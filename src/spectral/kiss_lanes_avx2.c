/* The lanes for AVX2, with which this file alone is compiled. */
#include "mellin/spectral/fft_lanes.h"

#if MELLIN_FFT_LANES == 8 && defined(__AVX2__)
#define MELLIN_LANES(name) mellin_avx2_##name
#include "kiss_lanes.h"
#endif
