#include "host/cascade.hpp"

#include <time.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "host/heap_arena.hpp"
#include "mellin/collection/screening.hpp"

namespace mellin::host {
namespace {

double seconds_now() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void finish(SpectralScreening& screening) {
  while (!screening.step()) {
  }
}

std::set<std::pair<SubmapId, SubmapId>> linked_pairs(const MapCollection& map) {
  std::set<std::pair<SubmapId, SubmapId>> pairs;
  for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
    const Edge& edge = map.graph().edge(id);
    if (edge.enabled && edge.kind != EdgeKind::odometry) {
      pairs.emplace(std::min(edge.a, edge.b), std::max(edge.a, edge.b));
    }
  }
  return pairs;
}

/// Pairs that the graph had in one place when they were screened.
std::set<std::pair<SubmapId, SubmapId>> nearby_pairs(const MappingRun& run) {
  std::set<std::pair<SubmapId, SubmapId>> pairs;
  for (const MatchRow& row : run.matches()) {
    if (row.nearby) {
      pairs.emplace(row.a, row.b);
    }
  }
  return pairs;
}

NodeScans scans_of(const MapCollection& map, SubmapId id) {
  return {map.session_of(id), map.stretch_of(id), map.header(id).first_scan, map.header(id).scan_count};
}

void describe(MappingRun& run, SpectralScreening& screening, SubmapId id) {
  bool described = false;
  run.with_grid(id, [&](const GridView& grid) {
    described = screening.begin_describe(id, grid) == Status::ok;
    finish(screening);
  });
  if (!described) {
    throw std::runtime_error("submap " + std::to_string(id) + " cannot be described");
  }
}

void count(const SpectralScreening& screening, float candidate_agreement, bool edge, CascadeCounts& counts) {
  const CompareEnd end = screening.compare_end();
  const bool dropped = end == CompareEnd::coarse || end == CompareEnd::rotation;
  const PlaceHypotheses& found = screening.hypotheses();
  const bool candidate = !dropped && !found.empty() && found[0].agreement >= candidate_agreement;
  counts.dropped_coarse += end == CompareEnd::coarse ? 1U : 0U;
  counts.dropped_rotation += end == CompareEnd::rotation ? 1U : 0U;
  counts.cut_short += end == CompareEnd::first_peaks ? 1U : 0U;
  counts.candidates += candidate ? 1U : 0U;
  counts.edges_kept += candidate && edge ? 1U : 0U;
}

}  // namespace

Config without_cascade(Config config) {
  ScreeningConfig& s = config.screening;
  s.matcher.max_peaks = kMaxRotationPeaks;
  s.coarse_peaks = 0;
  s.min_rotation_peak = 0.0F;
  s.first_peaks = kMaxRotationPeaks;
  s.verified = 255;
  s.verified_share = 0.0F;
  return config;
}

CascadeCounts screen_all(MappingRun& run, const Config& config) {
  const MapCollection& map = run.slam().collection();
  ScreeningConfig settings = resolved(config).screening;
  settings.max_submaps = map.size();
  settings.hold_digests = true;  // the run's store is not asked; the results are the same
  HeapArena memory;
  SpectralScreening screening;
  const SpectralScreening::Memory carved =
      memory.carve([&](auto& arena) { return SpectralScreening::carve(arena, settings); });
  const Status status = screening.init(settings, carved);
  if (status != Status::ok) {
    throw std::runtime_error(std::string("the library refuses the screening: ") + to_string(status));
  }
  const std::set<std::pair<SubmapId, SubmapId>> linked = linked_pairs(map);
  const std::set<std::pair<SubmapId, SubmapId>> nearby = nearby_pairs(run);
  CascadeCounts counts;
  double seconds = 0.0;
  for (SubmapId b = 0; b < map.size(); ++b) {
    describe(run, screening, b);
    for (SubmapId a = 0; a < b; ++a) {
      if (share_scans(scans_of(map, a), scans_of(map, b))) {
        continue;
      }
      const bool edge = linked.count({a, b}) != 0;
      ++counts.pairs;
      counts.edges += edge ? 1U : 0U;
      const bool thorough = nearby.count({a, b}) != 0;
      counts.nearby += thorough ? 1U : 0U;
      const double start = seconds_now();
      const bool begun = screening.begin_compare(a, b, thorough) == Status::ok;
      finish(screening);
      seconds += seconds_now() - start;
      if (begun) {
        count(screening, config.collection.candidate_agreement, edge, counts);
      }
    }
  }
  counts.us_a_pair = counts.pairs > 0 ? 1e6 * seconds / static_cast<double>(counts.pairs) : 0.0;
  return counts;
}

}  // namespace mellin::host
