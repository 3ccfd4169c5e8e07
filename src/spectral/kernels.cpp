// The hot loops for what the library is compiled for.
#include "spectral/kernels.hpp"

#define MELLIN_KERNELS portable_kernels
#define MELLIN_LANES(name) mellin_lanes_##name
#include "spectral/kernels_body.inc"
