// A pose graph and its optimiser on heap memory of exactly the measured size, and small worlds to fill them with.
#pragma once

#include <cstdint>
#include <vector>

#include "mellin/core/random.hpp"
#include "mellin/graph/optimiser.hpp"
#include "mellin/graph/pose_graph.hpp"

namespace mellin::test {

struct GraphRig {
  PoseGraphConfig config;
  std::vector<std::uint64_t> words;
  PoseGraph graph;
  Optimiser optimiser;
  Status status = Status::ok;
  std::size_t used = 0;
  bool fitted = false;

  static std::size_t required(const PoseGraphConfig& config) {
    MeasureArena measure;
    (void)PoseGraph::carve(measure, config);
    (void)Optimiser::carve(measure, config);
    return measure.use().total();
  }

  explicit GraphRig(const PoseGraphConfig& wanted, std::size_t missing = 0)
      : config(wanted), words(required(wanted) / 8 - missing / 8) {
    Arena arena({reinterpret_cast<std::byte*>(words.data()), words.size() * 8});
    status = graph.init(config, PoseGraph::carve(arena, config));
    if (status == Status::ok) {
      status = optimiser.init(config, Optimiser::carve(arena, config));
    }
    used = arena.use().total();
    fitted = arena.ok();
  }

  OptimiserReport optimise(const OptimiserOptions& options) {
    if (optimiser.begin(graph, options) != Status::ok) {
      return {};
    }
    while (optimiser.step()) {
    }
    return optimiser.report();
  }
};

inline Pose2 noise(Random& random, double metres, double radians) {
  return {metres * random.normal(), metres * random.normal(), radians * random.normal()};
}

/// A chain of `nodes` poses driving a bent path, with `loops` further edges between random nodes; noisy throughout.
inline void fill_random(PoseGraph& graph, std::uint32_t nodes, std::uint32_t loops, std::uint64_t seed) {
  Random random(seed, 1);
  std::vector<Pose2> truth(1);
  (void)graph.add_node(truth[0]).ok();
  const auto index = [&](std::uint32_t n) { return static_cast<NodeId>(random.uniform() * n); };
  const auto information = [&] {
    Sym3 m = diagonal(100.0 + 300.0 * random.uniform(), 200.0, 900.0);
    m.xy = 50.0 * random.uniform();
    m.xt = -60.0 * random.uniform();
    m.yt = 40.0 * random.uniform();
    return m;
  };
  for (NodeId i = 1; i < nodes; ++i) {
    const Pose2 step = {1.0, 0.1, 0.5 * random.normal()};
    truth.push_back(compose(truth[i - 1], step));
    const Pose2 measured = compose(step, noise(random, 0.05, 0.03));
    (void)graph.add_node(compose(graph.pose(i - 1), measured)).ok();
    (void)graph.add_edge(i - 1, i, EdgeKind::odometry, measured, information()).ok();
  }
  for (std::uint32_t k = 0; k < loops; ++k) {
    const NodeId a = index(nodes);
    const NodeId b = (a + 1 + index(nodes - 1)) % nodes;
    const Pose2 measured = compose(between(truth[a], truth[b]), noise(random, 0.05, 0.03));
    (void)graph.add_edge(a, b, EdgeKind::loop, measured, information()).ok();
  }
}

}  // namespace mellin::test
