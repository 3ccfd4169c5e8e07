/* The lanes for what the library is compiled for. */
#include "mellin/spectral/fft_lanes.h"

#if MELLIN_FFT_LANES > 1
#define MELLIN_LANES(name) mellin_lanes_##name
#include "kiss_lanes.h"
#endif
