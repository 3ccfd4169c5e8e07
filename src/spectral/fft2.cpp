#include "mellin/spectral/fft2.hpp"

#include <kiss_fft.h>
#include <kiss_fftr.h>

#include <algorithm>
#include <cassert>

#include "mellin/core/math.hpp"
#include "spectral/lanes.hpp"

static_assert(sizeof(mellin::Complex) == sizeof(kiss_fft_cpx), "KissFFT's complex number is two floats");

// What kiss_math.h puts in the place of libm.
extern "C" {
double mellin_kiss_cos(double x);
double mellin_kiss_sin(double x);
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

}  // namespace

void Fft2::forward_line(const float* in, Complex* out) const {
  kiss_fftr(real_plan(memory_.line_forward), in, kiss(out));
}

void Fft2::inverse_line(const Complex* in, float* out) const {
  kiss_fftri(real_plan(memory_.line_inverse), kiss(in), out);
}

#if MELLIN_FFT_LANES == 4

Status Fft2::init(std::uint16_t side, const Memory& memory) {
  side_ = 0;
  if (!is_fft_side(side)) {
    return Status::invalid_config;
  }
  const bool enough = memory.in.size() >= kFftLanes * side && memory.out.size() >= kFftLanes * side &&
                      plan_real(side, 0, memory.line_forward) && plan_real(side, 1, memory.line_inverse) &&
                      lanes::plan_real(side, false, memory.rows_forward) &&
                      lanes::plan_real(side, true, memory.rows_inverse) &&
                      lanes::plan_complex(side, false, memory.columns_forward) &&
                      lanes::plan_complex(side, true, memory.columns_inverse);
  if (!enough) {
    return Status::insufficient_memory;
  }
  memory_ = memory;
  side_ = side;
  return Status::ok;
}

void Fft2::forward_lines(const Complex* in, std::size_t count, Complex* out) {
  lanes::gather_columns(in, side_, count, memory_.in.data());
  lanes::transform(memory_.columns_forward, memory_.in.data(), memory_.out.data());
  lanes::scatter_columns(memory_.out.data(), side_, count, out);
}

void Fft2::inverse_lines(const Complex* in, std::size_t count, Complex* out) {
  lanes::gather_columns(in, side_, count, memory_.in.data());
  lanes::transform(memory_.columns_inverse, memory_.in.data(), memory_.out.data());
  lanes::scatter_columns(memory_.out.data(), side_, count, out);
}

void Fft2::forward_columns(Span<Complex> spectrum, std::size_t first, std::size_t count) {
  assert(first + count <= side_ / 2U + 1U && spectrum.size() == spectrum_size(side_));
  for (std::size_t i = 0; i < count; i += kFftLanes) {
    Complex* const columns = spectrum.data() + (first + i) * side_;
    forward_lines(columns, std::min(kFftLanes, count - i), columns);  // gathered before anything is written
  }
}

void Fft2::inverse_columns(Span<Complex> spectrum, std::size_t first, std::size_t count) {
  assert(first + count <= side_ / 2U + 1U && spectrum.size() == spectrum_size(side_));
  for (std::size_t i = 0; i < count; i += kFftLanes) {
    Complex* const columns = spectrum.data() + (first + i) * side_;
    inverse_lines(columns, std::min(kFftLanes, count - i), columns);
  }
}

void Fft2::forward_rows(const float* rows, std::size_t first, std::size_t count, Span<Complex> spectrum) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  for (std::size_t r = 0; r < count; r += kFftLanes) {
    const std::size_t lanes_used = std::min(kFftLanes, count - r);
    lanes::gather_rows(rows + r * side_, side_, lanes_used, memory_.in.data());
    lanes::transform_real(memory_.rows_forward, memory_.in.data(), memory_.out.data());
    lanes::scatter_row_spectra(memory_.out.data(), side_, lanes_used, spectrum.data() + first + r);
  }
}

void Fft2::inverse_rows(Span<const Complex> spectrum, std::size_t first, std::size_t count, float* rows) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  for (std::size_t r = 0; r < count; r += kFftLanes) {
    const std::size_t lanes_used = std::min(kFftLanes, count - r);
    lanes::gather_row_spectra(spectrum.data() + first + r, side_, lanes_used, memory_.in.data());
    lanes::transform_to_real(memory_.rows_inverse, memory_.in.data(), memory_.out.data());
    lanes::scatter_rows(memory_.out.data(), side_, lanes_used, rows + r * side_);
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

Status Fft2::init(std::uint16_t side, const Memory& memory) {
  side_ = 0;
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

void Fft2::forward_lines(const Complex* in, std::size_t count, Complex* out) {
  for (std::size_t i = 0; i < count; ++i) {
    kiss_fft(complex_plan(memory_.columns_forward), kiss(in + i * side_), kiss(out + i * side_));
  }
}

void Fft2::inverse_lines(const Complex* in, std::size_t count, Complex* out) {
  for (std::size_t i = 0; i < count; ++i) {
    kiss_fft(complex_plan(memory_.columns_inverse), kiss(in + i * side_), kiss(out + i * side_));
  }
}

void Fft2::forward_columns(Span<Complex> spectrum, std::size_t first, std::size_t count) {
  assert(first + count <= side_ / 2U + 1U && spectrum.size() == spectrum_size(side_));
  for (std::size_t kx = first; kx < first + count; ++kx) {
    Complex* const column = spectrum.data() + kx * side_;
    std::copy(column, column + side_, memory_.out.data());
    forward_lines(memory_.out.data(), 1, column);
  }
}

void Fft2::inverse_columns(Span<Complex> spectrum, std::size_t first, std::size_t count) {
  assert(first + count <= side_ / 2U + 1U && spectrum.size() == spectrum_size(side_));
  for (std::size_t kx = first; kx < first + count; ++kx) {
    Complex* const column = spectrum.data() + kx * side_;
    std::copy(column, column + side_, memory_.out.data());
    inverse_lines(memory_.out.data(), 1, column);
  }
}

void Fft2::forward_rows(const float* rows, std::size_t first, std::size_t count, Span<Complex> spectrum) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  const std::size_t width = side_ / 2U + 1U;
  Complex* const block = memory_.in.data();
  for (std::size_t r = 0; r < count; ++r) {
    forward_line(rows + r * side_, block + r * width);
  }
  for (std::size_t kx = 0; kx < width; ++kx) {
    Complex* const to = spectrum.data() + kx * side_ + first;
    for (std::size_t r = 0; r < count; ++r) {
      to[r] = block[r * width + kx];
    }
  }
}

void Fft2::inverse_rows(Span<const Complex> spectrum, std::size_t first, std::size_t count, float* rows) {
  assert(count <= kBlock && first + count <= side_ && spectrum.size() == spectrum_size(side_));
  const std::size_t width = side_ / 2U + 1U;
  Complex* const block = memory_.in.data();
  for (std::size_t kx = 0; kx < width; ++kx) {
    const Complex* const from = spectrum.data() + kx * side_ + first;
    for (std::size_t r = 0; r < count; ++r) {
      block[r * width + kx] = from[r];
    }
  }
  for (std::size_t r = 0; r < count; ++r) {
    inverse_line(block + r * width, rows + r * side_);
  }
}

#endif

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
