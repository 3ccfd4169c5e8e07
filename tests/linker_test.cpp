// The law by which a recognised place becomes an edge, on graphs made by hand, with the real graph and optimiser.
#include "mellin/collection/linker.hpp"

#include <doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "mellin/collection/persistence.hpp"
#include "tests/graph_rig.hpp"

using namespace mellin;
using mellin::test::GraphRig;

namespace {

struct Verdict {
  NodeId a, b;
  LinkReason reason;
  EdgeId edge;
};

/// A chain of submaps along x, 5 m apart, with odometry of a given deviation; further components behind it.
struct Bench {
  GraphRig rig;
  std::vector<NodeScans> scans;
  std::vector<PendingLink> memory;
  std::vector<LoopHypothesis> group;
  Linker linker;
  std::vector<Verdict> verdicts;

  explicit Bench(const LinkerConfig& config = {}, const PoseGraphConfig& graph = {})
      : rig(graph), memory(config.pending), group(config.pending) {
    linker = Linker(config, {{memory.data(), memory.size()}, {group.data(), group.size()}});
  }
  /// A session of `count` submaps, each of 40 scans, `new_scans` of them new.
  void session(std::uint32_t count, double sigma_m, double sigma_rad, std::uint32_t new_scans = 40) {
    const auto number = static_cast<std::uint16_t>(scans.empty() ? 0 : scans.back().session + 1);
    for (std::uint32_t i = 0; i < count; ++i) {
      const NodeId id = rig.graph.add_node({5.0 * i, 0.0, 0.0}).value();
      scans.push_back({number, 0, i * new_scans, 40});
      if (i > 0) {
        const Sym3 information =
            diagonal(1 / (sigma_m * sigma_m), 1 / (sigma_m * sigma_m), 1 / (sigma_rad * sigma_rad));
        REQUIRE(rig.graph.add_edge(id - 1, id, EdgeKind::odometry, {5.0, 0.0, 0.0}, information).ok());
      }
    }
  }
  void hypothesis(NodeId a, NodeId b, const Pose2& a_T_b, float agreement = 0.8F) {
    PlaceHypothesis place;
    place.a_T_b = a_T_b;
    place.covariance = diagonal(1e-4, 1e-4, 1e-5);
    place.agreement = agreement;
    place.overlap = 0.5F;
    linker.add(a, b, place);
  }
  std::size_t decide() {
    OptimiserOptions options;
    options.max_iterations = 0;
    options.marginals = true;
    REQUIRE(rig.optimise(options).status == Status::ok);
    linker.begin(
        rig.graph, rig.optimiser, {scans.data(), scans.size()}, this,
        [](void* context, const PendingLink& link, EdgeId edge) {
          static_cast<Bench*>(context)->verdicts.push_back({link.hypothesis.a, link.hypothesis.b, link.reason, edge});
        });
    const std::size_t n = linker.pending();
    std::size_t steps = 1;
    while (linker.step()) {
      ++steps;
    }
    CHECK(steps <= 2 * n * n + n + 3);
    CHECK_FALSE(linker.deciding());
    return linker.added();
  }
};

}  // namespace

TEST_CASE("a single hypothesis suffices where the graph knows the place well, and not where it is vague") {
  Bench sure;
  sure.session(8, 0.01, 0.002);
  sure.hypothesis(0, 7, {35.02, 0.03, 0.004});
  CHECK(sure.decide() == 1);
  REQUIRE(sure.verdicts.size() == 2);  // it waited, and was confirmed
  CHECK(sure.verdicts[1].reason == LinkReason::confirmed_by_map);
  REQUIRE(sure.verdicts[1].edge != kNoId);
  const Edge& edge = sure.rig.graph.edge(sure.verdicts[1].edge);
  CHECK(edge.a == 0);
  CHECK(edge.b == 7);
  CHECK(edge.kind == EdgeKind::loop);
  CHECK(edge.a_T_b.x == 35.02);
  CHECK(sure.linker.pending() == 0);
  // A quarter of the information of the match and of how rigid submaps are: 1 / (4 (1e-4 + 0.04^2)).
  CHECK(edge.information.xx == doctest::Approx(0.25 / (1e-4 + 0.0016)).epsilon(1e-3));
  CHECK(edge.information.tt == doctest::Approx(0.25 / (1e-5 + 0.000064)).epsilon(1e-3));

  Bench vague;
  vague.session(8, 0.5, 0.1);
  vague.hypothesis(0, 7, {35.5, 1.0, 0.05});
  CHECK(vague.decide() == 0);
  REQUIRE(vague.verdicts.size() == 1);
  CHECK(vague.verdicts[0].reason == LinkReason::waiting);
  CHECK(vague.linker.pending() == 1);
  CHECK(vague.rig.graph.edge_count() == 7);

  // Well known, but the submaps agree badly: it waits, too.
  Bench poor;
  poor.session(8, 0.01, 0.002);
  poor.hypothesis(0, 7, {35.0, 0.0, 0.0}, 0.45F);
  CHECK(poor.decide() == 0);
  CHECK(poor.linker.pending() == 1);
}

