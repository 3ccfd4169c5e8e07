// The whole system in one process, on a simulated floor whose truth is known.
#include <doctest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "host/heap_counter.hpp"
#include "host/mapping_run.hpp"
#include "host/scorer.hpp"
#include "ramflash/heap_flash.hpp"
#include "tests/support/simulated_log.hpp"

using namespace mellin;
using mellin::test::kSanitized;
using mellin::test::simulated_log;
using mellin::test::SimulatedLog;

namespace {

/// Twice round the ring, or a short drive where each step is checked by the sanitizers.
const SimulatedLog& drive() {
  static const SimulatedLog log = [] {
    host::SimOptions options;
    options.loops = 2;
    return simulated_log(options, 0, kSanitized ? 500 : 0);
  }();
  return log;
}

Config config_for(const host::Log& log) {
  Config config = micro_profile();
  (void)host::add_lasers(config, log);
  return config;
}

Scan scan_of(const host::LogScan& in) {
  Scan scan;
  scan.stamp_us = static_cast<std::int64_t>(std::llround(in.seconds * 1e6));
  scan.ranges_m = Span<const float>(in.ranges.data(), in.ranges.size());
  scan.odom_T_base = in.odometry;
  return scan;
}

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }
bool same_bits(const Pose2& a, const Pose2& b) {
  return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.theta, b.theta);
}

/// What two runs are compared by: every live pose, every pose of the graph, every edge.
struct Record {
  std::vector<Pose2> live;
  std::vector<Pose2> submaps;
  std::vector<Edge> edges;
};

bool same_bits(const Record& a, const Record& b) {
  if (a.live.size() != b.live.size() || a.submaps.size() != b.submaps.size() || a.edges.size() != b.edges.size()) {
    return false;
  }
  bool same = true;
  for (std::size_t i = 0; i < a.live.size(); ++i) {
    same = same && same_bits(a.live[i], b.live[i]);
  }
  for (std::size_t i = 0; i < a.submaps.size(); ++i) {
    same = same && same_bits(a.submaps[i], b.submaps[i]);
  }
  for (std::size_t i = 0; i < a.edges.size(); ++i) {
    const Edge& e = a.edges[i];
    const Edge& f = b.edges[i];
    same = same && e.a == f.a && e.b == f.b && e.kind == f.kind && e.enabled == f.enabled &&
           same_bits(e.a_T_b, f.a_T_b) && same_bits(e.information.xx, f.information.xx) &&
           same_bits(e.information.tt, f.information.tt) && same_bits(e.weight, f.weight);
  }
  return same;
}

/// Runs the first `scans` of the drive, draining the work after each in slices of `budget`.
Record run(const Config& config, std::size_t scans, std::uint32_t budget) {
  port::HeapFlash flash({4096, 1024, 256});
  mellin_port port = {};
  port.flash = flash.flash();
  std::vector<std::uint64_t> memory(required_bytes(config) / 8);
  Result<Slam*> made =
      Slam::create(config, {reinterpret_cast<std::byte*>(memory.data()), required_bytes(config)}, port);
  REQUIRE(made.ok());
  Slam& slam = *made.value();
  Record record;
  for (std::size_t i = 0; i < scans; ++i) {
    const Result<ScanOutcome> outcome = slam.add(scan_of(drive().log.scans[i]));
    REQUIRE(outcome.ok());
    record.live.push_back(outcome.value().session_T_base);
    while (slam.work(budget)) {
    }
  }
  REQUIRE(slam.begin_flush() == Status::ok);
  while (slam.work(budget)) {
  }
  for (SubmapId id = 0; id < slam.collection().size(); ++id) {
    record.submaps.push_back(slam.collection().map_T_submap(id));
  }
  for (EdgeId id = 0; id < slam.collection().graph().edge_count(); ++id) {
    record.edges.push_back(slam.collection().graph().edge(id));
  }
  return record;
}

std::size_t count_edges(const PoseGraph& graph, EdgeKind kind) {
  std::size_t count = 0;
  for (EdgeId id = 0; id < graph.edge_count(); ++id) {
    count += graph.edge(id).enabled && graph.edge(id).kind == kind ? 1U : 0U;
  }
  return count;
}

}  // namespace

TEST_CASE("twice round a building: loops are closed and mend the trajectory; the heap is not touched") {
  port::HeapFlash flash({});
  const host::Log& log = drive().log;
  host::reset_heap_counts();
  host::MappingRun run(config_for(log), flash.flash(), {});
  run.map(log, {0}, {});
  CHECK(host::heap_counts().allocations == 0);
  CHECK(host::heap_is_counted() != kSanitized);
  if (!host::heap_is_counted()) {
    MESSAGE("the heap is not counted under sanitizers");
  }
  REQUIRE(run.sessions().size() == 1);
  const host::MappedSession& session = run.sessions()[0];
  REQUIRE(session.scans.size() == log.scans.size());
  const host::TrajectoryScore live = host::score_trajectory(run.live_trajectory(session), drive().truth);
  const host::TrajectoryScore last = host::score_trajectory(run.final_trajectory(session), drive().truth);
  REQUIRE(live.scored);
  REQUIRE(last.scored);
  CHECK(last.paired == log.scans.size());
  const MapCollection& map = run.slam().collection();
  CHECK(map.graph().component_count() == 1);
  // Every submap is in the store, and hangs on the one before.
  CHECK(run.slam().store().submap_count() == map.size());
  CHECK(count_edges(map.graph(), EdgeKind::odometry) == map.size() - 1);
  if (kSanitized) {
    return;  // the drive was cut before its first loop
  }
  CHECK(count_edges(map.graph(), EdgeKind::loop) > 0);
  CHECK(live.ate_rmse_m > 0.5);  // the bare bend has done its work …
  CHECK(last.ate_rmse_m < 0.5 * live.ate_rmse_m);
  // The counts fit together.
  const CollectionStatistics& s = map.statistics();
  CHECK(s.pairs_screened <= s.pairs_possible);
  CHECK(s.pairs_registered <= s.pairs_screened);
  CHECK(s.pairs_accepted == count_edges(map.graph(), EdgeKind::loop));
  CHECK(s.stored == map.size());
  CHECK(s.not_stored == 0);
}

