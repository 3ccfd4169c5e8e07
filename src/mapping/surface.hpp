// Surfaces as a scan shows them: which of the neighbouring ends of beams lie on one, and its normal.
#pragma once

#include <cstddef>

#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"

namespace mellin::surface {

inline constexpr float kNormalBase_m = 0.25F;  ///< to the neighbours on both sides that a normal is taken from
inline constexpr float kGap_m = 0.6F;          ///< between neighbouring ends that may lie on one surface
inline constexpr int kNormalReach = 8;         ///< beams
inline constexpr float kGrazingGap_m = 3.0F;   ///< between neighbouring ends on a surface that beams graze …
inline constexpr float kGrazingOff_m = 0.08F;  ///< … of three of which the middle one lies so near the line at most
inline constexpr float kStraight = 0.15F;      ///< share of the chord by which its middle may be off, or it is a corner

inline float squared_distance(const Point2f& a, const Point2f& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

/// The first end in that direction (1 or -1) along the surface that is far enough for a normal; the one itself where
/// the surface ends before. `ends` in the order of the beams, in units of `unit_m`.
inline std::size_t neighbour(Span<const Point2f> ends, std::size_t end, int direction, float unit_m) {
  const float base = kNormalBase_m / unit_m;
  const float gap = kGap_m / unit_m;
  std::size_t at = end;
  for (int i = 0; i < kNormalReach; ++i) {
    const bool last = direction < 0 ? at == 0 : at + 1 >= ends.size();
    const std::size_t next = direction < 0 ? at - 1 : at + 1;
    if (last || squared_distance(ends[at], ends[next]) > gap * gap) {
      return end;
    }
    at = next;
    if (squared_distance(ends[end], ends[at]) >= base * base) {
      return at;
    }
  }
  return end;
}

/// The unit vector across the chord from a to b.
inline Point2f across(const Point2f& a, const Point2f& b) {
  const float inverse = 1.0F / sqrt(squared_distance(a, b));
  return {(b.y - a.y) * inverse, (a.x - b.x) * inverse};
}

inline float off_chord(const Point2f& normal, const Point2f& a, const Point2f& q) {
  return normal.x * (q.x - a.x) + normal.y * (q.y - a.y);
}

/// The normal at an end whose neighbours are far because beams graze the surface: the three lie on one line. Without it
/// such an end would pull along the wall, towards where the beams of the scans before ended.
inline Point2f grazed_normal(Span<const Point2f> ends, std::size_t end, float unit_m) {
  const float gap = kGrazingGap_m / unit_m;
  if (end == 0 || end + 1 >= ends.size() || squared_distance(ends[end - 1], ends[end]) > gap * gap ||
      squared_distance(ends[end + 1], ends[end]) > gap * gap) {
    return {};
  }
  const Point2f n = across(ends[end - 1], ends[end + 1]);
  const float off = off_chord(n, ends[end - 1], ends[end]) * unit_m;
  return off > kGrazingOff_m || off < -kGrazingOff_m ? Point2f{} : n;
}

/// The unit normal of the surface through an end, away from the sensor where beams run counterclockwise; (0, 0) where
/// none is evident. From the neighbours on both sides, or on the one where the surface goes on.
inline Point2f normal(Span<const Point2f> ends, std::size_t end, float unit_m) {
  const std::size_t before = neighbour(ends, end, -1, unit_m);
  const std::size_t behind = neighbour(ends, end, 1, unit_m);
  if (before == end && behind == end) {
    return grazed_normal(ends, end, unit_m);
  }
  const Point2f a = ends[before];
  const Point2f b = ends[behind];
  if (squared_distance(a, b) == 0.0F) {
    return {};
  }
  const Point2f n = across(a, b);
  const float length = sqrt(squared_distance(a, b));
  const float off = off_chord(n, a, ends[end]);
  return off > kStraight * length || off < -kStraight * length ? Point2f{} : n;  // a corner has none
}

}  // namespace mellin::surface
