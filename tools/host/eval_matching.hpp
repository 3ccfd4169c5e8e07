// The library's matcher and its registration over many pairs of submaps, for the evaluation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/eval_curves.hpp"
#include "host/eval_submaps.hpp"
#include "mellin/collection/registration.hpp"
#include "mellin/spectral/matcher.hpp"

namespace mellin::host {

/// One way in which b may lie in a.
struct FoundPose {
  Pose2 a_T_b;
  double peak = 0.0;
  /// Of what both observed, 0 to 1; from registration times the share of inliers. Negative: not looked at.
  double agreement = -1.0;
  double confidence = -1.0;  ///< that the pose is right; from registration only
  PoseEvidence evidence{};   ///< that it rests on; from registration only
};

/// What the matcher is and what it is given.
struct MatchVariant {
  MatcherConfig matcher;     ///< its side is the submaps' over a power of two; pixel_m is set from it
  std::size_t verified = 4;  ///< hypotheses whose agreement is looked at, strongest peak first
};

/// The hypotheses of each pair, strongest peak first; none where a submap shows nothing. Agreement is looked at as
/// screening does it (on the digests' masks) up to 96 pixels, above as registration does (on the grids' classes).
/// Memory: the features of all submaps, 10 bytes x side^2 each. The result does not depend on `threads`.
std::vector<std::vector<FoundPose>> match_pairs(const std::vector<EvalSubmap>& submaps,
                                                const std::vector<EvalPair>& pairs, const MatchVariant& variant,
                                                std::size_t threads);

/// What the whole registration makes of each pair (SpectralRegistration: peaks, verified, aligned, verified again),
/// best first. The result does not depend on `threads`.
std::vector<std::vector<FoundPose>> register_pairs(const std::vector<EvalSubmap>& submaps,
                                                   const std::vector<EvalPair>& pairs,
                                                   const RegistrationConfig& registration, std::size_t threads);

/// By what a pair's score is taken from its hypotheses.
enum class PairScore {
  peak,        ///< the strongest peak, as the paper does
  agreement,   ///< the best agreement, as screening does
  confidence,  ///< the best confidence, as registration does
};

double score_of(const FoundPose& pose, PairScore score);

/// The hypothesis that decides; nullptr where there is none.
const FoundPose* deciding(const std::vector<FoundPose>& found, PairScore score);

/// How far a found pose of b is from the true one: at b's origin, and in heading.
struct PoseError {
  double metres = 0.0;
  double degrees = 0.0;
};
PoseError pose_error(const EvalPair& pair, const FoundPose& found);

/// A decision a pair, in their order, about its deciding hypothesis. A pair without hypotheses scores -1 and is as
/// wrong as can be.
std::vector<PoseDecision> pose_decisions(const std::vector<EvalPair>& pairs,
                                         const std::vector<std::vector<FoundPose>>& found, PairScore score);

/// How a wrong pose came about, by what it looks like.
enum class Confusion {
  near,       ///< no confusion: within a metre and 8 degrees; mostly submaps that are bent in themselves
  elsewhere,  ///< the pair does not overlap at all: another place that looks alike
  half_turn,  ///< turned by 180 degrees
  quarter_turn,
  slid,     ///< right heading, moved along the longer axis of what a observed: a corridor
  shifted,  ///< right heading, moved otherwise
  other,
};
const char* to_string(Confusion confusion);
Confusion confusion_of(const EvalPair& pair, const EvalSubmap& a, const FoundPose& found);

/// At most `count` pairs, a third of them positive, a third negative, a third in between, drawn without replacement and
/// weighted so that every figure stays unbiased. In the order of `pairs`. 0 means all.
std::vector<EvalPair> sample_pairs(const std::vector<EvalPair>& pairs, std::size_t count, std::uint64_t seed);

}  // namespace mellin::host
