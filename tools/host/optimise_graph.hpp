// Runs the library's optimiser on a graph of any size, in one arena from the heap.
#pragma once

#include <cstddef>

#include "host/g2o.hpp"
#include "mellin/graph/optimiser.hpp"

namespace mellin::host {

struct GraphRun {
  OptimiserReport report;
  double seconds = 0.0;         ///< of ordering and optimisation
  std::size_t arena_bytes = 0;  ///< graph and optimiser
};

/// Optimises `graph` in place. Edges between consecutive ids are odometry, all others loops. `max_fill`: blocks that
/// the factor may have, 0: as many as it needs. Throws std::runtime_error where the graph is refused.
GraphRun optimise_graph(G2oGraph& graph, const OptimiserOptions& options, std::size_t max_fill = 0);

}  // namespace mellin::host
