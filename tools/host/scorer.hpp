// Scores a trajectory against ground truth: absolute trajectory error after rigid alignment (Sturm et al. 2012) and
// errors of relations between poses (Kuemmerle et al. 2009).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "host/pairing.hpp"
#include "host/tum.hpp"

namespace mellin::host {

/// Error of relative poses e = (G_i^-1 G_j)^-1 (E_i^-1 E_j): translation |e_xy| in m, rotation |e_theta| in degrees.
struct RelativeError {
  std::size_t count = 0;
  double mean_m = 0.0;
  double deviation_m = 0.0;
  double median_m = 0.0;
  double max_m = 0.0;
  double mean_deg = 0.0;
  double deviation_deg = 0.0;
};

struct TrajectoryScore {
  std::size_t paired = 0;     ///< poses of the truth that have a pose of the estimate
  double paired_share = 0.0;  ///< of the truth's poses
  /// Below: only from three pairs on.
  bool scored = false;
  double ate_rmse_m = 0.0;
  double ate_max_m = 0.0;
  double ate_rotation_rmse_deg = 0.0;
  RelativeError step;     ///< consecutive paired poses
  RelativeError revisit;  ///< closer than 3 m in the truth, more than 60 poses apart; of at most some 1500 poses
};

/// Scores the estimate, in any frame and any order of time. Cost: up to 2250 thousand pairs for the revisits.
TrajectoryScore score_trajectory(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth);

/// The pose at the second stamp seen from the pose at the first.
struct Relation {
  double from_s = 0.0;
  double to_s = 0.0;
  Pose2 from_T_to;
};

/// Reads `t1 t2 x y z roll pitch yaw` lines; throws std::runtime_error naming file and line where one is not eight
/// finite numbers.
std::vector<Relation> read_relations(const std::string& path);

/// The estimate's error in the relations, interpolated between its neighbouring poses; a relation is left out where
/// one of its stamps is farther than gap_s from both neighbours. count == 0 where none is left.
RelativeError score_relations(const std::vector<StampedPose>& estimate, const std::vector<Relation>& relations,
                              double gap_s = 1.0);

/// One line of JSON, with the names that the reference scripts use; the relations, if any, as the member "relations".
std::string to_json(const TrajectoryScore& score, const std::optional<RelativeError>& relations,
                    std::size_t relations_total);

/// The same for people, a line each.
std::string to_text(const TrajectoryScore& score, const std::optional<RelativeError>& relations,
                    std::size_t relations_total);

}  // namespace mellin::host
