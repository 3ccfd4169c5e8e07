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

// A lane number is {re of all lanes, im of all lanes}; unused lanes are zero. Into the lanes and out of them four lines
// at a time: squares of 4 x 4 are transposed.
constexpr std::size_t kLanes = kFftLanes;
constexpr std::size_t kGroup = 4;

using Vector = float __attribute__((vector_size(16)));

inline Vector load(const float* from) {
  Vector v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
inline void store(Vector v, float* to) { __builtin_memcpy(to, &v, sizeof v); }

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

/// `used` lines of `size` floats, `stride` apart, to `size` vectors of all lanes.
inline void gather(const float* lines, std::size_t stride, std::size_t size, std::size_t used, float* vectors) {
  std::size_t group = 0;
  for (; group + kGroup <= used; group += kGroup) {
    const float* const from = lines + group * stride;
    float* const to = vectors + group;
    std::size_t i = 0;
    for (; i + 4 <= size; i += 4) {
      Vector a = load(from + i);
      Vector b = load(from + stride + i);
      Vector c = load(from + 2 * stride + i);
      Vector d = load(from + 3 * stride + i);
      transpose(a, b, c, d);
      store(a, to + kLanes * i);
      store(b, to + kLanes * (i + 1));
      store(c, to + kLanes * (i + 2));
      store(d, to + kLanes * (i + 3));
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
    for (; i + 4 <= size; i += 4) {
      Vector a = load(from + kLanes * i);
      Vector b = load(from + kLanes * (i + 1));
      Vector c = load(from + kLanes * (i + 2));
      Vector d = load(from + kLanes * (i + 3));
      transpose(a, b, c, d);
      store(a, to + i);
      store(b, to + stride + i);
      store(c, to + 2 * stride + i);
      store(d, to + 3 * stride + i);
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

/// One coefficient of four rows, which lie side by side in a column of the spectrum.
inline void put_four(Vector re, Vector im, Complex* to) {
  store(__builtin_shufflevector(re, im, 0, 4, 1, 5), floats(to));
  store(__builtin_shufflevector(re, im, 2, 6, 3, 7), floats(to) + 4);
}
inline void get_four(const Complex* from, Vector& re, Vector& im) {
  const Vector low = load(floats(from));
  const Vector high = load(floats(from) + 4);
  re = __builtin_shufflevector(low, high, 0, 2, 4, 6);
  im = __builtin_shufflevector(low, high, 1, 3, 5, 7);
}

/// From lane numbers at `re` and `im` to `used` elements of a column.
inline void put_column(const float* re, const float* im, std::size_t used, Complex* to) {
  std::size_t lane = 0;
  for (; lane + kGroup <= used; lane += kGroup) {
    put_four(load(re + lane), load(im + lane), to + lane);
  }
  for (; lane < used; ++lane) {
    to[lane] = {re[lane], im[lane]};
  }
}
inline void get_column(const Complex* from, std::size_t used, float* re, float* im) {
  std::size_t lane = 0;
  for (; lane + kGroup <= used; lane += kGroup) {
    Vector four_re;
    Vector four_im;
    get_four(from + lane, four_re, four_im);
    store(four_re, re + lane);
    store(four_im, im + lane);
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

void inverse_rows(const Fft2::LanePlan& plan, const Complex* spectrum, std::size_t side, std::size_t count,
                  float* rows) {
  float* const to = floats(plan.in);
  get_column(spectrum, count, to, to + side * kLanes);
  for (std::size_t kx = 1; kx < side / 2; ++kx) {
    float* const re = to + 2 * kx * kLanes;
    get_column(spectrum + kx * side, count, re, re + kLanes);
  }
  MELLIN_LANES(fftri)(plan.state, plan.in, plan.out);
  scatter(floats(plan.out), side, side, count, rows);
}

#endif

float highest(const float* values, std::size_t count) {
  // Maxima without order between them, so that the compiler may take them side by side.
  constexpr std::size_t kSideBySide = 16;
  float maxima[kSideBySide] = {};
  std::size_t i = 0;
  for (; i + kSideBySide <= count; i += kSideBySide) {
    for (std::size_t k = 0; k < kSideBySide; ++k) {
      maxima[k] = values[i + k] > maxima[k] ? values[i + k] : maxima[k];
    }
  }
  float result = 0.0F;
  for (; i < count; ++i) {
    result = values[i] > result ? values[i] : result;
  }
  for (const float maximum : maxima) {
    result = maximum > result ? maximum : result;
  }
  return result;
}

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
    lines,   forward_rows, inverse_rows,
#endif
    highest, whiten,       cross,        turned_run};

}  // namespace mellin
