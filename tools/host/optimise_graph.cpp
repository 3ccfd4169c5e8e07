#include "host/optimise_graph.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/heap_arena.hpp"

namespace mellin::host {
namespace {

void require(Status status, const std::string& what) {
  if (status != Status::ok) {
    throw std::runtime_error(what + ": " + to_string(status));
  }
}

/// Blocks of the factor, found by ordering the graph with room for more and more.
std::size_t needed_fill(const G2oGraph& graph) {
  std::vector<BlockPair> pairs;
  for (const G2oEdge& e : graph.edges) {
    pairs.push_back({static_cast<std::uint32_t>(e.a), static_cast<std::uint32_t>(e.b)});
  }
  for (std::size_t fill = 8 * (graph.ids.size() + pairs.size());; fill *= 2) {
    const BlockCholeskyLimits limits{static_cast<std::uint32_t>(graph.ids.size()),
                                     static_cast<std::uint32_t>(pairs.size()), static_cast<std::uint32_t>(fill)};
    HeapArena memory;
    BlockOrdering ordering;
    require(ordering.init(limits, memory.carve([&](auto& arena) { return BlockOrdering::carve(arena, limits); })),
            "ordering");
    require(ordering.begin(limits.variables, {pairs.data(), pairs.size()}), "ordering");
    const Status status = ordering.analyse(std::numeric_limits<std::uint32_t>::max());
    if (status == Status::ok) {
      return ordering.fill();
    }
    if (status != Status::full || fill > std::numeric_limits<std::uint32_t>::max() / 32) {
      throw std::runtime_error("the graph is too large to be ordered");
    }
  }
}

void add(const G2oGraph& from, PoseGraph& to) {
  for (const Pose2& pose : from.poses) {
    require(to.add_node(pose).status(), "vertex out of range");
  }
  for (const G2oEdge& e : from.edges) {
    const bool odometry = std::abs(from.ids[e.a] - from.ids[e.b]) == 1;
    const Result<EdgeId> added = to.add_edge(static_cast<NodeId>(e.a), static_cast<NodeId>(e.b),
                                             odometry ? EdgeKind::odometry : EdgeKind::loop, e.a_T_b, e.information);
    require(added.status(), "edge " + std::to_string(from.ids[e.a]) + " " + std::to_string(from.ids[e.b]) +
                                ": expected a positive semidefinite information matrix and a transform in range");
  }
  // Linking components moved them; the file's own poses are the start.
  for (std::size_t i = 0; i < from.poses.size(); ++i) {
    require(to.set_pose(static_cast<NodeId>(i), from.poses[i]), "vertex");
  }
}

}  // namespace

GraphRun optimise_graph(G2oGraph& graph, const OptimiserOptions& options, std::size_t max_fill) {
  GraphRun run;
  PoseGraphConfig config;
  config.max_nodes = static_cast<std::uint32_t>(graph.ids.size());
  config.max_edges = static_cast<std::uint32_t>(graph.edges.size());
  // The gauge leaves the system, which another order may pay for with a few blocks more: hence the margin.
  const std::size_t fill = max_fill != 0 ? max_fill : needed_fill(graph) * 9 / 8;
  config.max_fill = static_cast<std::uint32_t>(std::max(fill, graph.ids.size()));
  require(validate(config), "the graph is too large");

  HeapArena poses_memory;
  HeapArena optimiser_memory;
  PoseGraph poses;
  Optimiser optimiser;
  require(poses.init(config, poses_memory.carve([&](auto& arena) { return PoseGraph::carve(arena, config); })),
          "graph");
  require(optimiser.init(config, optimiser_memory.carve([&](auto& arena) { return Optimiser::carve(arena, config); })),
          "optimiser");
  run.arena_bytes = poses_memory.bytes() + optimiser_memory.bytes();
  add(graph, poses);

  const auto start = std::chrono::steady_clock::now();
  require(optimiser.begin(poses, options), "optimiser");
  while (optimiser.step()) {
  }
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.report = optimiser.report();
  for (std::size_t i = 0; i < graph.poses.size(); ++i) {
    graph.poses[i] = poses.pose(static_cast<NodeId>(i));
  }
  return run;
}

}  // namespace mellin::host
