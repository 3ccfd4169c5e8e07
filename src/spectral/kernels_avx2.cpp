// The hot loops for AVX2, with which this file alone is compiled. It must define nothing that another file may define
// too: the linker would keep either, and processors without AVX2 would meet these instructions.
#include "spectral/kernels.hpp"

#if defined(MELLIN_AVX2) && defined(__AVX2__)
#define MELLIN_KERNELS avx2_kernels
#define MELLIN_LANES(name) mellin_avx2_##name
#include "spectral/kernels_body.inc"
#endif
