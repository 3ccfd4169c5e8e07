// Times of local mapping on a simulated office floor, per profile: a scan that is taken into the live map, one that is
// only matched to it, and what a submap costs (smoothing its scans' poses, rendering them).
//
//   build/host/bin/mellin_bench --benchmark_filter=mapping
//
// Each number is the mean over a drive of 150 m with 180 beams, a scan every 0.1 m; the counter `worst_us` is the
// longest single call in it.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

#include "host/heap_arena.hpp"
#include "host/simulator.hpp"
#include "mellin/config.hpp"
#include "mellin/core/arena.hpp"

namespace {

using mellin::Span;

enum class Of : int { taken, other, submap };

mellin::Config profile(int number) {
  mellin::Config config = number == 0   ? mellin::desktop_profile()
                          : number == 1 ? mellin::micro_profile()
                                        : mellin::nano_profile();
  config.lasers[0].beams = 180;
  config.lasers[0].max_range_m = 12.0F;
  return mellin::resolved(config);
}

const mellin::host::SimSession& drive() {
  static const mellin::host::SimSession session = [] {
    mellin::host::SimOptions options = mellin::host::options_for(mellin::host::SimKind::offices);
    options.path_m = 150.0;
    options.spacing_m = 0.1;
    return mellin::host::simulate(options, 0);
  }();
  return session;
}

/// Maps the drive once.
class Pass {
 public:
  explicit Pass(const mellin::Config& config) : cells_(std::size_t{config.side} * config.side) {
    const auto mapper = [&](auto& arena) { return mellin::ParticleMapper::carve(arena, config.mapper); };
    const auto builder = [&](auto& arena) { return mellin::SubmapBuilder::carve(arena, config.submaps); };
    mapper_ = mellin::ParticleMapper(config.mapper, mapper_memory_.carve(mapper),
                                     Span<const mellin::LaserConfig>(config.lasers, mellin::kMaxLasers), 1);
    builder_ = mellin::SubmapBuilder(config.submaps, builder_memory_.carve(builder));
  }

  void add(const mellin::host::SimScan& in) {
    mellin::Scan scan;
    scan.ranges_m = Span<const float>(in.ranges.data(), in.ranges.size());
    scan.odom_T_base = in.odometry_T_base;
    const auto before = std::chrono::steady_clock::now();
    const auto outcome = mapper_.add(scan);
    const bool taken = outcome.ok() && outcome.value().taken;
    record(taken ? Of::taken : Of::other, before);
    if (taken && builder_.scan_taken(mapper_)) {
      make_submap();
    }
  }

  double mean_s(Of of) const { return sum_[index(of)] / std::max(1.0, count_[index(of)]); }
  double worst_s(Of of) const { return worst_[index(of)]; }
  double count(Of of) const { return count_[index(of)]; }

 private:
  static std::size_t index(Of of) { return static_cast<std::size_t>(of); }

  void make_submap() {
    const auto before = std::chrono::steady_clock::now();
    if (builder_.begin(mapper_, Span<std::uint8_t>(cells_.data(), cells_.size())) == mellin::Status::ok) {
      for (bool done = false; !done;) {
        const auto step = builder_.step(mapper_.scans());
        done = !step.ok() || step.value();
      }
    }
    record(Of::submap, before);
  }

  void record(Of of, std::chrono::steady_clock::time_point before) {
    const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
    sum_[index(of)] += spent;
    count_[index(of)] += 1.0;
    worst_[index(of)] = std::max(worst_[index(of)], spent);
  }

  mellin::host::HeapArena mapper_memory_;
  mellin::host::HeapArena builder_memory_;
  std::vector<std::uint8_t> cells_;
  mellin::ParticleMapper mapper_;
  mellin::SubmapBuilder builder_;
  double sum_[3] = {};
  double count_[3] = {};
  double worst_[3] = {};
};

void mapping(benchmark::State& state, int number, Of of) {
  const mellin::Config config = profile(number);
  for ([[maybe_unused]] auto _ : state) {
    Pass pass(config);
    for (const mellin::host::SimScan& scan : drive().scans) {
      pass.add(scan);
    }
    state.SetIterationTime(pass.mean_s(of));
    state.counters["worst_us"] = 1e6 * pass.worst_s(of);
    state.counters["calls"] = pass.count(of);
  }
}

}  // namespace

#define MAPPING(name, number)                                   \
  BENCHMARK_CAPTURE(mapping, name##_taken, number, Of::taken)   \
      ->UseManualTime()                                         \
      ->Unit(benchmark::kMicrosecond)                           \
      ->Iterations(3);                                          \
  BENCHMARK_CAPTURE(mapping, name##_other, number, Of::other)   \
      ->UseManualTime()                                         \
      ->Unit(benchmark::kMicrosecond)                           \
      ->Iterations(3);                                          \
  BENCHMARK_CAPTURE(mapping, name##_submap, number, Of::submap) \
      ->UseManualTime()                                         \
      ->Unit(benchmark::kMicrosecond)                           \
      ->Iterations(3)

MAPPING(desktop, 0);
MAPPING(micro, 1);
MAPPING(nano, 2);
