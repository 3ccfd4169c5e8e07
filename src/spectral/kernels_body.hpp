// The text of kernels.hpp's loops. Included once by each file that compiles it, which says what the table
// (MELLIN_KERNELS) and its copy of KissFFT in lanes (MELLIN_LANES) are called. All functions are local to that file and
// none of the standard library's are used, see kernels_avx2.cpp.
#include "spectral/kernels.hpp"

#if MELLIN_FFT_LANES > 1
extern "C" {
void MELLIN_LANES(fft)(void* plan, const void* in, void* out);
void MELLIN_LANES(fftr)(void* plan, const void* in, void* out);
void MELLIN_LANES(fftri)(void* plan, const void* in, void* out);
}
#endif

namespace mellin {
namespace {

#if MELLIN_FFT_LANES > 1

// A lane number is {re of all lanes, im of all lanes}; unused lanes are zero. Into the lanes and out of them go
// squares, as many lines at a time as a register has elements.
constexpr std::size_t kLanes = kFftLanes;
#if defined(__AVX2__)
constexpr std::size_t kGroup = 8;
#else
constexpr std::size_t kGroup = 4;
#endif
constexpr std::size_t kFour = 4;

using Vector4 = float __attribute__((vector_size(16)));
using Vector = float __attribute__((vector_size(4 * kGroup)));

template <class V>
inline V load(const float* from) {
  V v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
template <class V>
inline void store(V v, float* to) {
  __builtin_memcpy(to, &v, sizeof v);
}

inline float* floats(Complex* z) { return reinterpret_cast<float*>(z); }
inline const float* floats(const Complex* z) { return reinterpret_cast<const float*>(z); }

#if defined(__AVX2__)

inline void transpose(Vector (&rows)[kGroup]) {
  Vector pairs[kGroup];
  for (std::size_t i = 0; i < kGroup; i += 2) {
    pairs[i] = __builtin_shufflevector(rows[i], rows[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    pairs[i + 1] = __builtin_shufflevector(rows[i], rows[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  Vector fours[kGroup];
  for (std::size_t i = 0; i < kGroup; i += kFour) {
    fours[i] = __builtin_shufflevector(pairs[i], pairs[i + 2], 0, 1, 8, 9, 4, 5, 12, 13);
    fours[i + 1] = __builtin_shufflevector(pairs[i], pairs[i + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    fours[i + 2] = __builtin_shufflevector(pairs[i + 1], pairs[i + 3], 0, 1, 8, 9, 4, 5, 12, 13);
    fours[i + 3] = __builtin_shufflevector(pairs[i + 1], pairs[i + 3], 2, 3, 10, 11, 6, 7, 14, 15);
  }
  for (std::size_t i = 0; i < kFour; ++i) {
    rows[i] = __builtin_shufflevector(fours[i], fours[i + kFour], 0, 1, 2, 3, 8, 9, 10, 11);
    rows[i + kFour] = __builtin_shufflevector(fours[i], fours[i + kFour], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

#else

inline void transpose(Vector (&rows)[kGroup]) {
  const Vector ab_low = __builtin_shufflevector(rows[0], rows[1], 0, 4, 1, 5);
  const Vector ab_high = __builtin_shufflevector(rows[0], rows[1], 2, 6, 3, 7);
  const Vector cd_low = __builtin_shufflevector(rows[2], rows[3], 0, 4, 1, 5);
  const Vector cd_high = __builtin_shufflevector(rows[2], rows[3], 2, 6, 3, 7);
  rows[0] = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  rows[1] = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  rows[2] = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  rows[3] = __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7);
}

#endif

/// `used` lines of `size` floats, `stride` apart, to `size` vectors of all lanes.
inline void gather(const float* lines, std::size_t stride, std::size_t size, std::size_t used, float* vectors) {
  std::size_t group = 0;
  for (; group + kGroup <= used; group += kGroup) {
    const float* const from = lines + group * stride;
    float* const to = vectors + group;
    std::size_t i = 0;
    for (; i + kGroup <= size; i += kGroup) {
      Vector square[kGroup];
      for (std::size_t k = 0; k < kGroup; ++k) {
        square[k] = load<Vector>(from + k * stride + i);
      }
      transpose(square);
      for (std::size_t k = 0; k < kGroup; ++k) {
        store(square[k], to + kLanes * (i + k));
      }
    }
    for (; i < size; ++i) {
      for (std::size_t lane = 0; lane < kGroup; ++lane) {
        to[kLanes * i + lane] = from[lane * stride + i];
      }
    }
  }
  for (std::size_t i = 0; group < kLanes && i < size; ++i) {
    for (std::size_t lane = group; lane < kLanes; ++lane) {
      vectors[kLanes * i + lane] = lane < used ? lines[lane * stride + i] : 0.0F;
    }
  }
}

/// The way back; lines from `used` on are not touched.
inline void scatter(const float* vectors, std::size_t stride, std::size_t size, std::size_t used, float* lines) {
  std::size_t group = 0;
  for (; group + kGroup <= used; group += kGroup) {
    const float* const from = vectors + group;
    float* const to = lines + group * stride;
    std::size_t i = 0;
    for (; i + kGroup <= size; i += kGroup) {
      Vector square[kGroup];
      for (std::size_t k = 0; k < kGroup; ++k) {
        square[k] = load<Vector>(from + kLanes * (i + k));
      }
      transpose(square);
      for (std::size_t k = 0; k < kGroup; ++k) {
        store(square[k], to + k * stride + i);
      }
    }
    for (; i < size; ++i) {
      for (std::size_t lane = 0; lane < kGroup; ++lane) {
        to[lane * stride + i] = from[kLanes * i + lane];
      }
    }
  }
  for (; group < used; ++group) {
    for (std::size_t i = 0; i < size; ++i) {
      lines[group * stride + i] = vectors[kLanes * i + group];
    }
  }
}

// A line of complex numbers is a line of twice as many floats, and transposing {re, im, re, im} gives lane numbers.
void lines(const Fft2::LanePlan& plan, const Complex* in, std::size_t side, std::size_t count, Complex* out) {
  gather(floats(in), 2 * side, 2 * side, count, floats(plan.in));
  MELLIN_LANES(fft)(plan.state, plan.in, plan.out);
  scatter(floats(plan.out), 2 * side, 2 * side, count, floats(out));
}

/// From lane numbers at `re` and `im` to `used` elements of a column, where rows lie side by side, and back.
inline void put_column(const float* re, const float* im, std::size_t used, Complex* to) {
  std::size_t lane = 0;
  for (; lane + kFour <= used; lane += kFour) {
    const auto four_re = load<Vector4>(re + lane);
    const auto four_im = load<Vector4>(im + lane);
    store<Vector4>(__builtin_shufflevector(four_re, four_im, 0, 4, 1, 5), floats(to + lane));
    store<Vector4>(__builtin_shufflevector(four_re, four_im, 2, 6, 3, 7), floats(to + lane + 2));
  }
  for (; lane < used; ++lane) {
    to[lane] = {re[lane], im[lane]};
  }
}
inline void get_column(const Complex* from, std::size_t used, float* re, float* im) {
  std::size_t lane = 0;
#if defined(__AVX2__)
  if (used == kLanes) {
    const auto low = load<Vector>(floats(from));
    const auto high = load<Vector>(floats(from + kFour));
    const Vector first = __builtin_shufflevector(low, high, 0, 1, 2, 3, 8, 9, 10, 11);
    const Vector second = __builtin_shufflevector(low, high, 4, 5, 6, 7, 12, 13, 14, 15);
    // Elements 0 1 4 5 and 2 3 6 7 side by side, so that pairs are picked within the halves of the registers.
    store<Vector>(__builtin_shufflevector(first, second, 0, 2, 8, 10, 4, 6, 12, 14), re);
    store<Vector>(__builtin_shufflevector(first, second, 1, 3, 9, 11, 5, 7, 13, 15), im);
    return;
  }
#endif
  for (; lane + kFour <= used; lane += kFour) {
    const auto low = load<Vector4>(floats(from + lane));
    const auto high = load<Vector4>(floats(from + lane + 2));
    store<Vector4>(__builtin_shufflevector(low, high, 0, 2, 4, 6), re + lane);
    store<Vector4>(__builtin_shufflevector(low, high, 1, 3, 5, 7), im + lane);
  }
  for (; lane < kLanes; ++lane) {
    re[lane] = lane < used ? from[lane].re : 0.0F;
    im[lane] = lane < used ? from[lane].im : 0.0F;
  }
}

void forward_rows(const Fft2::LanePlan& plan, const float* rows, std::size_t side, std::size_t count,
                  Complex* spectrum) {
  gather(rows, side, side, count, floats(plan.in));
  MELLIN_LANES(fftr)(plan.state, plan.in, plan.out);
  const float* const from = floats(plan.out);
  // Both are real, and share a column.
  put_column(from, from + side * kLanes, count, spectrum);
  for (std::size_t kx = 1; kx < side / 2; ++kx) {
    const float* const re = from + 2 * kx * kLanes;
    put_column(re, re + kLanes, count, spectrum + kx * side);
  }
}

/// Into the lanes and back; the rows stay there.
inline void inverse_rows_in_lanes(const Fft2::LanePlan& plan, const Complex* spectrum, std::size_t side,
                                  std::size_t count) {
  float* const to = floats(plan.in);
  get_column(spectrum, count, to, to + side * kLanes);
  for (std::size_t kx = 1; kx < side / 2; ++kx) {
    float* const re = to + 2 * kx * kLanes;
    get_column(spectrum + kx * side, count, re, re + kLanes);
  }
  MELLIN_LANES(fftri)(plan.state, plan.in, plan.out);
}

void inverse_rows(const Fft2::LanePlan& plan, const Complex* spectrum, std::size_t side, std::size_t count,
                  float* rows) {
  inverse_rows_in_lanes(plan, spectrum, side, count);
  scatter(floats(plan.out), side, side, count, rows);
}

void inverse_rows_search(const Fft2::LanePlan& plan, const Complex* spectrum, std::size_t side, std::size_t count,
                         float* maxima) {
  inverse_rows_in_lanes(plan, spectrum, side, count);
  const float* const rows = floats(plan.out);
  float highest_of[kLanes] = {};
  for (std::size_t i = 0; i < side; ++i) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const float value = rows[kLanes * i + lane];
      highest_of[lane] = value > highest_of[lane] ? value : highest_of[lane];
    }
  }
  for (std::size_t lane = 0; lane < count; ++lane) {
    maxima[lane] = highest_of[lane];
  }
}

#endif

void whiten(Complex* values, std::size_t count, float floor) {
  for (std::size_t i = 0; i < count; ++i) {
    const Complex z = values[i];
    const float weight = 1.0F / (__builtin_sqrtf(z.re * z.re + z.im * z.im) + floor);
    values[i] = {weight * z.re, weight * z.im};
  }
}

void cross(const Complex* __restrict filter, const Complex* __restrict w, std::size_t count,
           Complex* __restrict straight, Complex* __restrict half_turned) {
  for (std::size_t i = 0; i < count; ++i) {
    const float rr = filter[i].re * w[i].re;
    const float ii = filter[i].im * w[i].im;
    const float ri = filter[i].re * w[i].im;
    const float ir = filter[i].im * w[i].re;
    straight[i].re = rr + ii;
    straight[i].im = ir - ri;
    half_turned[i].re = rr - ii;
    half_turned[i].im = ir + ri;
  }
}

inline float mix(float a, float b, float share) { return a + share * (b - a); }

void turned_run(const TurnedRun& from, std::size_t begin, std::size_t end, float* __restrict out) {
  const TurnedRun run = from;
  // The pixel left of and under (x, y) has the index truncated there less the one that both are larger by.
  const float* const corner = run.pixels - run.side - 1;
  const int last = static_cast<int>(end);
  for (int c = static_cast<int>(begin); c < last; ++c) {
    const float along = static_cast<float>(c) - run.centre;
    const float x = run.x + run.cos * along;
    const float y = run.y - run.sin * along;
    const int column = static_cast<int>(x);
    const int line = static_cast<int>(y);
    const float share_x = x - static_cast<float>(column);
    const float share_y = y - static_cast<float>(line);
    const int at = line * run.side + column;
    const float lower = mix(corner[at], corner[at + 1], share_x);
    const float upper = mix(corner[at + run.side], corner[at + run.side + 1], share_x);
    out[c] = mix(lower, upper, share_y);
  }
}

}  // namespace

const Kernels MELLIN_KERNELS = {
#if MELLIN_FFT_LANES > 1
    lines,  forward_rows, inverse_rows, inverse_rows_search,
#endif
    whiten, cross,        turned_run};

}  // namespace mellin
