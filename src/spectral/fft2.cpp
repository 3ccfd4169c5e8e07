#include "mellin/spectral/fft2.hpp"

#include <kiss_fft.h>
#include <kiss_fftr.h>

#include <algorithm>
#include <cassert>
#include <cstdint>

#include "mellin/core/math.hpp"
#include "spectral/kernels.hpp"
#include "spectral/peaks.hpp"

static_assert(sizeof(mellin::Complex) == sizeof(kiss_fft_cpx), "KissFFT's complex number is two floats");

// What kiss_math.h puts in the place of libm.
extern "C" {
double mellin_kiss_cos(double x);
double mellin_kiss_sin(double x);
#if MELLIN_FFT_LANES > 1
void* mellin_lanes_fft_alloc(int n, int inverse, void* memory, std::size_t* bytes);
void* mellin_lanes_fftr_alloc(int n, int inverse, void* memory, std::size_t* bytes);
#endif
}
double mellin_kiss_cos(double x) { return mellin::sincos(x).cos; }
double mellin_kiss_sin(double x) { return mellin::sincos(x).sin; }

namespace mellin {

namespace {

const kiss_fft_cpx* kiss(const Complex* values) { return reinterpret_cast<const kiss_fft_cpx*>(values); }
kiss_fft_cpx* kiss(Complex* values) { return reinterpret_cast<kiss_fft_cpx*>(values); }

kiss_fftr_cfg real_plan(Span<std::byte> memory) { return reinterpret_cast<kiss_fftr_cfg>(memory.data()); }

bool plan_real(int n, int inverse, Span<std::byte> memory) {
  std::size_t bytes = memory.size();
  return memory.data() != nullptr && kiss_fftr_alloc(n, inverse, memory.data(), &bytes) != nullptr;
}

/// Two columns whose transforms back are real as one, whose transform back has the one as real and the other as
/// imaginary part.
void fold(Complex* first, const Complex* last, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    first[i] = {first[i].re - last[i].im, first[i].im + last[i].re};
  }
}

/// The transform of such a pair, into the two.
void unfold(Complex* first, Complex* last, std::size_t size) {
  for (std::size_t i = 0; i <= size / 2; ++i) {
    const std::size_t k = i == 0 ? 0 : size - i;
    const Complex a = first[i];
    const Complex b = first[k];
    const float re = 0.5F * (a.re + b.re);
    const float im = 0.5F * (a.im - b.im);
    const float last_re = 0.5F * (a.im + b.im);
    const float last_im = 0.5F * (b.re - a.re);
    first[i] = {re, im};
    first[k] = {re, -im};
    last[i] = {last_re, last_im};
    last[k] = {last_re, -last_im};
  }
}

}  // namespace

void Fft2::forward_line(const float* in, Complex* out) const {
  kiss_fftr(real_plan(memory_.line_forward), in, kiss(out));
}

void Fft2::inverse_line(const Complex* in, float* out) const {
  kiss_fftri(real_plan(memory_.line_inverse), kiss(in), out);
}

#if MELLIN_FFT_LANES > 1

namespace {

bool plan_complex_lanes(int n, bool inverse, Span<std::byte> memory) {
  std::size_t bytes = memory.size();
  return memory.data() != nullptr && mellin_lanes_fft_alloc(n, inverse ? 1 : 0, memory.data(), &bytes) != nullptr;
}

/// The part of `memory` that begins where an address of the form 32 n + `offset` is, or the like for narrower lanes.
template <class T>
Span<T> aligned(Span<T> memory, std::size_t offset) {
  constexpr std::size_t kUnit = kFftLanes * sizeof(float);
  const std::size_t beyond = (reinterpret_cast<std::uintptr_t>(memory.data()) + kUnit - offset) % kUnit;
  const std::size_t skipped = beyond == 0 ? 0 : (kUnit - beyond) / sizeof(T);
  return skipped < memory.size() ? memory.subspan(skipped, memory.size() - skipped) : Span<T>();
}

/// A plan's twiddle factors lie 264 bytes behind its start, or those and a multiple of 32 for real transforms.
Span<std::byte> aligned_plan(Span<std::byte> memory) {
  return aligned(memory, (kFftLanes * sizeof(float) - complex_plan_bytes(0) % (kFftLanes * sizeof(float))));
}

bool plan_real_lanes(int n, bool inverse, Span<std::byte> memory) {
  std::size_t bytes = memory.size();
  return memory.data() != nullptr && mellin_lanes_fftr_alloc(n, inverse ? 1 : 0, memory.data(), &bytes) != nullptr;
}

}  // namespace

