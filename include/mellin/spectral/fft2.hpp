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
#include "mellin/spectral/fft_lanes.h"
#include "mellin/spectral/vector_unit.hpp"

namespace mellin {

struct Kernels;

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

/// Transforms that run side by side.
inline constexpr std::size_t kFftLanes = MELLIN_FFT_LANES;

/// Bytes of KissFFT's plan for `n` complex points: its state (66 ints) and n twiddle factors, one a lane.
constexpr std::size_t complex_plan_bytes(std::size_t n, std::size_t lanes = 1) {
  return 66 * sizeof(int) + n * lanes * sizeof(Complex);
}
/// Bytes of KissFFT's plan for `n` real points: three pointers (and one of padding with lanes), the plan for n / 2
/// complex ones, n / 2 of buffer and n / 4 twiddle factors.
constexpr std::size_t real_plan_bytes(std::size_t n, std::size_t lanes = 1) {
  return (lanes > 1 ? 4 : 3) * sizeof(void*) + complex_plan_bytes(n / 2, lanes) +
         (n / 2 * 3 / 2) * lanes * sizeof(Complex);
}

class Fft2 {
  /// Lanes as wide as half a cache line are slower where they lie across two. The arena aligns to 8 bytes: so many more
  /// are taken for each array of lanes, and init() aligns it.
  static constexpr std::size_t kLaneBytes = kFftLanes * sizeof(float);
  static constexpr std::size_t kSlack = kLaneBytes > kArenaAlignment ? kLaneBytes - kArenaAlignment : 0;

 public:
  /// Rows that are transformed together at most, so that the transposed spectrum is touched by whole cache lines.
  static constexpr std::size_t kBlock = 8;

  struct Memory {
    Span<std::byte> line_forward;  ///< plans for one line of real numbers …
    Span<std::byte> line_inverse;
    Span<std::byte> rows_forward;  ///< … for kFftLanes of them (none where that is 1) …
    Span<std::byte> rows_inverse;
    Span<std::byte> columns_forward;  ///< … and for kFftLanes lines of complex ones
    Span<std::byte> columns_inverse;
    Span<Complex> in;  ///< kBlock row spectra, or kFftLanes columns
    Span<Complex> out;
  };

  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t side) {
    return carve(arena, arena, side);
  }
  /// Plans from `tables`, where they stay; the lines under way from `work`, which is free between calls.
  template <class A, class W>
  static constexpr Memory carve(A& tables, W& work, std::uint16_t side) {
    const std::size_t rows_bytes = kFftLanes > 1 ? real_plan_bytes(side, kFftLanes) + kSlack : 0;
    const std::size_t columns_bytes = complex_plan_bytes(side, kFftLanes) + kSlack;
    const std::size_t block = kFftLanes > 1 ? kFftLanes * side + kSlack / sizeof(Complex) : kBlock * (side / 2U + 1U);
    Memory m;
    m.line_forward = tables.template take<std::byte>(real_plan_bytes(side), Part::spectral, Region::fast);
    m.line_inverse = tables.template take<std::byte>(real_plan_bytes(side), Part::spectral, Region::fast);
    m.rows_forward = tables.template take<std::byte>(rows_bytes, Part::spectral, Region::fast);
    m.rows_inverse = tables.template take<std::byte>(rows_bytes, Part::spectral, Region::fast);
    m.columns_forward = tables.template take<std::byte>(columns_bytes, Part::spectral, Region::fast);
    m.columns_inverse = tables.template take<std::byte>(columns_bytes, Part::spectral, Region::fast);
    m.in = work.template take<Complex>(block, Part::spectral, Region::fast);
    m.out = work.template take<Complex>(kFftLanes > 1 ? block : side, Part::spectral, Region::fast);
    return m;
  }

  /// A plan for kFftLanes lines and where they lie meanwhile.
  struct LanePlan {
    void* state = nullptr;
    Complex* in = nullptr;
    Complex* out = nullptr;
  };

  /// Plans for `side`. invalid_config: not is_fft_side(). insufficient_memory: `memory` was carved for another side.
  /// The results do not depend on `unit`; the processor must have it.
  Status init(std::uint16_t side, const Memory& memory, VectorUnit unit = best_vector_unit());
  std::uint16_t side() const { return side_; }

  // Between the passes a spectrum holds row spectra. Their coefficients at kx = 0 and side / 2 are real: they lie
  // together in column 0, as real and imaginary part, and are transformed together, as one column. Column side / 2 has
  // no content then.

  /// Transforms `count` <= kBlock rows (contiguous, image rows from `first` on) into row spectra within `spectrum`.
  void forward_rows(const float* rows, std::size_t first, std::size_t count, Span<Complex> spectrum);
  /// Finishes the columns kx in [first, first + count) of a spectrum whose rows are all there, in place. Column side /
  /// 2 is finished with column 0.
  void forward_columns(Span<Complex> spectrum, std::size_t first, std::size_t count);
  /// Begins the way back with the columns kx in [first, first + count), in place; with column 0 goes column side / 2.
  void inverse_columns(Span<Complex> spectrum, std::size_t first, std::size_t count);
  /// Image rows [first, first + count), count <= kBlock, of a spectrum whose columns are all back; `rows` contiguous.
  void inverse_rows(Span<const Complex> spectrum, std::size_t first, std::size_t count, float* rows);

  /// The highest pixel that inverse_rows_search() has come by.
  struct Peak {
    float value = 0.0F;
    std::size_t row = 0;
    std::size_t column = 0;  ///< the first of equal ones
  };
  /// Instead of inverse_rows() where the rows themselves are not wanted: moves `peak` to the highest pixel of these
  /// rows if that is higher.
  void inverse_rows_search(Span<const Complex> spectrum, std::size_t first, std::size_t count, Peak& peak);

  /// The way back of `count` <= kFftLanes columns, contiguous in `in` and `out`, which may be the same. The first is
  /// column 0 where `last` is not null, which points to column side / 2 then. Changes `in`.
  void inverse_lines(Complex* in, const Complex* last, std::size_t count, Complex* out);
  /// One line of `side` real numbers to its side / 2 + 1 coefficients, and back; no overlap.
  void forward_line(const float* in, Complex* out) const;
  void inverse_line(const Complex* in, float* out) const;

  /// The whole transform: `image` side * side, `spectrum` spectrum_size(side). invalid_argument: other sizes.
  Status forward(Span<const float> image, Span<Complex> spectrum);
  /// The whole way back; destroys `spectrum`. invalid_argument: other sizes.
  Status inverse(Span<Complex> spectrum, Span<float> image);

  /// The loops of the vector unit that this runs on.
  const Kernels& kernels() const { return *kernels_; }

 private:
  Status plan(std::uint16_t side, const Memory& memory);
  void transform_lines(Span<std::byte> plan, const Complex* in, std::size_t count, Complex* out);

  Memory memory_;
  const Kernels* kernels_ = nullptr;
  std::uint16_t side_ = 0;
};

}  // namespace mellin
