// Times of the spectral matcher, stage by stage and size by size, beside FFTW's for one real 2D FFT of that size
// (float, planned with FFTW_MEASURE, one thread).
//
//   build/host/bin/mellin_bench --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
//
// The counter `ffts` is a stage's time in FFTs of FFTW, measured once at the start of the same run.
#include <benchmark/benchmark.h>
#include <fftw3.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "host/heap_arena.hpp"
#include "mellin/core/arena.hpp"
#include "mellin/spectral/fft2.hpp"
#include "mellin/spectral/matcher.hpp"

namespace {

using mellin::Arena;
using mellin::Span;

/// What Component::carve() gives for `config`, over memory of its own.
template <class Component, class Config>
struct Carved {
  explicit Carved(const Config& config)
      : memory(heap.carve([&](auto& arena) { return Component::carve(arena, config); })) {}

  mellin::host::HeapArena heap;
  decltype(Component::carve(std::declval<Arena&>(), std::declval<const Config&>())) memory;
};

/// A picture like a submap's: walls, in six directions so that there are as many rotation peaks, turned by `angle_rad`.
std::vector<std::uint8_t> picture(int side, double angle_rad) {
  const auto width = static_cast<std::size_t>(side);
  std::vector<std::uint8_t> pixels(width * width);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.35, 0.35);
  for (int wall = 0; wall < 36; ++wall) {
    const double c = std::cos(angle_rad + wall * std::numbers::pi / 6.0);
    const double s = std::sin(angle_rad + wall * std::numbers::pi / 6.0);
    const double start = uniform(random);
    const double end = uniform(random);
    const double across = uniform(random);
    for (int i = 0; i <= 4 * side; ++i) {
      const double x = start + (end - start) * i / (4.0 * side);
      const int column = static_cast<int>(std::floor((0.5 + c * x - s * across) * side));
      const int row = static_cast<int>(std::floor((0.5 + s * x + c * across) * side));
      pixels[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)] = 255;
    }
  }
  return pixels;
}

class Fftw {
 public:
  explicit Fftw(int side)
      : image_(fftwf_alloc_real(static_cast<std::size_t>(side) * static_cast<std::size_t>(side))),
        spectrum_(fftwf_alloc_complex(static_cast<std::size_t>(side) * static_cast<std::size_t>(side / 2 + 1))),
        plan_(fftwf_plan_dft_r2c_2d(side, side, image_.get(), spectrum_.get(), FFTW_MEASURE)) {
    const std::vector<std::uint8_t> pixels = picture(side, 0.3);
    std::copy(pixels.begin(), pixels.end(), image_.get());
  }
  Fftw(const Fftw&) = delete;
  Fftw& operator=(const Fftw&) = delete;
  ~Fftw() { fftwf_destroy_plan(plan_); }

  void forward() {
    fftwf_execute(plan_);
    benchmark::DoNotOptimize(spectrum_.get());
    benchmark::ClobberMemory();
  }

 private:
  struct Free {
    void operator()(void* memory) const { fftwf_free(memory); }
  };
  std::unique_ptr<float, Free> image_;
  std::unique_ptr<fftwf_complex, Free> spectrum_;
  fftwf_plan plan_;
};

/// Seconds that FFTW takes for one transform: the median of 21 batches.
double fftw_seconds(int side) {
  static std::map<int, double> known;
  if (const auto found = known.find(side); found != known.end()) {
    return found->second;
  }
  Fftw fftw(side);
  const int batch = std::max(1, 2'000'000 / (side * side));
  std::vector<double> seconds;
  for (int i = 0; i < 21; ++i) {
    const auto start = std::chrono::steady_clock::now();
    for (int j = 0; j < batch; ++j) {
      fftw.forward();
    }
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / batch);
  }
  std::nth_element(seconds.begin(), seconds.begin() + 10, seconds.end());
  return known[side] = seconds[10];
}

