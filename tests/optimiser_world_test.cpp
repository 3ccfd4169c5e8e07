// The optimiser on worlds with a truth: a simulated grid world with false loops, and the public graphs.
#include <doctest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "graph_rig.hpp"
#include "host/g2o.hpp"
#include "host/optimise_graph.hpp"

using namespace mellin;
using mellin::test::GraphRig;

namespace {

/// A robot that drives from crossing to crossing of a grid of streets, recognises crossings it has seen before, and is
/// sometimes wrong about that.
struct GridWorld {
  std::vector<Pose2> truth;
  std::set<EdgeId> false_loops;
  std::uint32_t true_loops = 0;

  GridWorld(PoseGraph& graph, std::uint32_t nodes, double false_share, std::uint64_t seed) {
    Random random(seed, 5);
    drive(graph, nodes, random);
    close_loops(graph, random);
    const double wanted = true_loops * false_share / (1.0 - false_share);
    while (static_cast<double>(false_loops.size()) < wanted) {
      add_false_loop(graph, random);
    }
  }

 private:
  static constexpr double kMetres = 0.05;
  static constexpr double kRadians = 0.02;
  static constexpr Sym3 kInformation = {1 / (kMetres * kMetres), 0, 0,
                                        1 / (kMetres * kMetres), 0, 1 / (kRadians * kRadians)};

  void drive(PoseGraph& graph, std::uint32_t nodes, Random& random) {
    truth.assign(1, Pose2{});
    REQUIRE(graph.add_node({}).ok());
    while (truth.size() < nodes) {
      const double u = random.uniform();
      const Pose2 step = {1.0, 0.0, u < 0.6 ? 0.0 : u < 0.8 ? kHalfPi : -kHalfPi};
      const Pose2 next = compose(truth.back(), step);
      const Pose2 ahead = compose(next, {1.0, 0.0, 0.0});
      if (std::abs(ahead.x) > 8.5 || std::abs(ahead.y) > 8.5) {
        turn(graph, random);
        continue;
      }
      append(graph, next, random);
    }
  }
  void turn(PoseGraph& graph, Random& random) {
    append(graph, compose(truth.back(), {0.0, 0.0, random.uniform() < 0.5 ? kHalfPi : -kHalfPi}), random);
  }
  void append(PoseGraph& graph, const Pose2& next, Random& random) {
    const NodeId last = static_cast<NodeId>(truth.size() - 1);
    const Pose2 measured = compose(between(truth[last], next), test::noise(random, kMetres, kRadians));
    truth.push_back(next);
    REQUIRE(graph.add_node(compose(graph.pose(last), measured)).ok());
    REQUIRE(graph.add_edge(last, last + 1, EdgeKind::odometry, measured, kInformation).ok());
  }
  void close_loops(PoseGraph& graph, Random& random) {
    for (NodeId b = 0; b < truth.size(); ++b) {
      for (NodeId a = 0; a + 15 < b; ++a) {
        if (translation(between(truth[a], truth[b])) < 0.5) {
          const Pose2 measured = compose(between(truth[a], truth[b]), test::noise(random, kMetres, kRadians));
          REQUIRE(graph.add_edge(a, b, EdgeKind::loop, measured, kInformation).ok());
          ++true_loops;
          break;
        }
      }
    }
  }
  void add_false_loop(PoseGraph& graph, Random& random) {
    const NodeId a = static_cast<NodeId>(random.uniform() * static_cast<double>(truth.size()));
    const NodeId b = static_cast<NodeId>(random.uniform() * static_cast<double>(truth.size()));
    if (a == b || translation(between(truth[a], truth[b])) < 1.5) {
      return;
    }
    const Pose2 wrong = {0.3 * random.normal(), 0.3 * random.normal(), kHalfPi * std::floor(4.0 * random.uniform())};
    false_loops.insert(graph.add_edge(a, b, EdgeKind::loop, wrong, kInformation).value());
  }
};

double rms_error(const PoseGraph& graph, const std::vector<Pose2>& truth) {
  double sum = 0.0;
  for (NodeId i = 0; i < graph.node_count(); ++i) {
    const double dx = graph.pose(i).x - truth[i].x;
    const double dy = graph.pose(i).y - truth[i].y;
    sum += dx * dx + dy * dy;
  }
  return std::sqrt(sum / graph.node_count());
}

PoseGraphConfig world_config() {
  PoseGraphConfig config;
  config.max_nodes = 400;
  config.max_edges = 1200;
  config.max_fill = 12000;
  return config;
}

std::string data_file(const std::string& name) {
  const char* const from_environment = std::getenv("MELLIN_DATA");
  const std::filesystem::path source = std::filesystem::path(__FILE__).parent_path().parent_path();
  const std::filesystem::path folder = from_environment == nullptr ? source / "../shared/data" : from_environment;
  if (std::filesystem::exists(folder / name)) {
    return (folder / name).string();
  }
  std::printf("skipped: no data (%s)\n", name.c_str());
  return {};
}

struct KnownOptimum {
  const char* file;
  double chi2_initial;
  double chi2;
};

}  // namespace

