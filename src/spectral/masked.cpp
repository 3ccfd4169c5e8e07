// The passes of masked registration: the translation step where only what both pictures have observed counts
// (D. Padfield, Masked object registration in the Fourier domain, IEEE Trans. Image Processing 21(5), 2012; the paper's
// reference [19], Section IV-B1). f and g: pictures a and b; m: where a was observed, w: where b was.
#include <algorithm>
#include <cmath>

#include "mellin/grid/digest.hpp"
#include "mellin/spectral/matcher.hpp"
#include "spectral/peaks.hpp"
#include "spectral/resample.hpp"

namespace mellin {

namespace {

/// The sums over the overlap that a coefficient is made of, each a correlation of one spectrum of a with one of b.
enum Sum : std::size_t { kPixels, kF, kG, kProduct, kSquareF, kSquareG, kSums };
/// Spectra of a picture: of itself where observed, of its mask, of its square where observed.
enum Spectrum : std::size_t { kPicture, kMask, kSquare, kSpectra };

constexpr Spectrum kOfA[kSums] = {kMask, kPicture, kMask, kPicture, kSquare, kMask};
constexpr Spectrum kOfB[kSums] = {kMask, kMask, kPicture, kPicture, kMask, kSquare};

/// Overlaps with less than this share of a picture's energy say nothing, and their variances may be rounding.
constexpr float kLeastEnergy = 1e-3F;

Complex product(Complex a, Complex b) { return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }
Complex cross(Complex a, Complex b) { return {a.re * b.re + a.im * b.im, a.im * b.re - a.re * b.im}; }

/// Coefficient of the zero frequency: the sum over a picture.
float total(Span<const Complex> spectrum) { return spectrum[0].re; }

}  // namespace

Span<Complex> Matcher::masked_spectrum_of_b(std::size_t i) const {
  const std::size_t size = spectrum_size(config_.side);
  return i == 0 ? memory_.first : (i == 1 ? memory_.second : memory_.masked.first(size));
}

Span<Complex> Matcher::masked_sum(std::size_t i) const {
  const std::size_t size = spectrum_size(config_.side);
  return memory_.masked.subspan((1 + i) * size, size);
}

/// Row spectra of a picture row by row: three rows, of the picture, its mask, its square.
void Matcher::transform_masked_row(const float* picture, const float* mask, std::size_t row,
                                   const Span<Complex> (&spectra)[3]) {
  const std::size_t side = config_.side;
  float* const values = memory_.rows.data();
  for (std::size_t i = 0; i < side; ++i) {
    const float weight = mask[i] >= 0.5F ? 1.0F : 0.0F;
    const float value = weight * picture[i];
    values[kPicture * side + i] = value;
    values[kMask * side + i] = weight;
    values[kSquare * side + i] = value * value;
  }
  for (std::size_t i = 0; i < kSpectra; ++i) {
    fft_.forward_rows(values + i * side, row, 1, spectra[i]);
  }
}

void Matcher::transform_masked_rows(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t pixels = side * side;
  const std::size_t size = spectrum_size(config_.side);
  const ImageView image = picture_image();
  float* const line = memory_.rows.data() + kSpectra * side;
  for (std::size_t r = first; r < first + count; ++r) {
    float* const mask = out_->image.empty() ? line : out_->image.data() + pixels + r * side;
    for (std::size_t c = 0; c < side; ++c) {
      mask[c] = observed_.empty() || mask_bit(observed_, r * side + c) ? 1.0F : 0.0F;
    }
    if (!out_->filter.empty()) {
      transform_masked_row(
          image.row(r), mask, r,
          {out_->filter.first(size), out_->filter.subspan(size, size), out_->filter.subspan(2 * size, size)});
    }
  }
}

void Matcher::transform_masked_columns(std::size_t first, std::size_t count) {
  const std::size_t size = spectrum_size(config_.side);
  for (std::size_t i = 0; i < kSpectra; ++i) {
    fft_.forward_columns(out_->filter.subspan(i * size, size), first, count);
  }
}

/// The picture and its mask are turned; a turned pixel is observed if most of it is.
void Matcher::transform_masked_turned_rows(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t pixels = side * side;
  const SinCosF turn = turn_under_way();
  float* const picture = memory_.rows.data() + kSpectra * side;
  float* const mask = picture + side;
  for (std::size_t r = first; r < first + count; ++r) {
    turned_row({b_.image.first(pixels), config_.side}, turn, r, fft_.kernels(), picture);
    turned_row({b_.image.subspan(pixels, pixels), config_.side}, turn, r, fft_.kernels(), mask);
    transform_masked_row(picture, mask, r, {masked_spectrum_of_b(0), masked_spectrum_of_b(1), masked_spectrum_of_b(2)});
  }
}

void Matcher::transform_masked_turned_columns(std::size_t first, std::size_t count) {
  for (std::size_t i = 0; i < kSpectra; ++i) {
    fft_.forward_columns(masked_spectrum_of_b(i), first, count);
  }
}

/// The six correlations, columns back. That of the picture turned by a further 180 degrees takes the conjugate spectra,
/// as in the phase-only filter.
void Matcher::correlate_masked_columns(std::size_t first, std::size_t count) {
  const std::size_t side = config_.side;
  const std::size_t last = side / 2;
  const std::size_t size = spectrum_size(config_.side);
  for (std::size_t s = 0; s < kSums; ++s) {
    const Span<const Complex> a = a_.filter.subspan(kOfA[s] * size, size);
    const Span<const Complex> b = masked_spectrum_of_b(kOfB[s]);
    const Span<Complex> out = masked_sum(s);
    const auto multiply_column = [&](std::size_t kx) {
      for (std::size_t i = kx * side; i < (kx + 1) * side; ++i) {
        out[i] = half_turn_ ? product(a[i], b[i]) : cross(a[i], b[i]);
      }
    };
    for (std::size_t kx = first; kx < std::min(first + count, last); ++kx) {
      multiply_column(kx);
    }
    if (first == 0) {
      multiply_column(last);  // goes back with column 0
    }
    fft_.inverse_columns(out, first, count);
  }
}

/// Row `row` of the masked normalised cross-correlation (Padfield's equation 10), 0 where the overlap is too small.
/// Valid until the next one.
const float* Matcher::masked_surface_row(std::size_t row) {
  const std::size_t side = config_.side;
  const std::size_t size = spectrum_size(config_.side);
  const float scale = 1.0F / static_cast<float>(side * side);
  float* const out = memory_.rows.data() + kSums * side;
  const float* sums[kSums] = {};
  for (std::size_t s = 0; s < kSums; ++s) {
    float* const line = memory_.rows.data() + s * side;
    fft_.inverse_rows(masked_sum(s), row, 1, line);
    sums[s] = line;
  }
  const float least_pixels = std::max(1.0F, config_.min_overlap * std::min(total(a_.filter.subspan(kMask * size, size)),
                                                                           total(masked_spectrum_of_b(kMask))));
  const float least_f = kLeastEnergy * total(a_.filter.subspan(kSquare * size, size));
  const float least_g = kLeastEnergy * total(masked_spectrum_of_b(kSquare));
  for (std::size_t i = 0; i < side; ++i) {
    const float pixels = scale * sums[kPixels][i];
    out[i] = 0.0F;
    // Half a pixel less: the sum is whole but for rounding.
    if (pixels < least_pixels - 0.5F) {
      continue;
    }
    const float f = scale * sums[kF][i];
    const float g = scale * sums[kG][i];
    const float variance_f = scale * sums[kSquareF][i] - f * f / pixels;
    const float variance_g = scale * sums[kSquareG][i] - g * g / pixels;
    if (variance_f > least_f && variance_g > least_g) {
      const float covariance = scale * sums[kProduct][i] - f * g / pixels;
      out[i] = std::max(-1.0F, std::min(1.0F, covariance / std::sqrt(variance_f * variance_g)));
    }
  }
  return out;
}

void Matcher::search_masked_rows(std::size_t first, std::size_t count) {
  for (std::size_t r = first; r < first + count; ++r) {
    peaks_.add_row(r, {masked_surface_row(r), config_.side});
  }
}

}  // namespace mellin