Status Fft2::init(std::uint16_t side, const Memory& memory, VectorUnit unit) {
  side_ = 0;
  kernels_ = &kernels_of(unit);
  if (!is_fft_side(side)) {
    return Status::invalid_config;
  }
  Memory lanes = memory;
  lanes.in = aligned(memory.in, 0);
  lanes.out = aligned(memory.out, 0);
  lanes.rows_forward = aligned_plan(memory.rows_forward);
  lanes.rows_inverse = aligned_plan(memory.rows_inverse);
  lanes.columns_forward = aligned_plan(memory.columns_forward);
  lanes.columns_inverse = aligned_plan(memory.columns_inverse);
  return plan(side, lanes);
}

Status Fft2::plan(std::uint16_t side, const Memory& memory) {
  const bool enough =
      memory.in.size() >= kFftLanes * side && memory.out.size() >= kFftLanes * side &&
      plan_real(side, 0, memory.line_forward) && plan_real(side, 1, memory.line_inverse) &&
      plan_real_lanes(side, false, memory.rows_forward) && plan_real_lanes(side, true, memory.rows_inverse) &&
      plan_complex_lanes(side, false, memory.columns_forward) && plan_complex_lanes(side, true, memory.columns_inverse);
  if (!enough) {
    return Status::insufficient_memory;
  }
  memory_ = memory;
  side_ = side;
  return Status::ok;
}

void Fft2::transform_lines(Span<std::byte> plan, const Complex* in, std::size_t count, Complex* out) {
  kernels_->lines({plan.data(), memory_.in.data(), memory_.out.data()}, in, side_, count, out);
}

void Fft2::forward_rows(const float* rows, std::size_t first, std::size_t count, Span<Complex> spectrum) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  const LanePlan plan{memory_.rows_forward.data(), memory_.in.data(), memory_.out.data()};
  for (std::size_t r = 0; r < count; r += kFftLanes) {
    kernels_->forward_rows(plan, rows + r * side_, side_, std::min(kFftLanes, count - r), spectrum.data() + first + r);
  }
}

void Fft2::inverse_rows(Span<const Complex> spectrum, std::size_t first, std::size_t count, float* rows) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  const LanePlan plan{memory_.rows_inverse.data(), memory_.in.data(), memory_.out.data()};
  for (std::size_t r = 0; r < count; r += kFftLanes) {
    kernels_->inverse_rows(plan, spectrum.data() + first + r, side_, std::min(kFftLanes, count - r), rows + r * side_);
  }
}

void Fft2::inverse_rows_search(Span<const Complex> spectrum, std::size_t first, std::size_t count, Peak& peak) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  const LanePlan plan{memory_.rows_inverse.data(), memory_.in.data(), memory_.out.data()};
  const float* const lanes = reinterpret_cast<const float*>(memory_.out.data());
  for (std::size_t r = 0; r < count; r += kFftLanes) {
    const std::size_t used = std::min(kFftLanes, count - r);
    float maxima[kFftLanes] = {};
    kernels_->inverse_rows_search(plan, spectrum.data() + first + r, side_, used, maxima);
    for (std::size_t lane = 0; lane < used; ++lane) {
      if (maxima[lane] > peak.value) {
        std::size_t column = 0;
        while (lanes[kFftLanes * column + lane] != maxima[lane]) {
          ++column;
        }
        peak = {maxima[lane], first + r + lane, column};
      }
    }
  }
}

#else

namespace {

kiss_fft_cfg complex_plan(Span<std::byte> memory) { return reinterpret_cast<kiss_fft_cfg>(memory.data()); }

bool plan_complex(int n, int inverse, Span<std::byte> memory) {
  std::size_t bytes = memory.size();
  return memory.data() != nullptr && kiss_fft_alloc(n, inverse, memory.data(), &bytes) != nullptr;
}

}  // namespace

Status Fft2::init(std::uint16_t side, const Memory& memory, VectorUnit unit) {
  side_ = 0;
  kernels_ = &kernels_of(unit);
  if (!is_fft_side(side)) {
    return Status::invalid_config;
  }
  const bool enough = memory.in.size() >= kBlock * (side / 2U + 1U) && memory.out.size() >= side &&
                      plan_real(side, 0, memory.line_forward) && plan_real(side, 1, memory.line_inverse) &&
                      plan_complex(side, 0, memory.columns_forward) && plan_complex(side, 1, memory.columns_inverse);
  if (!enough) {
    return Status::insufficient_memory;
  }
  memory_ = memory;
  side_ = side;
  return Status::ok;
}

