// What one edge adds to the normal equations H dx = -g, for each of the optimiser's three linear problems. Unknowns of
// a node: (x, y, theta) in the frame of the component, increments added. The blocks are 3 x 3 throughout; where a
// problem has two unknowns a node, the third is decoupled and stays zero.
#pragma once

#include "mellin/graph/block_cholesky.hpp"
#include "mellin/graph/pose_graph.hpp"

namespace mellin::graph_detail {

struct EdgeTerms {
  Lower3 aa;  ///< block (a, a) of H
  Lower3 bb;
  Block3 ab;           ///< rows of a, columns of b
  double g_a[3] = {};  ///< gradient
  double g_b[3] = {};  ///< gradient
};

/// Gauss-Newton on poses (Grisetti et al. 2010).
EdgeTerms pose_terms(const Edge& edge, double weight, const Pose2& w_T_a, const Pose2& w_T_b);

/// A heading as an unconstrained vector.
struct Direction {
  double c = 0.0;
  double s = 0.0;
};

/// Rotations relaxed to vectors: |r_b - R_z r_a|^2 (Carlone et al. 2015).
EdgeTerms rotation_terms(const Edge& edge, double weight, const Direction& r_a, const Direction& r_b);

/// Translations, with the headings held.
EdgeTerms translation_terms(const Edge& edge, double weight, const Pose2& w_T_a, const Pose2& w_T_b);

}  // namespace mellin::graph_detail
