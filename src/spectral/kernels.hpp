// The hot loops of this layer, compiled once for each vector unit (vector_unit.hpp) from one text, kernels_body.inc.
// Each kernel gives the same bits on every unit.
#pragma once

#include <cstddef>

#include "mellin/spectral/fft2.hpp"
#include "mellin/spectral/vector_unit.hpp"

namespace mellin {

/// A row of a turned picture: the first pixel of a run that comes from inside the picture, and how many there are.
struct TurnedRun {
  const float* pixels;  ///< of the picture
  int side;
  float x;  ///< where the row's centre comes from: column + 1, row + 1
  float y;
  float cos;
  float sin;
  float centre;  ///< column of the row's centre
};

struct Kernels {
#if MELLIN_FFT_LANES > 1
  /// `count` <= kFftLanes lines of `side` complex numbers, contiguous in `in` and in `out`, which may be the same.
  void (*lines)(const Fft2::LanePlan& plan, const Complex* in, std::size_t side, std::size_t count, Complex* out);
  /// `count` <= kFftLanes rows of `side` real numbers into a spectrum, as Fft2::forward_rows() leaves them …
  void (*forward_rows)(const Fft2::LanePlan& plan, const float* rows, std::size_t side, std::size_t count,
                       Complex* spectrum);
  /// … and back, as Fft2::inverse_rows() takes them.
  void (*inverse_rows)(const Fft2::LanePlan& plan, const Complex* spectrum, std::size_t side, std::size_t count,
                       float* rows);
  /// The same, but leaves the rows in the lanes of plan.out, and each one's largest value, or 0, in `maxima`.
  void (*inverse_rows_search)(const Fft2::LanePlan& plan, const Complex* spectrum, std::size_t side, std::size_t count,
                              float* maxima);
#endif
  /// z / (|z| + floor), in place.
  void (*whiten)(Complex* values, std::size_t count, float floor);
  /// straight = filter conj(w), half_turned = filter w. No overlap.
  void (*cross)(const Complex* filter, const Complex* w, std::size_t count, Complex* straight, Complex* half_turned);
  /// Columns [begin, end) of a row of a turned picture, all of which come from inside it.
  void (*turned_run)(const TurnedRun& from, std::size_t begin, std::size_t end, float* out);
};

const Kernels& portable_kernels();
const Kernels& avx2_kernels();  // only where the build has it

/// The portable ones where the build has none for `unit`.
inline const Kernels& kernels_of(VectorUnit unit) {
#ifdef MELLIN_AVX2
  return unit == VectorUnit::avx2 ? avx2_kernels() : portable_kernels();
#else
  static_cast<void>(unit);
  return portable_kernels();
#endif
}

}  // namespace mellin