TEST_CASE("two witnesses that share no scans confirm one another where the graph is vague") {
  Bench bench;
  bench.session(10, 0.5, 0.1);
  const Pose2 drift{0.8, -0.9, 0.04};  // what the graph does not know
  bench.hypothesis(0, 8, compose(Pose2{40.0, 0.0, 0.0}, drift));
  CHECK(bench.decide() == 0);
  // Place 1 as seen from 9 says the same.
  const Pose2 second = compose(compose(Pose2{-5.0, 0.0, 0.0}, compose(Pose2{40.0, 0.0, 0.0}, drift)), {5.0, 0.0, 0.0});
  bench.hypothesis(1, 9, second);
  CHECK(bench.decide() == 2);
  CHECK(bench.linker.pending() == 0);
  CHECK(bench.rig.graph.edge_count() == 11);
  CHECK(bench.verdicts.back().reason == LinkReason::confirmed_by_set);

  // The same two that do not agree with one another wait on.
  Bench apart;
  apart.session(10, 0.5, 0.1);
  apart.hypothesis(0, 8, {40.0, 0.0, 0.5});  // seven deviations of heading from …
  apart.hypothesis(1, 9, {40.0, 0.0, -0.5});
  CHECK(apart.decide() == 0);
  CHECK(apart.linker.pending() == 2);
}

TEST_CASE("two hypotheses that rest on the same scans are one witness, and wait") {
  Bench bench;
  bench.session(10, 0.5, 0.1, 10);  // neighbours share 30 of 40 scans
  bench.hypothesis(0, 8, {40.5, 0.5, 0.02});
  bench.hypothesis(1, 9, {40.5, 0.6, 0.02});
  CHECK(bench.decide() == 0);
  CHECK(bench.linker.pending() == 2);
  // So do two whose older submaps differ, but whose newer one is the same.
  Bench one_end;
  one_end.session(10, 0.5, 0.1);
  one_end.hypothesis(0, 9, {45.5, 0.5, 0.02});
  one_end.hypothesis(1, 9, {40.5, 0.6, 0.02});
  CHECK(one_end.decide() == 0);
  CHECK(one_end.linker.pending() == 2);
}

TEST_CASE("what contradicts the graph is refused, however often it is said") {
  Bench bench;
  bench.session(10, 0.02, 0.002);
  bench.hypothesis(0, 8, {43.0, 0.0, 0.0}, 0.95F);
  bench.hypothesis(1, 9, {43.0, 0.0, 0.0}, 0.95F);
  CHECK(bench.decide() == 0);
  REQUIRE(bench.verdicts.size() == 2);
  CHECK(bench.verdicts[0].reason == LinkReason::contradicts_map);
  CHECK(bench.verdicts[1].reason == LinkReason::contradicts_map);
  CHECK(bench.rig.graph.edge_count() == 9);
}

TEST_CASE("sessions are merged by three witnesses, not by two") {
  Bench bench;
  bench.session(6, 0.05, 0.005);
  bench.session(6, 0.05, 0.005);  // nodes 6 to 11
  const Pose2 moved{1.0, 2.0, 0.5};
  const auto b_in_a = [&](int a, int b) {
    return between(Pose2{5.0 * a, 0.0, 0.0}, compose(moved, {5.0 * b, 0.0, 0.0}));
  };
  bench.hypothesis(0, 6, b_in_a(0, 0));
  CHECK(bench.decide() == 0);
  bench.hypothesis(2, 8, b_in_a(2, 2));
  CHECK(bench.decide() == 0);
  CHECK(bench.rig.graph.component_count() == 2);
  bench.hypothesis(3, 10, compose(b_in_a(3, 4), {3.0, 0.0, 0.0}));  // a wrong one does not help
  CHECK(bench.decide() == 0);
  CHECK(bench.rig.graph.component_count() == 2);
  bench.hypothesis(4, 10, b_in_a(4, 4));
  CHECK(bench.decide() == 3);
  CHECK(bench.rig.graph.component_count() == 1);
  CHECK(bench.linker.pending() == 1);
  const Pose2 first = bench.rig.graph.pose(6);
  CHECK(translation(between(moved, first)) < 1e-6);
  CHECK(bench.rig.graph.edge(bench.verdicts.back().edge).kind != EdgeKind::odometry);
  std::size_t merges = 0;
  for (EdgeId id = 0; id < bench.rig.graph.edge_count(); ++id) {
    merges += bench.rig.graph.edge(id).kind == EdgeKind::merge ? 1U : 0U;
  }
  CHECK(merges == 3);
}

