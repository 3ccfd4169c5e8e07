// The occupancy grid of a submap as bytes, and the node that carries it: what flows from the mapper to the store, the
// matcher and the map collection.
//
// Index order, here and everywhere: cell (column, row) lies at cells[row * side + column]; columns run along x, rows
// along y, row 0 has the smallest y. The submap's frame has its origin at the centre of the square grid (the corner
// between the four middle cells; sides are even): cell (c, r) covers x from (c - side/2) * cell_m on, y likewise.
#pragma once

#include <cstdint>

#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"

namespace mellin {

/// A cell of a submap: 255 where nothing was observed, else round(254 * hits / observations).
inline constexpr std::uint8_t kUnobserved = 255;
inline constexpr std::uint8_t kCertainlyOccupied = 254;

/// A square grid of submap cells that somebody else owns.
struct GridView {
  Span<const std::uint8_t> cells;  ///< side * side
  std::uint16_t side = 0;          ///< cells; even
  float cell_m = 0.0F;             ///< edge of a cell

  std::uint8_t at(std::uint16_t column, std::uint16_t row) const {
    return cells[static_cast<std::size_t>(row) * side + column];
  }
};

using SubmapId = std::uint32_t;
inline constexpr SubmapId kNoSubmap = 0xFFFFFFFFU;

/// Identifies a mapping session: a random UUID (RFC 4122, version 4).
struct SessionId {
  std::uint8_t bytes[16] = {};
};

inline bool operator==(const SessionId& a, const SessionId& b) {
  for (int i = 0; i < 16; ++i) {
    if (a.bytes[i] != b.bytes[i]) {
      return false;
    }
  }
  return true;
}

/// What a submap node stores beside its grid (paper, Section III-B).
struct SubmapHeader {
  SubmapId id = kNoSubmap;
  SessionId session;
  Pose2 session_T_submap;        ///< initial estimate, in the frame of its session
  Pose2 submap_T_robot;          ///< where the robot was when the submap was frozen
  std::int64_t stamp_us = 0;     ///< of the newest scan in it
  std::uint32_t first_scan = 0;  ///< numbers, in the session, of the taken scans that it renders: first …
  std::uint32_t scan_count = 0;  ///< … and how many in a row
};

/// How a submap lies to the one that was frozen before it in its session.
struct SubmapStep {
  std::uint32_t before_first_scan = 0;  ///< first scan of the one before, to tell it from a submap that was lost
  std::uint32_t shared_scans = 0;       ///< that both render, and by which the step was measured; 0: it was not
  Pose2 before_T_submap;
  /// What the local mapper may have drifted in between, as a covariance of this submap's pose in its own frame.
  Sym3 drift;
};

}  // namespace mellin