TEST_CASE("the robust kernel finds the false loops, a fifth or half of all, and the map of the true ones") {
  for (std::uint64_t run = 0; run < 16; ++run) {
    const std::uint64_t seed = run / 2;
    const double false_share = run % 2 == 0 ? 0.2 : 0.5;
    GraphRig clean(world_config());
    const GridWorld clean_world(clean.graph, 300, 0.0, seed);
    const OptimiserReport clean_report = clean.optimise({});
    REQUIRE(clean_report.converged);
    // The noise has the covariance that the edges claim: chi2 is near its degrees of freedom, three a loop.
    CHECK(clean_report.chi2_final == doctest::Approx(3.0 * clean_world.true_loops).epsilon(0.25));
    const double best = rms_error(clean.graph, clean_world.truth);

    GraphRig rig(world_config());
    const GridWorld world(rig.graph, 300, false_share, seed);
    REQUIRE(world.true_loops > 60);
    REQUIRE(static_cast<double>(world.false_loops.size()) >= false_share / (1.0 - false_share) * world.true_loops);
    OptimiserOptions options;
    options.robust = true;
    const OptimiserReport report = rig.optimise(options);
    CHECK(report.converged);
    std::uint32_t kept = 0;
    for (const EdgeId id : world.false_loops) {
      kept += rig.graph.edge(id).weight > 0.0 ? 1U : 0U;
    }
    CHECK(kept == 0);
    // A true loop is beyond the gate once in a hundred times.
    CHECK(report.rejected - world.false_loops.size() <= 2 + world.true_loops / 30);
    CHECK(rms_error(rig.graph, world.truth) < best + 0.05);

    GraphRig trusting(world_config());
    const GridWorld same(trusting.graph, 300, false_share, seed);
    (void)trusting.optimise({});
    CHECK(rms_error(trusting.graph, same.truth) > 4.0 * best);
    std::printf("seed %d: loops %u true, %zu false; rms %.3f m clean, %.3f robust, %.3f trusting; %u iterations\n",
                static_cast<int>(seed), world.true_loops, world.false_loops.size(), best,
                rms_error(rig.graph, world.truth), rms_error(trusting.graph, same.truth), report.iterations);
  }
}

TEST_CASE("the public graphs reach their known optima from both starts, and without room for the factor") {
  for (const KnownOptimum& known :
       {KnownOptimum{"INTEL.g2o.gz", 5.150e6, 215.8302}, KnownOptimum{"M3500.g2o.gz", 2.567e6, 137.9130}}) {
    const std::string path = data_file(known.file);
    if (path.empty()) {
      continue;
    }
    const host::G2oGraph given = host::read_g2o(path);
    for (const Start start : {Start::chordal, Start::current}) {
      host::G2oGraph graph = given;
      OptimiserOptions options;
      options.start = start;
      const host::GraphRun run = host::optimise_graph(graph, options);
      CHECK(run.report.converged);
      CHECK(run.report.fill_status == Status::ok);
      CHECK(run.report.chi2_initial == doctest::Approx(known.chi2_initial).epsilon(1e-3));
      CHECK(run.report.chi2_final == doctest::Approx(known.chi2).epsilon(1e-6));
      std::printf("%s: %u iterations, %.1f ms, %zu bytes\n", known.file, run.report.iterations, 1e3 * run.seconds,
                  run.arena_bytes);
    }
  }
  const std::string path = data_file("INTEL.g2o.gz");
  if (!path.empty()) {
    host::G2oGraph graph = host::read_g2o(path);
    OptimiserOptions options;
    options.start = Start::chordal;
    const host::GraphRun run = host::optimise_graph(graph, options, 1);
    CHECK(run.report.fill_status == Status::full);
    CHECK(run.report.chi2_final == doctest::Approx(215.8302).epsilon(1e-6));
  }
}