TEST_CASE("where edges have to tell something, what the graph knows already is dropped") {
  LinkerConfig config;
  config.min_gain_bits = 1.5F;
  // Deviations along x and y of the edge with its share of information: 2 sqrt(0.01^2 + 0.04^2) = 0.082 m.
  Bench sure(config);
  sure.session(4, 0.02, 0.002);  // two steps of 0.02 m: less than a tenth of a bit
  sure.hypothesis(0, 2, {10.0, 0.0, 0.0});
  CHECK(sure.decide() == 0);
  REQUIRE(sure.verdicts.size() == 1);
  CHECK(sure.verdicts[0].reason == LinkReason::redundant);
  CHECK(sure.linker.pending() == 0);
  Bench vague(config);
  vague.session(4, 0.2, 0.02);  // two of 0.2 m: log2(sqrt(1 + 0.28^2 / 0.082^2)) = 1.8 bits along x alone
  vague.hypothesis(0, 2, {10.0, 0.0, 0.0});
  CHECK(vague.decide() == 1);
  CHECK(vague.verdicts.back().reason == LinkReason::confirmed_by_map);
  Bench undemanding;  // by default nothing is dropped
  undemanding.session(4, 0.02, 0.002);
  undemanding.hypothesis(0, 2, {10.0, 0.0, 0.0});
  CHECK(undemanding.decide() == 1);
}

TEST_CASE("loop edges leave room for the odometry edges of the submaps to come") {
  PoseGraphConfig graph;
  graph.max_nodes = 6;
  graph.max_edges = 7;
  graph.max_fill = 20;
  Bench bench({}, graph);
  bench.session(5, 0.2, 0.02);  // four odometry edges, and one to come: two are left
  for (NodeId b = 2; b < 5; ++b) {
    bench.hypothesis(0, b, {5.0 * b, 0.0, 0.0});
  }
  CHECK(bench.decide() == 2);
  CHECK(bench.linker.pending() == 1);
  CHECK(bench.decide() == 0);
  CHECK(bench.linker.pending() == 1);
  const NodeId last = bench.rig.graph.add_node({25.0, 0.0, 0.0}).value();
  CHECK(bench.rig.graph.add_edge(4, last, EdgeKind::odometry, {5.0, 0.0, 0.0}, diagonal(1.0, 1.0, 1.0)).ok());
}

TEST_CASE("what is no evidence is not kept; where there is no room the worst is dropped") {
  LinkerConfig config;
  config.pending = 3;
  Bench bench(config);
  bench.session(8, 0.5, 0.1, 1);  // all share scans: none of them suffices
  PlaceHypothesis place;
  place.overlap = 0.5F;
  place.agreement = 0.39F;
  CHECK_FALSE(bench.linker.worth_keeping(place));
  place.agreement = 0.41F;
  CHECK(bench.linker.worth_keeping(place));
  place.overlap = 0.05F;
  CHECK_FALSE(bench.linker.worth_keeping(place));
  place.agreement = std::numeric_limits<float>::quiet_NaN();
  place.overlap = 0.5F;
  CHECK_FALSE(bench.linker.worth_keeping(place));
  bench.hypothesis(0, 5, {25.0, 0.0, 0.0}, 0.7F);
  bench.hypothesis(0, 6, {30.0, 0.0, 0.0}, 0.5F);
  bench.hypothesis(0, 7, {35.0, 0.0, 0.0}, 0.6F);
  bench.hypothesis(1, 7, {30.0, 0.0, 0.0}, 0.9F);
  CHECK(bench.linker.pending() == 3);
  CHECK(bench.decide() == 0);
  std::vector<NodeId> seen;
  for (const Verdict& v : bench.verdicts) {
    seen.push_back(v.b * 10 + v.a);
  }
  CHECK(seen == std::vector<NodeId>{50, 70, 71});
  bench.linker.clear();
  CHECK(bench.linker.pending() == 0);
}

