/* KissFFT once more, four transforms side by side in the lanes of a vector, where the processor has one that rounds as
   its scalar unit does. Each lane gives the bits that the plain build gives. */
#include "mellin/spectral/fft_lanes.h"

#if MELLIN_FFT_LANES == 4

#define USE_SIMD
#define KISS_FFT_ALIGN_CHECK(pointer)
#define KISS_FFT_ALIGN_SIZE_UP(size) (size)
#define kiss_fft mellin_lanes_fft
#define kiss_fft_alloc mellin_lanes_fft_alloc
#define kiss_fft_stride mellin_lanes_fft_stride
#define kiss_fft_cleanup mellin_lanes_fft_cleanup
#define kiss_fft_next_fast_size mellin_lanes_fft_next_fast_size
#define kiss_fftr mellin_lanes_fftr
#define kiss_fftr_alloc mellin_lanes_fftr_alloc
#define kiss_fftri mellin_lanes_fftri

#include <kiss_fft.c>
#include <kiss_fftr.c>

#endif