/// By way of a copy, since `in` and `out` may be the same.
void Fft2::transform_lines(Span<std::byte> plan, const Complex* in, std::size_t count, Complex* out) {
  for (std::size_t i = 0; i < count; ++i) {
    std::copy(in + i * side_, in + (i + 1) * side_, memory_.out.data());
    kiss_fft(complex_plan(plan), kiss(memory_.out.data()), kiss(out + i * side_));
  }
}

void Fft2::forward_rows(const float* rows, std::size_t first, std::size_t count, Span<Complex> spectrum) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  const std::size_t last = side_ / 2U;
  const std::size_t width = last + 1;
  Complex* const block = memory_.in.data();
  for (std::size_t r = 0; r < count; ++r) {
    forward_line(rows + r * side_, block + r * width);
    block[r * width].im = block[r * width + last].re;
  }
  for (std::size_t kx = 0; kx < last; ++kx) {
    Complex* const to = spectrum.data() + kx * side_ + first;
    for (std::size_t r = 0; r < count; ++r) {
      to[r] = block[r * width + kx];
    }
  }
}

void Fft2::inverse_rows(Span<const Complex> spectrum, std::size_t first, std::size_t count, float* rows) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  const std::size_t last = side_ / 2U;
  const std::size_t width = last + 1;
  Complex* const block = memory_.in.data();
  for (std::size_t kx = 0; kx < last; ++kx) {
    const Complex* const from = spectrum.data() + kx * side_ + first;
    for (std::size_t r = 0; r < count; ++r) {
      block[r * width + kx] = from[r];
    }
  }
  for (std::size_t r = 0; r < count; ++r) {
    block[r * width + last].re = block[r * width].im;
    inverse_line(block + r * width, rows + r * side_);
  }
}

void Fft2::inverse_rows_search(Span<const Complex> spectrum, std::size_t first, std::size_t count, Peak& peak) {
  float* const row = reinterpret_cast<float*>(memory_.out.data());
  for (std::size_t r = first; r < first + count; ++r) {
    inverse_rows(spectrum, r, 1, row);
    const float top = highest(row, side_);
    if (top > peak.value) {
      peak = {top, r, static_cast<std::size_t>(std::find(row, row + side_, top) - row)};
    }
  }
}

#endif

void Fft2::forward_columns(Span<Complex> spectrum, std::size_t first, std::size_t count) {
  const std::size_t last = side_ / 2U;
  assert(first + count <= last + 1 && spectrum.size() == spectrum_size(side_));
  for (std::size_t kx = first; kx < std::min(first + count, last); kx += kFftLanes) {
    Complex* const columns = spectrum.data() + kx * side_;
    transform_lines(memory_.columns_forward, columns, std::min(kFftLanes, std::min(first + count, last) - kx), columns);
  }
  if (first == 0 && count > 0) {
    unfold(spectrum.data(), spectrum.data() + last * side_, side_);
  }
}

void Fft2::inverse_lines(Complex* in, const Complex* last, std::size_t count, Complex* out) {
  if (last != nullptr) {
    fold(in, last, side_);
  }
  transform_lines(memory_.columns_inverse, in, count, out);
}

void Fft2::inverse_columns(Span<Complex> spectrum, std::size_t first, std::size_t count) {
  const std::size_t last = side_ / 2U;
  assert(first + count <= last + 1 && spectrum.size() == spectrum_size(side_));
  for (std::size_t kx = first; kx < std::min(first + count, last); kx += kFftLanes) {
    Complex* const columns = spectrum.data() + kx * side_;
    inverse_lines(columns, kx == 0 ? columns + last * side_ : nullptr,
                  std::min(kFftLanes, std::min(first + count, last) - kx), columns);
  }
}

Status Fft2::forward(Span<const float> image, Span<Complex> spectrum) {
  const bool valid = side_ > 0 && image.size() == std::size_t{side_} * side_ && spectrum.size() == spectrum_size(side_);
  assert(valid);
  if (!valid) {
    return Status::invalid_argument;
  }
  for (std::size_t r = 0; r < side_; r += kBlock) {
    forward_rows(image.data() + r * side_, r, std::min(kBlock, side_ - r), spectrum);
  }
  forward_columns(spectrum, 0, side_ / 2U + 1U);
  return Status::ok;
}

Status Fft2::inverse(Span<Complex> spectrum, Span<float> image) {
  const bool valid = side_ > 0 && image.size() == std::size_t{side_} * side_ && spectrum.size() == spectrum_size(side_);
  assert(valid);
  if (!valid) {
    return Status::invalid_argument;
  }
  inverse_columns(spectrum, 0, side_ / 2U + 1U);
  for (std::size_t r = 0; r < side_; r += kBlock) {
    inverse_rows(spectrum, r, std::min(kBlock, side_ - r), image.data() + r * side_);
  }
  return Status::ok;
}

}  // namespace mellin
