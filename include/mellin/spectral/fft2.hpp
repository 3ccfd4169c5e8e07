// 2D FFT of square real images over KissFFT: rows by the real transform, columns by the complex one, plans in the
// caller's memory, every pass callable in parts.
//
// A spectrum is kept transposed: the coefficient of the frequencies (kx, ky), kx = 0 … side / 2 along the columns of
// the image and ky = 0 … side - 1 along its rows (ky over side / 2 meaning ky - side), lies at [kx * side + ky]. The
// other half follows from F(-k) = conj(F(k)). Neither direction is scaled: inverse(forward(x)) is side * side * x.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"

namespace mellin {

struct Complex {
  float re = 0.0F;
  float im = 0.0F;
};

/// Sides that the transform takes: even, 32 … 1024, no prime factor over 5 (for others KissFFT needs a heap).
constexpr bool is_fft_side(std::uint32_t side) {
  if (side < 32 || side > 1024 || side % 2 != 0) {
    return false;
  }
  for (std::uint32_t factor : {2U, 3U, 5U}) {
    while (side % factor == 0) {
      side /= factor;
    }
  }
  return side == 1;
}

/// Coefficients in the spectrum of an image.
constexpr std::size_t spectrum_size(std::uint16_t side) { return std::size_t{side} * (side / 2U + 1U); }

/// Bytes of KissFFT's plan for `n` complex points: its state (66 ints) and n twiddle factors.
constexpr std::size_t complex_plan_bytes(std::size_t n) { return 66 * sizeof(int) + n * sizeof(Complex); }
/// Bytes of KissFFT's plan for `n` real points: three pointers, the plan for n / 2 complex ones, n / 2 of buffer and
/// n / 4 twiddle factors.
constexpr std::size_t real_plan_bytes(std::size_t n) {
  return 3 * sizeof(void*) + complex_plan_bytes(n / 2) + (n / 2 * 3 / 2) * sizeof(Complex);
}

class Fft2 {
 public:
  /// Rows that are transformed together, so that the transposed spectrum is touched by whole cache lines.
  static constexpr std::size_t kBlock = 8;

  struct Memory {
    Span<std::byte> real_forward;
    Span<std::byte> real_inverse;
    Span<std::byte> complex_forward;
    Span<std::byte> complex_inverse;
    Span<Complex> block;  ///< kBlock rows of a spectrum
    Span<Complex> line;   ///< a column of a spectrum
  };

  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t side) {
    Memory m;
    m.real_forward = arena.template take<std::byte>(real_plan_bytes(side), Part::spectral, Region::fast);
    m.real_inverse = arena.template take<std::byte>(real_plan_bytes(side), Part::spectral, Region::fast);
    m.complex_forward = arena.template take<std::byte>(complex_plan_bytes(side), Part::spectral, Region::fast);
    m.complex_inverse = arena.template take<std::byte>(complex_plan_bytes(side), Part::spectral, Region::fast);
    m.block = arena.template take<Complex>(kBlock * (side / 2U + 1U), Part::spectral, Region::fast);
    m.line = arena.template take<Complex>(side, Part::spectral, Region::fast);
    return m;
  }

  /// Plans for `side`. invalid_config: not is_fft_side(). insufficient_memory: `memory` was carved for another side.
  Status init(std::uint16_t side, const Memory& memory);
  std::uint16_t side() const { return side_; }

  /// Transforms `count` <= kBlock rows (contiguous, image rows from `first` on) into row spectra within `spectrum`.
  void forward_rows(const float* rows, std::size_t first, std::size_t count, Span<Complex> spectrum);
  /// Finishes the columns kx in [first, first + count) of a spectrum whose rows are all there, in place.
  void forward_columns(Span<Complex> spectrum, std::size_t first, std::size_t count);
  /// Begins the way back with the columns kx in [first, first + count), in place.
  void inverse_columns(Span<Complex> spectrum, std::size_t first, std::size_t count);
  /// Image rows [first, first + count), count <= kBlock, of a spectrum whose columns are all back; `rows` contiguous.
  void inverse_rows(Span<const Complex> spectrum, std::size_t first, std::size_t count, float* rows);

  /// One column: `in` and `out` have side elements each and do not overlap.
  void forward_column(const Complex* in, Complex* out) const;
  void inverse_column(const Complex* in, Complex* out) const;
  /// One line of `side` real numbers to its side / 2 + 1 coefficients, and back; no overlap.
  void forward_line(const float* in, Complex* out) const;
  void inverse_line(const Complex* in, float* out) const;

  /// The whole transform: `image` side * side, `spectrum` spectrum_size(side). invalid_argument: other sizes.
  Status forward(Span<const float> image, Span<Complex> spectrum);
  /// The whole way back; destroys `spectrum`. invalid_argument: other sizes.
  Status inverse(Span<Complex> spectrum, Span<float> image);

 private:
  Memory memory_;
  std::uint16_t side_ = 0;
};

}  // namespace mellin
