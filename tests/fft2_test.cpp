#include "mellin/spectral/fft2.hpp"

#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>
#include <initializer_list>
#include <vector>

#include "mellin/core/math.hpp"
#include "mellin/core/random.hpp"

using namespace mellin;

// KissFFT's own, to compare what its plans ask for (its header is not the tests' business).
extern "C" void* kiss_fft_alloc(int n, int inverse, void* memory, std::size_t* bytes);
extern "C" void* kiss_fftr_alloc(int n, int inverse, void* memory, std::size_t* bytes);
extern "C" void kiss_fft(void* plan, const void* in, void* out);
#if MELLIN_FFT_LANES > 1
extern "C" void* mellin_lanes_fft_alloc(int n, int inverse, void* memory, std::size_t* bytes);
extern "C" void* mellin_lanes_fftr_alloc(int n, int inverse, void* memory, std::size_t* bytes);
#endif

namespace {

struct Transform {
  explicit Transform(std::uint16_t side, VectorUnit unit = best_vector_unit()) {
    MeasureArena measure;
    Fft2::carve(measure, side);
    bytes = measure.use().total();
    memory.resize(bytes / sizeof(double));
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(memory.data()), bytes));
    REQUIRE(fft.init(side, Fft2::carve(arena, side), unit) == Status::ok);
    REQUIRE(arena.ok());
    REQUIRE(arena.use().total() == bytes);
  }
  std::vector<double> memory;
  std::size_t bytes = 0;
  Fft2 fft;
};

std::vector<float> noise(std::uint16_t side) {
  Random random(7, side);
  std::vector<float> image(std::size_t{side} * side);
  for (float& pixel : image) {
    pixel = static_cast<float>(random.uniform() - 0.3);
  }
  return image;
}

/// One coefficient by the definition of the transform.
std::complex<double> coefficient(const std::vector<float>& image, std::size_t side, std::size_t kx, std::size_t ky) {
  std::complex<double> sum = 0.0;
  for (std::size_t r = 0; r < side; ++r) {
    for (std::size_t c = 0; c < side; ++c) {
      const double turns = static_cast<double>((kx * c + ky * r) % side) / static_cast<double>(side);
      sum += static_cast<double>(image[r * side + c]) * std::polar(1.0, -kTwoPi * turns);
    }
  }
  return sum;
}

}  // namespace