TEST_CASE("scans are shared within a session where the ranges overlap, and never between sessions") {
  CHECK(share_scans({0, 0, 0, 40}, {0, 0, 39, 40}));
  CHECK(share_scans({0, 0, 39, 40}, {0, 0, 0, 40}));
  CHECK_FALSE(share_scans({0, 0, 0, 40}, {0, 0, 40, 40}));
  CHECK_FALSE(share_scans({0, 0, 0, 40}, {1, 0, 0, 40}));
  CHECK_FALSE(share_scans({0, 0, 5, 0}, {0, 0, 0, 40}));
  // Numbers near their limit, as a damaged record may have them.
  CHECK(share_scans({0, 0, 0xFFFFFFF0U, 0x40}, {0, 0, 0xFFFFFFF8U, 4}));
}

TEST_CASE("records of nodes and edges come back bit by bit, and garbage is refused") {
  std::uint8_t bytes[kEdgeRecordBytes];
  const Pose2 pose{1.0 / 3.0, -1e5, 3.0};
  REQUIRE(write_node_record({pose, 513}, {bytes, sizeof bytes}) == kNodeRecordBytes);
  // Little-endian IEEE 754 by definition: -1e5 is 0xC0F86A0000000000.
  const std::uint8_t expected[8] = {0, 0, 0, 0, 0, 0x6A, 0xF8, 0xC0};
  CHECK(std::memcmp(bytes + 8, expected, 8) == 0);
  CHECK(bytes[24] == 1);
  CHECK(bytes[25] == 2);
  NodeRecord back;
  REQUIRE(read_node_record({bytes, kNodeRecordBytes}, back));
  CHECK(back.map_T_submap.x == pose.x);
  CHECK(back.map_T_submap.y == pose.y);
  CHECK(back.map_T_submap.theta == pose.theta);
  CHECK(back.stretch == 513);
  REQUIRE(read_node_record({bytes, 24}, back));  // as it was written before there were stretches
  CHECK(back.map_T_submap.theta == pose.theta);
  CHECK(back.stretch == 0);
  CHECK_FALSE(read_node_record({bytes, kNodeRecordBytes - 1}, back));
  CHECK_FALSE(read_node_record({bytes, kNodeRecordBytes + 1}, back));
  CHECK_FALSE(read_node_record({}, back));
  for (const double bad : {static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    (void)write_node_record({{0.0, bad, 0.0}, 0}, {bytes, sizeof bytes});
    CHECK_FALSE(read_node_record({bytes, kNodeRecordBytes}, back));
  }

  Edge edge;
  edge.a = 0x01020304;
  edge.b = 77;
  edge.kind = EdgeKind::merge;
  edge.enabled = false;
  edge.a_T_b = {0.1, 0.2, -0.3};
  edge.information = {1.5, -0.25, 0.125, 2.5, 0.0625, 1e9};
  REQUIRE(write_edge_record(edge, {bytes, sizeof bytes}) == kEdgeRecordBytes);
  CHECK(bytes[0] == 4);
  CHECK(bytes[3] == 1);
  Edge copy;
  REQUIRE(read_edge_record({bytes, sizeof bytes}, copy));
  CHECK(copy.a == edge.a);
  CHECK(copy.b == edge.b);
  CHECK(copy.kind == edge.kind);
  CHECK(copy.enabled == edge.enabled);
  CHECK(copy.weight == 1.0);
  CHECK(copy.a_T_b.theta == -0.3);
  CHECK(copy.information.xy == -0.25);
  CHECK(copy.information.yt == 0.0625);
  CHECK(copy.information.tt == 1e9);
  CHECK_FALSE(read_edge_record({bytes, sizeof bytes - 1}, copy));
  bytes[8] = 3;  // no such kind
  CHECK_FALSE(read_edge_record({bytes, sizeof bytes}, copy));
  bytes[8] = 0;
  bytes[9] = 2;
  CHECK_FALSE(read_edge_record({bytes, sizeof bytes}, copy));
  bytes[9] = 1;
  CHECK(read_edge_record({bytes, sizeof bytes}, copy));
  std::memset(bytes + 12, 0xFF, 8);  // NaN
  CHECK_FALSE(read_edge_record({bytes, sizeof bytes}, copy));
  edge.information.tt = static_cast<double>(NAN);
  (void)write_edge_record(edge, {bytes, sizeof bytes});
  CHECK_FALSE(read_edge_record({bytes, sizeof bytes}, copy));
}
