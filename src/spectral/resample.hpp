// The two bilinear resamplings of the Fourier-Mellin transform: a picture turned about its centre, and rings of a
// magnitude spectrum.
#pragma once

#include <cstddef>

#include "mellin/core/math.hpp"
#include "mellin/core/span.hpp"
#include "mellin/grid/image.hpp"
#include "mellin/spectral/fft2.hpp"
#include "spectral/kernels.hpp"

namespace mellin {

/// Row `row` of `image` turned by the angle of `turn` about the middle of the picture, (side - 1) / 2; nothing beyond
/// its borders. `out` has side elements.
void turned_row(const ImageView& image, SinCosF turn, std::size_t row, const Kernels& kernels, float* out);

/// The magnitudes at `radius` [frequency bins], 0 … side / 2, in each of `directions` (re cosine, im sine, cosines not
/// negative). `magnitudes` is laid out as a spectrum is, see fft2.hpp. `out` has as many elements as `directions`.
void sample_ring(Span<const float> magnitudes, std::size_t side, float radius, Span<const Complex> directions,
                 float* out);

}  // namespace mellin
