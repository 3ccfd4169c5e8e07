/* KissFFT once more, several transforms side by side in the lanes of a vector, where the processor has one that rounds
   as its scalar unit does. Each lane gives the bits that the plain build gives. MELLIN_LANES(name) is what the file
   that includes this calls its copy's functions. */
#include "mellin/spectral/fft_lanes.h"

#define USE_SIMD
#define KISS_FFT_ALIGN_CHECK(pointer)
#define KISS_FFT_ALIGN_SIZE_UP(size) (size)
#define kiss_fft MELLIN_LANES(fft)
#define kiss_fft_alloc MELLIN_LANES(fft_alloc)
#define kiss_fft_stride MELLIN_LANES(fft_stride)
#define kiss_fft_cleanup MELLIN_LANES(fft_cleanup)
#define kiss_fft_next_fast_size MELLIN_LANES(fft_next_fast_size)
#define kiss_fftr MELLIN_LANES(fftr)
#define kiss_fftr_alloc MELLIN_LANES(fftr_alloc)
#define kiss_fftri MELLIN_LANES(fftri)

#include <kiss_fft.c>
#include <kiss_fftr.c>
