// The live map of one particle: counts, and beside them the likelihood field that scan matching reads (how near a point
// is to something solid), kept up to date cell by cell as scans come and go.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/grid/counting_grid.hpp"
#include "mellin/mapping/scan_memory.hpp"

namespace mellin {

/// The field is 255 in a cell that is surely solid and falls off with a Gaussian of 1.5 cells round it, over 2 cells:
/// the maximum over the 5 x 5 neighbourhood, so that it is a function of the counts alone, whatever their history.
class LiveGrid {
 public:
  /// Of one grid, or of several in a row.
  struct Memory {
    CountingGrid::Memory counts;
    Span<std::uint8_t> field;
    Span<std::uint8_t> marks;  ///< a bit a cell, for all grids: what a scan has counted already; empty: beams count
  };
  /// `once_a_scan`: a scan counts a cell once, however many of its beams meet there, which halves the counts' bytes.
  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t side, std::size_t grids, bool once_a_scan = false) {
    const std::size_t cells = std::size_t{side} * side;
    Memory m;
    m.counts = CountingGrid::carve(arena, side, grids, once_a_scan);
    m.field = arena.template take<std::uint8_t>(grids * cells, Part::grid);
    m.marks = arena.template take<std::uint8_t>(once_a_scan ? (cells + 7) / 8 : 0, Part::grid, Region::fast);
    return m;
  }

  LiveGrid() = default;
  /// The grid number `index` of those that `memory` was carved for.
  LiveGrid(const Memory& memory, std::size_t index, std::uint16_t side, float cell_m);

  const CountingGrid& grid() const { return grid_; }
  float cell_m() const { return cell_m_; }

  /// Forgets everything; the window is centred on the given point.
  void reset(const Pose2& centre);
  /// Moves the window so that it is centred on the given point.
  void roll_to(const Pose2& centre);
  /// How far the point is from the window's centre, in cells along the farther axis.
  std::int32_t off_centre(const Pose2& point) const;

  /// Counts a scan at a pose within `rect` (which lies in the window), or takes it back.
  void add(const ScanMemory& scans, std::uint32_t number, const Pose2& pose, const CellRect& rect);
  void remove(const ScanMemory& scans, std::uint32_t number, const Pose2& pose, const CellRect& rect);

  /// The field in a cell of the world grid; 0 outside the window.
  std::uint8_t field(std::int32_t column, std::int32_t row) const {
    return grid_.window().contains(column, row) ? field_[grid_.index(column, row)] : std::uint8_t{0};
  }

  /// The whole field as it lies in memory: cell by cell at grid().index().
  const std::uint8_t* field_data() const { return field_.data(); }

  /// Makes this grid equal to another one of the same size.
  void copy_from(const LiveGrid& other);

 private:
  template <int kSign>
  void count(const ScanMemory& scans, std::uint32_t number, const Pose2& pose, const CellRect& rect);
  template <int kSign>
  void count_once(const ScanMemory& scans, std::uint32_t number, const Pose2& pose, const CellRect& rect);
  template <int kSign>
  void count_cell(std::int32_t column, std::int32_t row, bool hit);
  bool mark(std::int32_t column, std::int32_t row);
  void solidity_changed(std::int32_t column, std::int32_t row, std::uint8_t before, std::uint8_t after);
  std::uint8_t recomputed(std::int32_t column, std::int32_t row) const;
  std::uint8_t recomputed_unbroken(std::size_t index) const;
  void spread(std::int32_t column, std::int32_t row, const CellRect& rect);
  void recompute(const CellRect& rect);

  CountingGrid grid_;
  Span<std::uint8_t> field_;
  Span<std::uint8_t> marks_;
  float cell_m_ = 0.0F;
};

/// How solid a cell is, in 16 steps: the share of hits among its observations, saturated at a half, since beams that
/// graze a wall pass through its cells as often as they end there; and less for a cell that was hit once or twice,
/// which may be the stray end of a beam behind the wall that no later beam reaches to take back.
inline std::uint8_t solidity(const CellCount& cell) {
  if (cell.hits == 0) {
    return 0;
  }
  const std::uint32_t trust = cell.hits < 3U ? 5U + 4U * cell.hits : 15U;
  const std::uint32_t steps = 2U * trust * cell.hits / cell.observations;
  return static_cast<std::uint8_t>(steps < trust ? steps : trust);
}

/// The field at a distance of (dx, dy) cells, each -2 to 2, from a cell of the given solidity.
std::uint8_t field_value(std::uint8_t solidity, int dx, int dy);

}  // namespace mellin
