/* How many FFTs run side by side in the lanes of a vector: 8 on x86-64 (two registers of SSE2 or one of AVX2), 4 on
   AArch64, whose vector units round as their scalar ones do, else 1. Units that flush denormals (NEON on 32-bit ARM,
   MVE) would give other bits. A build may set 1 to save the plans and buffers of the lanes, with the same results. */
#ifndef MELLIN_SPECTRAL_FFT_LANES_H
#define MELLIN_SPECTRAL_FFT_LANES_H

#ifndef MELLIN_FFT_LANES
#if defined(__SSE2__)
#define MELLIN_FFT_LANES 8
#elif defined(__aarch64__)
#define MELLIN_FFT_LANES 4
#else
#define MELLIN_FFT_LANES 1
#endif
#endif

#endif
