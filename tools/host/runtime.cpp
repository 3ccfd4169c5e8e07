#include "host/runtime.hpp"

#include <fftw3.h>
#include <time.h>

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <stdexcept>

#include "host/heap_arena.hpp"
#include "host/simulator.hpp"
#include "mellin/collection/screening.hpp"
#include "mellin/config.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/matcher.hpp"

namespace mellin::host {
namespace {

constexpr std::uint16_t kScans = 40;
constexpr std::uint16_t kGridSide = 768;
constexpr float kCell_m = 0.05F;
constexpr std::size_t kQueries = 9;       // that are screened against all
constexpr std::size_t kLeastSamples = 9;  // of a median …
constexpr double kLeastSeconds = 0.2;     // … which take so long at least

/// Of the processor, by this thread: others on the machine do not count.
double seconds_now() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Seconds of run(i), i = 0, 1, …: the median.
template <class Run>
double median_seconds(Run&& run) {
  std::vector<double> samples;
  const double begin = seconds_now();
  while (samples.size() < kLeastSamples || seconds_now() - begin < kLeastSeconds) {
    const double start = seconds_now();
    run(samples.size());
    samples.push_back(seconds_now() - start);
  }
  return median(std::move(samples));
}

double fftw_us(std::uint16_t side) {
  struct Free {
    void operator()(void* memory) const { fftwf_free(memory); }
  };
  const std::size_t pixels = std::max<std::size_t>(1, std::size_t{side} * side);
  const std::unique_ptr<float, Free> image(fftwf_alloc_real(pixels));
  const std::unique_ptr<fftwf_complex, Free> spectrum(fftwf_alloc_complex(std::size_t{side} * (side / 2U + 1)));
  fftwf_plan_s* const plan = fftwf_plan_dft_r2c_2d(side, side, image.get(), spectrum.get(), FFTW_MEASURE);
  for (std::size_t i = 0; i < pixels; ++i) {
    image.get()[i] = static_cast<float>(i % 7);
  }
  // In batches: one small transform is shorter than a look at the clock.
  const int batch = std::max(1, 400'000 / static_cast<int>(pixels));
  const double seconds = median_seconds([&](std::size_t) {
    for (int k = 0; k < batch; ++k) {
      fftwf_execute(plan);
    }
  });
  fftwf_destroy_plan(plan);
  return seconds * 1e6 / batch;
}

void expect(bool good, const char* what) {
  if (!good) {
    throw std::runtime_error(std::string("measuring run times: ") + what);
  }
}

MatcherConfig matcher_config(std::uint16_t side, std::uint8_t peaks) {
  MatcherConfig config;
  config.side = side;
  config.pixel_m = kCell_m * kGridSide / static_cast<float>(side);
  config.max_peaks = peaks;
  config.peak_share = 0.0F;
  return config;
}

/// The library's own screening over the digests of all submaps.
class Screening {
 public:
  Screening(const std::vector<EvalSubmap>& submaps, std::uint16_t side, std::uint8_t peaks) : submaps_(submaps) {
    ScreeningConfig config;
    config.grid_side = kGridSide;
    config.max_submaps = static_cast<std::uint32_t>(submaps.size());
    config.matcher = matcher_config(side, peaks);
    config.min_rotation_peak = 0.0F;
    config.matcher.turns_per_bin = desktop_profile().screening.matcher.turns_per_bin;
    config.matcher.kept_turns = static_cast<std::uint16_t>(config.matcher.turns_per_bin * side);
    const SpectralScreening::Memory memory =
        memory_.carve([&config](auto& arena) { return SpectralScreening::carve(arena, config); });
    expect(screening_.init(config, memory) == Status::ok, "the screening was refused");
  }
  void describe(std::size_t index) {
    const Status begun = screening_.begin_describe(static_cast<std::uint32_t>(index), submaps_[index].grid.view());
    expect(begun == Status::ok, "a submap was refused");
    finish();
  }
  void compare(std::size_t a, std::size_t b) {
    if (screening_.begin_compare(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)) == Status::ok) {
      finish();
    }
  }

 private:
  void finish() {
    while (!screening_.step()) {
    }
  }
  const std::vector<EvalSubmap>& submaps_;
  HeapArena memory_;
  SpectralScreening screening_;
};

double extract_us(const std::vector<EvalSubmap>& submaps, std::uint16_t side) {
  Screening screening(submaps, side, 1);
  return 1e6 * median_seconds([&](std::size_t i) { screening.describe(i % submaps.size()); });
}

/// A query meets all others; the first of them finds nothing kept of it.
double screen_us(const std::vector<EvalSubmap>& submaps, std::uint16_t side, std::uint8_t peaks) {
  Screening screening(submaps, side, peaks);
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    screening.describe(i);
  }
  std::vector<double> samples;
  for (std::size_t k = 0; k < kQueries; ++k) {
    const std::size_t query = (k * submaps.size()) / kQueries;
    const double start = seconds_now();
    for (std::size_t i = 0; i < submaps.size(); ++i) {
      if (i != query) {
        screening.compare(i, query);
      }
    }
    samples.push_back(1e6 * (seconds_now() - start) / static_cast<double>(submaps.size() - 1));
  }
  return median(std::move(samples));
}

double register_us(const std::vector<EvalSubmap>& submaps, std::uint16_t side, std::uint8_t peaks) {
  const MatcherConfig config = matcher_config(side, peaks);
  HeapArena matcher_memory;
  Matcher matcher;
  const Matcher::Memory memory = matcher_memory.carve([&](auto& arena) { return Matcher::carve(arena, config); });
  expect(matcher.init(config, memory) == Status::ok, "the matcher was refused");
  const std::size_t count = std::min(kLeastSamples + 1, submaps.size());
  std::vector<HeapArena> feature_memory(count);
  std::vector<Features> features;
  for (std::size_t i = 0; i < count; ++i) {
    const GridView grid = submaps[i * (submaps.size() - 1) / (count - 1)].grid.view();
    HeapArena digest_memory;
    DigestOut picture = digest_memory.carve([&](auto& arena) { return DigestOut::carve(arena, side); });
    std::vector<float> scratch(DigestMaker::scratch_size(kGridSide, side));
    expect(make_digest(grid, {scratch.data(), scratch.size()}, picture) == Status::ok, "a submap was refused");
    features.push_back(feature_memory[i].carve([&](auto& arena) { return Features::carve(arena, config); }));
    expect(matcher.extract(picture.obstacles, features.back(), picture.observed) == Status::ok, "an empty submap");
  }
  return 1e6 * median_seconds([&](std::size_t i) {
           const Status matched = matcher.match(features[i % count], features[(i + 1) % count]);
           expect(matched == Status::ok, "a match was refused");
         });
}

}  // namespace

