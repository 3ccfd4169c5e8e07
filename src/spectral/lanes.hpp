// Four FFTs side by side: KissFFT in vector lanes (kiss_lanes.c), and the ways into the lanes and out of them. A lane
// number is {re of four transforms, im of four transforms}, eight floats; unused lanes are zero.
#pragma once

#include "mellin/spectral/fft_lanes.h"

#if MELLIN_FFT_LANES == 4

#include <cstddef>
#include <cstring>

#include "mellin/core/span.hpp"
#include "mellin/spectral/fft2.hpp"

extern "C" {
void* mellin_lanes_fft_alloc(int n, int inverse, void* memory, std::size_t* bytes);
void* mellin_lanes_fftr_alloc(int n, int inverse, void* memory, std::size_t* bytes);
void mellin_lanes_fft(void* plan, const void* in, void* out);
void mellin_lanes_fftr(void* plan, const void* in, void* out);
void mellin_lanes_fftri(void* plan, const void* in, void* out);
}

namespace mellin::lanes {

using Vector = float __attribute__((vector_size(16)));

inline Vector load(const float* from) {
  Vector v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
inline void store(Vector v, float* to) { std::memcpy(to, &v, sizeof v); }

inline float* floats(Complex* z) { return reinterpret_cast<float*>(z); }
inline const float* floats(const Complex* z) { return reinterpret_cast<const float*>(z); }

inline void transpose(Vector& a, Vector& b, Vector& c, Vector& d) {
  const Vector ab_low = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const Vector ab_high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Vector cd_low = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Vector cd_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  a = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  c = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  d = __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7);
}

/// Four lines of `size` floats, `stride` apart, to `size` vectors. Of `used` < 4 lines the others are zero.
inline void gather(const float* lines, std::size_t stride, std::size_t size, std::size_t used, float* vectors) {
  if (used < 4) {
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t lane = 0; lane < 4; ++lane) {
        vectors[4 * i + lane] = lane < used ? lines[lane * stride + i] : 0.0F;
      }
    }
    return;
  }
  std::size_t i = 0;
  for (; i + 4 <= size; i += 4) {
    Vector a = load(lines + i);
    Vector b = load(lines + stride + i);
    Vector c = load(lines + 2 * stride + i);
    Vector d = load(lines + 3 * stride + i);
    transpose(a, b, c, d);
    store(a, vectors + 4 * i);
    store(b, vectors + 4 * i + 4);
    store(c, vectors + 4 * i + 8);
    store(d, vectors + 4 * i + 12);
  }
  for (; i < size; ++i) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      vectors[4 * i + lane] = lines[lane * stride + i];
    }
  }
}

/// The way back; lines from `used` on are not touched.
inline void scatter(const float* vectors, std::size_t stride, std::size_t size, std::size_t used, float* lines) {
  std::size_t i = 0;
  for (; used == 4 && i + 4 <= size; i += 4) {
    Vector a = load(vectors + 4 * i);
    Vector b = load(vectors + 4 * i + 4);
    Vector c = load(vectors + 4 * i + 8);
    Vector d = load(vectors + 4 * i + 12);
    transpose(a, b, c, d);
    store(a, lines + i);
    store(b, lines + stride + i);
    store(c, lines + 2 * stride + i);
    store(d, lines + 3 * stride + i);
  }
  for (; i < size; ++i) {
    for (std::size_t lane = 0; lane < used; ++lane) {
      lines[lane * stride + i] = vectors[4 * i + lane];
    }
  }
}

// A line of complex numbers is a line of twice as many floats, and transposing {re, im, re, im} of four columns gives
// two lane numbers.
inline void gather_columns(const Complex* columns, std::size_t side, std::size_t used, Complex* out) {
  gather(floats(columns), 2 * side, 2 * side, used, floats(out));
}
inline void scatter_columns(const Complex* in, std::size_t side, std::size_t used, Complex* columns) {
  scatter(floats(in), 2 * side, 2 * side, used, floats(columns));
}
inline void gather_rows(const float* rows, std::size_t side, std::size_t used, Complex* out) {
  gather(rows, side, side, used, floats(out));
}
inline void scatter_rows(const Complex* in, std::size_t side, std::size_t used, float* rows) {
  scatter(floats(in), side, side, used, rows);
}

/// From the transposed spectrum, where `used` rows lie side by side in each column.
inline void gather_row_spectra(const Complex* spectrum, std::size_t side, std::size_t used, Complex* out) {
  float* to = floats(out);
  for (std::size_t kx = 0; kx <= side / 2; ++kx, to += 8) {
    const Complex* const from = spectrum + kx * side;
    if (used == 4) {
      const Vector low = load(floats(from));
      const Vector high = load(floats(from) + 4);
      store(__builtin_shufflevector(low, high, 0, 2, 4, 6), to);
      store(__builtin_shufflevector(low, high, 1, 3, 5, 7), to + 4);
      continue;
    }
    for (std::size_t lane = 0; lane < 4; ++lane) {
      to[lane] = lane < used ? from[lane].re : 0.0F;
      to[lane + 4] = lane < used ? from[lane].im : 0.0F;
    }
  }
}
inline void scatter_row_spectra(const Complex* in, std::size_t side, std::size_t used, Complex* spectrum) {
  const float* from = floats(in);
  for (std::size_t kx = 0; kx <= side / 2; ++kx, from += 8) {
    Complex* const to = spectrum + kx * side;
    if (used == 4) {
      const Vector re = load(from);
      const Vector im = load(from + 4);
      store(__builtin_shufflevector(re, im, 0, 4, 1, 5), floats(to));
      store(__builtin_shufflevector(re, im, 2, 6, 3, 7), floats(to) + 4);
      continue;
    }
    for (std::size_t lane = 0; lane < used; ++lane) {
      to[lane] = {from[lane], from[lane + 4]};
    }
  }
}

inline bool plan_complex(int n, bool inverse, Span<std::byte> memory) {
  std::size_t bytes = memory.size();
  return memory.data() != nullptr && mellin_lanes_fft_alloc(n, inverse ? 1 : 0, memory.data(), &bytes) != nullptr;
}
inline bool plan_real(int n, bool inverse, Span<std::byte> memory) {
  std::size_t bytes = memory.size();
  return memory.data() != nullptr && mellin_lanes_fftr_alloc(n, inverse ? 1 : 0, memory.data(), &bytes) != nullptr;
}

inline void transform(Span<std::byte> plan, const Complex* in, Complex* out) { mellin_lanes_fft(plan.data(), in, out); }
inline void transform_real(Span<std::byte> plan, const Complex* in, Complex* out) {
  mellin_lanes_fftr(plan.data(), in, out);
}
inline void transform_to_real(Span<std::byte> plan, const Complex* in, Complex* out) {
  mellin_lanes_fftri(plan.data(), in, out);
}

}  // namespace mellin::lanes

#endif
