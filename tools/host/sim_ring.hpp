// The ring corridor of the simulated floor: four straight stretches and four bends to the left.
#pragma once

#include "mellin/core/se2.hpp"

namespace mellin::host::ring {

inline constexpr double kLong_m = 16.0;   ///< straight stretches 0 and 2
inline constexpr double kShort_m = 10.0;  ///< straight stretches 1 and 3
inline constexpr double kBendRadius_m = 13.0;
inline constexpr double kHalfWidth_m = 1.2;
inline constexpr int kSides = 4;

inline constexpr double kBend_m = kBendRadius_m * kHalfPi;
inline constexpr double kLength_m = 2.0 * (kLong_m + kShort_m) + kSides * kBend_m;

inline constexpr double side_length(int side) { return side % 2 == 0 ? kLong_m : kShort_m; }

/// Where on the centre line a straight stretch begins, m.
double side_start(int side);

/// The centre line at `way` metres from the beginning of stretch 0 (any number: it goes round), x ahead, y to the
/// core.
Pose2 centre_line(double way);

}  // namespace mellin::host::ring