TEST_CASE("the same input gives the same bits, however the work is sliced; another seed gives others") {
  Config config = config_for(drive().log);
  const std::size_t scans = kSanitized ? 250 : 900;
  const Record once = run(config, scans, 1);
  CHECK(same_bits(once, run(config, scans, 1000)));
  CHECK(once.submaps.size() > 2);
  // One particle does not sample: the seed shows with several.
  config.mapper.particles = 10;
  config.side = 160;
  config.cell_m = 0.2F;
  config.class_side = 80;
  const std::size_t fewer = kSanitized ? 60 : 250;
  const Record sampled = run(config, fewer, 64);
  CHECK(same_bits(sampled, run(config, fewer, 7)));
  config.seed = 2;
  CHECK_FALSE(same_bits(sampled, run(config, fewer, 64)));
}

TEST_CASE("digests give the same map from flash as from RAM") {
  Config config = nano_profile();
  (void)host::add_lasers(config, drive().log);
  REQUIRE_FALSE(config.screening.hold_digests);
  const std::size_t scans = kSanitized ? 250 : 2000;
  const Record paged = run(config, scans, 64);
  config.screening.hold_digests = true;
  CHECK(same_bits(paged, run(config, scans, 64)));
  config.screening.cache_features = true;
  CHECK(same_bits(paged, run(config, scans, 64)));
  CHECK(paged.submaps.size() > 2);
  CHECK((kSanitized || paged.edges.size() >= paged.submaps.size()));  // with loops among them
}

TEST_CASE("a robot restarted over its flash finds its whole map and goes on from it") {
  port::HeapFlash flash({});
  const host::Log& log = drive().log;
  Config config = config_for(log);
  SUBCASE("with digests in RAM") { REQUIRE(config.screening.hold_digests); }
  SUBCASE("with digests in flash") {
    config = nano_profile();
    (void)host::add_lasers(config, log);
  }
  std::vector<Pose2> submaps;
  std::vector<SubmapHeader> headers;
  std::vector<Edge> edges;
  std::vector<std::uint32_t> checksums;
  {
    host::MappingRun first(config, flash.flash(), {});
    first.map(log, {0}, {});
    const MapCollection& map = first.slam().collection();
    for (SubmapId id = 0; id < map.size(); ++id) {
      submaps.push_back(map.map_T_submap(id));
      headers.push_back(map.header(id));
      checksums.push_back(first.slam().store().grid_crc32(id).value());
    }
    for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
      edges.push_back(map.graph().edge(id));
    }
  }
  REQUIRE(submaps.size() > 2);
  host::MappingRun second(config, flash.flash(), {});
  const MapCollection& map = second.slam().collection();
  REQUIRE(map.size() == submaps.size());
  for (SubmapId id = 0; id < map.size(); ++id) {
    CHECK(same_bits(map.map_T_submap(id), submaps[id]));
    CHECK(map.header(id).session == headers[id].session);
    CHECK(same_bits(map.header(id).session_T_submap, headers[id].session_T_submap));
    CHECK(map.header(id).first_scan == headers[id].first_scan);
    CHECK(map.header(id).scan_count == headers[id].scan_count);
    CHECK(second.slam().store().grid_crc32(id).value() == checksums[id]);
    CHECK(map.session_of(id) == 0);
  }
  // As a set: edges may have changed their order.
  REQUIRE(map.graph().edge_count() == edges.size());
  std::size_t found = 0;
  for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
    const Edge& have = map.graph().edge(id);
    for (const Edge& want : edges) {
      if (have.a == want.a && have.b == want.b && have.kind == want.kind && have.enabled == want.enabled &&
          same_bits(have.a_T_b, want.a_T_b) && same_bits(have.information.xy, want.information.xy) &&
          same_bits(have.information.tt, want.information.tt)) {
        ++found;
        break;
      }
    }
  }
  CHECK(found == edges.size());
  // The second run is a session of its own, with an id of its own, and its submaps come after the old ones.
  CHECK(map.session_count() == 2);
  CHECK_FALSE(map.session(0) == map.session(1));
  second.map(simulated_log({}, 0, kSanitized ? 150 : 400).log, {0}, {});
  CHECK(map.size() > submaps.size());
  CHECK(map.session_of(map.size() - 1) == 1);
  CHECK(second.slam().store().submap_count() == map.size());
  if (!kSanitized) {
    // The same floor: the sessions are found to be one building.
    CHECK(map.statistics().pairs_screened > 0);
    CHECK(map.component(map.size() - 1) == 0);
    CHECK(map.graph().component_count() == 1);
    CHECK(count_edges(map.graph(), EdgeKind::merge) >= 1);
  }
}