LiveDrive simulated_drive() {
  const SimOptions options;
  const SimSession session = simulate(options, 0);
  Log log;
  log.path = "simulated";
  LaserSpec laser;
  laser.beams = static_cast<std::size_t>(options.beams);
  laser.angle_min_rad = -kPi / 2;
  laser.increment_rad = kPi / (options.beams >= 360 ? 360 : 180);
  laser.max_range_m = options.range_m;
  log.lasers = {laser};
  std::vector<StampedPose> truth;
  for (const SimScan& scan : session.scans) {
    LogScan line;
    line.seconds = scan.seconds;
    line.stamp = std::to_string(scan.seconds);
    line.odometry = scan.odometry_T_base;
    line.ranges = scan.ranges;
    log.scans.push_back(line);
    truth.push_back({line.stamp, scan.seconds, scan.world_T_base});
  }
  return drive_live(log, truth);
}

std::vector<EvalSubmap> runtime_submaps(const std::vector<LiveDrive>& drives, std::uint64_t seed) {
  std::size_t scans = 0;
  for (const LiveDrive& drive : drives) {
    scans += drive.scans.size();
  }
  SubmapOptions options;
  options.scans = kScans;
  options.side = kGridSide;
  options.cell_m = kCell_m;
  options.seed = seed;
  options.every = static_cast<std::uint16_t>(std::clamp<std::size_t>(scans / kRuntimeCollection, 1, kScans / 4U));
  std::vector<EvalSubmap> submaps = make_submaps(drives, options);
  if (submaps.size() < 2) {
    throw std::runtime_error("expected two submaps of 40 scans at least, found " + std::to_string(submaps.size()));
  }
  while (submaps.size() > kRuntimeCollection) {
    // Every second one of the surplus goes, so that what stays is spread over the whole drive.
    const std::size_t surplus = submaps.size() - kRuntimeCollection;
    const std::size_t step = std::max<std::size_t>(2, submaps.size() / surplus);
    std::vector<EvalSubmap> kept;
    std::size_t dropped = 0;
    for (std::size_t i = 0; i < submaps.size(); ++i) {
      if (i % step == 1 && dropped < surplus) {
        ++dropped;
      } else {
        kept.push_back(std::move(submaps[i]));
      }
    }
    submaps = std::move(kept);
  }
  return submaps;
}

std::vector<RuntimeRow> measure_runtime(const std::vector<EvalSubmap>& submaps) {
  std::vector<RuntimeRow> rows;
  for (const std::uint16_t side : std::initializer_list<std::uint16_t>{48, 96, 192}) {
    rows.push_back({"extract", side, 0, extract_us(submaps, side), fftw_us(side), 1});
  }
  for (const std::uint16_t side : std::initializer_list<std::uint16_t>{48, 96}) {
    for (const std::uint8_t peaks : std::initializer_list<std::uint8_t>{1, 2, 6}) {
      rows.push_back({"screen", side, peaks, screen_us(submaps, side, peaks), fftw_us(side), 2U * peaks});
    }
  }
  for (const std::uint16_t side : std::initializer_list<std::uint16_t>{192, 384, 768}) {
    for (const std::uint8_t peaks : std::initializer_list<std::uint8_t>{1, 2, 6}) {
      rows.push_back({"register", side, peaks, register_us(submaps, side, peaks), fftw_us(side), 3U * peaks});
    }
  }
  return rows;
}

}  // namespace mellin::host