TEST_SUITE("fft2") {
  TEST_CASE("which sides are taken") {
    for (const std::uint32_t side : {32U, 36U, 40U, 48U, 50U, 96U, 192U, 360U, 384U, 768U, 1000U, 1024U}) {
      CHECK(is_fft_side(side));
    }
    for (const std::uint32_t side : {0U, 1U, 16U, 30U, 33U, 45U, 56U, 94U, 1026U, 2048U}) {
      CHECK_FALSE(is_fft_side(side));
    }
  }

  TEST_CASE("plans take exactly what KissFFT asks for") {
    for (std::uint32_t side = 32; side <= 1024; side += 2) {
      if (!is_fft_side(side)) {
        continue;
      }
      for (const int inverse : {0, 1}) {
        std::size_t bytes = 0;
        kiss_fft_alloc(static_cast<int>(side), inverse, nullptr, &bytes);
        CHECK(bytes == complex_plan_bytes(side));
        bytes = 0;
        kiss_fftr_alloc(static_cast<int>(side), inverse, nullptr, &bytes);
        CHECK(bytes == real_plan_bytes(side));
#if MELLIN_FFT_LANES > 1
        bytes = 0;
        mellin_lanes_fft_alloc(static_cast<int>(side), inverse, nullptr, &bytes);
        CHECK(bytes == complex_plan_bytes(side, kFftLanes));
        bytes = 0;
        mellin_lanes_fftr_alloc(static_cast<int>(side), inverse, nullptr, &bytes);
        CHECK(bytes == real_plan_bytes(side, kFftLanes));
#endif
      }
    }
  }

  TEST_CASE("coefficients equal the transform's definition, for every kind of factor") {
    for (const std::uint16_t side : std::initializer_list<std::uint16_t>{32, 36, 40, 50, 60, 96, 128, 150, 162}) {
      CAPTURE(side);
      Transform transform(side);
      const std::vector<float> image = noise(side);
      std::vector<Complex> spectrum(spectrum_size(side));
      REQUIRE(transform.fft.forward({image.data(), image.size()}, {spectrum.data(), spectrum.size()}) == Status::ok);
      const std::size_t half = side / 2U;
      const std::size_t spots[][2] = {{0, 0},         {half, 0},     {0, half},     {half, half}, {1, 0}, {0, 1},
                                      {3, side - 2U}, {half - 1, 5}, {7, half + 1}, {half, 1},    {2, 2}};
      for (const auto& spot : spots) {
        const std::complex<double> expected = coefficient(image, side, spot[0], spot[1]);
        const Complex actual = spectrum[spot[0] * side + spot[1]];
        CHECK(
            std::abs(expected - std::complex<double>(static_cast<double>(actual.re), static_cast<double>(actual.im))) <
            2e-6 * static_cast<double>(side) * side);
      }
    }
  }

  TEST_CASE("back and forth is the image times the number of its pixels, also at the largest sides") {
    for (const std::uint16_t side :
         std::initializer_list<std::uint16_t>{32, 36, 50, 96, 100, 250, 384, 768, 1000, 1024}) {
      CAPTURE(side);
      Transform transform(side);
      const std::vector<float> image = noise(side);
      std::vector<Complex> spectrum(spectrum_size(side));
      std::vector<float> back(image.size());
      REQUIRE(transform.fft.forward({image.data(), image.size()}, {spectrum.data(), spectrum.size()}) == Status::ok);
      REQUIRE(transform.fft.inverse({spectrum.data(), spectrum.size()}, {back.data(), back.size()}) == Status::ok);
      double largest = 0.0;
      for (std::size_t i = 0; i < image.size(); ++i) {
        largest =
            std::max(largest, std::fabs(static_cast<double>(back[i]) / (side * side) - static_cast<double>(image[i])));
      }
      CHECK(largest < 2e-6);
    }
  }

  TEST_CASE("passes in parts of any size give the same bits as the whole") {
    for (const std::uint16_t side : std::initializer_list<std::uint16_t>{48, 50}) {
      Transform transform(side);
      const std::vector<float> image = noise(side);
      std::vector<Complex> whole(spectrum_size(side));
      std::vector<Complex> parts(spectrum_size(side));
      REQUIRE(transform.fft.forward({image.data(), image.size()}, {whole.data(), whole.size()}) == Status::ok);
      for (std::size_t r = 0; r < side; r += 3) {
        const std::size_t count = std::min<std::size_t>(3, side - r);
        transform.fft.forward_rows(image.data() + r * side, r, count, {parts.data(), parts.size()});
      }
      for (std::size_t kx = 0; kx <= side / 2U; ++kx) {
        transform.fft.forward_columns({parts.data(), parts.size()}, kx, 1);
      }
      for (std::size_t i = 0; i < whole.size(); ++i) {
        REQUIRE(whole[i].re == parts[i].re);
        REQUIRE(whole[i].im == parts[i].im);
      }
    }
  }

  TEST_CASE("lanes give the bits of the plain transform, and back") {
    for (const std::uint16_t side : std::initializer_list<std::uint16_t>{32, 50, 54, 96, 384}) {
      CAPTURE(side);
      Transform transform(side);
      const std::vector<float> image = noise(side);
      const std::size_t width = side / 2U + 1U;
      std::vector<Complex> spectrum(spectrum_size(side));
      std::vector<float> rows(Fft2::kBlock * side);
      std::vector<Complex> line(side);
      std::vector<float> back(side);
      std::vector<double> plan(complex_plan_bytes(side) / sizeof(double) + 1);
      std::size_t bytes = plan.size() * sizeof(double);
      REQUIRE(kiss_fft_alloc(side, 0, plan.data(), &bytes) != nullptr);
      for (const std::size_t count : {std::size_t{8}, std::size_t{4}, std::size_t{3}}) {
        transform.fft.forward_rows(image.data(), 2, count, {spectrum.data(), spectrum.size()});
        transform.fft.inverse_rows({spectrum.data(), spectrum.size()}, 2, count, rows.data());
        for (std::size_t r = 0; r < count; ++r) {
          transform.fft.forward_line(image.data() + r * side, line.data());
          transform.fft.inverse_line(line.data(), back.data());
          REQUIRE(spectrum[2 + r].re == line[0].re);
          REQUIRE(spectrum[2 + r].im == line[width - 1].re);
          for (std::size_t k = 1; k < width - 1; ++k) {
            REQUIRE(spectrum[k * side + 2 + r].re == line[k].re);
            REQUIRE(spectrum[k * side + 2 + r].im == line[k].im);
          }
          REQUIRE(std::equal(back.begin(), back.end(), rows.begin() + static_cast<std::ptrdiff_t>(r * side)));
        }
      }
      for (std::size_t i = 0; i < spectrum.size(); ++i) {
        spectrum[i] = {image[i], image[image.size() - 1 - i]};
      }
      const std::vector<Complex> before = spectrum;
      transform.fft.forward_columns({spectrum.data(), spectrum.size()}, 0, width);
      for (std::size_t kx = 1; kx < width - 1; ++kx) {
        kiss_fft(plan.data(), before.data() + kx * side, line.data());
        for (std::size_t k = 0; k < side; ++k) {
          REQUIRE(spectrum[kx * side + k].re == line[k].re);
          REQUIRE(spectrum[kx * side + k].im == line[k].im);
        }
      }
    }
  }

  TEST_CASE("every vector unit gives the same bits") {
    for (const std::uint16_t side : std::initializer_list<std::uint16_t>{32, 50, 96, 162, 360}) {
      CAPTURE(side);
      Transform portable(side, VectorUnit::portable);
      Transform widest(side, best_vector_unit());
      const std::vector<float> image = noise(side);
      std::vector<Complex> spectra[2] = {std::vector<Complex>(spectrum_size(side)),
                                         std::vector<Complex>(spectrum_size(side))};
      std::vector<float> images[2] = {std::vector<float>(image.size()), std::vector<float>(image.size())};
      for (Transform* const transform : {&portable, &widest}) {
        const std::size_t i = transform == &widest ? 1 : 0;
        const Span<Complex> spectrum(spectra[i].data(), spectra[i].size());
        REQUIRE(transform->fft.forward({image.data(), image.size()}, spectrum) == Status::ok);
        std::vector<Complex> copy = spectra[i];
        REQUIRE(transform->fft.inverse({copy.data(), copy.size()}, {images[i].data(), images[i].size()}) == Status::ok);
      }
      CHECK(std::memcmp(spectra[0].data(), spectra[1].data(), spectra[0].size() * sizeof(Complex)) == 0);
      CHECK(std::memcmp(images[0].data(), images[1].data(), images[0].size() * sizeof(float)) == 0);
    }
  }

  TEST_CASE("a wrong side and too little memory are refused") {
    Transform transform(96);
    MeasureArena measure;
    Fft2 fft;
    CHECK(fft.init(94, Fft2::carve(measure, 94)) == Status::invalid_config);
    CHECK(fft.init(96, {}) == Status::insufficient_memory);
    std::vector<double> memory(transform.bytes / sizeof(double));
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(memory.data()), transform.bytes));
    CHECK(fft.init(128, Fft2::carve(arena, 96)) == Status::insufficient_memory);
  }
}
