// 2D pose graphs as files: g2o's VERTEX_SE2 / EDGE_SE2 and TORO's VERTEX2 / EDGE2, plain or gzipped.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mellin/core/se2.hpp"

namespace mellin::host {

struct G2oEdge {
  std::size_t a = 0;  ///< index of a vertex, not its id
  std::size_t b = 0;
  Pose2 a_T_b;
  Sym3 information;
};

struct G2oGraph {
  std::vector<std::int64_t> ids;  ///< of the vertices, ascending
  std::vector<Pose2> poses;       ///< of the vertices
  std::vector<G2oEdge> edges;     ///< in the file's order
};

/// Reads a file. A vertex that only edges name gets its pose along them, edges between consecutive ids first. FIX,
/// PARAMS lines, comments and empty lines are passed over. Throws std::runtime_error naming file, line, what was
/// expected and what was found.
G2oGraph read_g2o(const std::string& path);

/// Writes g2o's format with twelve significant digits; throws std::runtime_error where it cannot.
void write_g2o(const std::string& path, const G2oGraph& graph);

}  // namespace mellin::host