/// Runs `stage` as often as `state` asks for and sets the counter `ffts`.
template <class Stage>
void run_beside_fftw(benchmark::State& state, int side, Stage stage) {
  const auto start = std::chrono::steady_clock::now();
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(stage());
    benchmark::ClobberMemory();
  }
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  state.counters["ffts"] = taken.count() / static_cast<double>(state.iterations()) / fftw_seconds(side);
}

void fftw(benchmark::State& state) {
  Fftw fftw(static_cast<int>(state.range(0)));
  for ([[maybe_unused]] auto _ : state) {
    fftw.forward();
  }
}

void fft2(benchmark::State& state) {
  const auto side = static_cast<std::uint16_t>(state.range(0));
  Carved<mellin::Fft2, std::uint16_t> carved(side);
  mellin::Fft2 fft;
  if (fft.init(side, carved.memory) != mellin::Status::ok) {
    state.SkipWithError("no plan");
    return;
  }
  const std::vector<std::uint8_t> pixels = picture(side, 0.3);
  std::vector<float> image(pixels.begin(), pixels.end());
  std::vector<mellin::Complex> spectrum(mellin::spectrum_size(side));
  run_beside_fftw(state, side, [&] {
    return fft.forward(Span<const float>(image.data(), image.size()),
                       Span<mellin::Complex>(spectrum.data(), spectrum.size()));
  });
}

/// A matcher and two pictures of the same place. With a share of 0 every rotation peak is tried, so that `peaks` says
/// how many.
struct Bench {
  Bench(int side, int peaks)
      : config{.side = static_cast<std::uint16_t>(side),
               .max_peaks = static_cast<std::uint8_t>(peaks),
               .peak_share = 0.0F} {
    pixels_a = picture(side, 0.3);
    pixels_b = picture(side, 1.1);
    ready = matcher.init(config, matcher_memory.memory) == mellin::Status::ok &&
            extract(pixels_a, a.memory) == mellin::Status::ok && extract(pixels_b, b.memory) == mellin::Status::ok;
  }
  mellin::Status extract(const std::vector<std::uint8_t>& pixels, mellin::Features& out) {
    return matcher.extract(Span<const std::uint8_t>(pixels.data(), pixels.size()), out);
  }

  mellin::MatcherConfig config;
  Carved<mellin::Matcher, mellin::MatcherConfig> matcher_memory{config};
  Carved<mellin::Features, mellin::MatcherConfig> a{config};
  Carved<mellin::Features, mellin::MatcherConfig> b{config};
  mellin::Matcher matcher;
  std::vector<std::uint8_t> pixels_a;
  std::vector<std::uint8_t> pixels_b;
  bool ready = false;
};

void extract(benchmark::State& state) {
  const auto side = static_cast<int>(state.range(0));
  Bench bench(side, 1);
  if (!bench.ready) {
    state.SkipWithError("no features");
    return;
  }
  run_beside_fftw(state, side, [&] { return bench.extract(bench.pixels_a, bench.a.memory); });
}

void match(benchmark::State& state) {
  const auto side = static_cast<int>(state.range(0));
  Bench bench(side, static_cast<int>(state.range(1)));
  if (!bench.ready) {
    state.SkipWithError("no features");
    return;
  }
  run_beside_fftw(state, side, [&] { return bench.matcher.match(bench.a.memory, bench.b.memory); });
  state.counters["hypotheses"] = static_cast<double>(bench.matcher.hypotheses().size());
}

const std::vector<std::int64_t> kSides = {48, 96, 192, 384, 768};

BENCHMARK(fftw)->ArgName("side")->ArgsProduct({kSides})->Unit(benchmark::kMicrosecond);
BENCHMARK(fft2)->ArgName("side")->ArgsProduct({kSides})->Unit(benchmark::kMicrosecond);
BENCHMARK(extract)->ArgName("side")->ArgsProduct({kSides})->Unit(benchmark::kMicrosecond);
BENCHMARK(match)->ArgNames({"side", "peaks"})->ArgsProduct({kSides, {1, 2, 6}})->Unit(benchmark::kMicrosecond);

}  // namespace
