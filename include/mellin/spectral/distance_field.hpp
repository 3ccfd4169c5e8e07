// The distance field of a submap: for each cell the distance to the nearest obstacle, a byte, truncated. It is what
// alignment slides points on (a likelihood field, Thrun, Burgard, Fox, "Probabilistic Robotics", 6.4, with the distance
// kept instead of its exponential).
//
// Two sweeps (after Felzenszwalb, Huttenlocher, "Distance Transforms of Sampled Functions", 2012): columns first, for
// the nearest obstacle cell above and below; then rows, for the lower envelope of the parabolas that these raise. That
// names the nearest obstacle cell exactly; the distance is then taken to the centre of mass of the hits round it, which
// is known to a fraction of a cell.
#pragma once

#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/span.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

inline constexpr std::uint8_t kFieldBeyond = 255;    ///< field value: no obstacle within the field's reach
inline constexpr float kFieldUnitsAtReach = 254.0F;  ///< field value at the reach
inline constexpr float kMostCellsOfFieldReach = 64;  ///< the reach is cut to this, however small the cells are

class DistanceField {
 public:
  /// The part of a row whose cells have the same nearest obstacle.
  struct Run {
    std::uint16_t column = 0;   ///< of the obstacle
    std::uint16_t first = 0;    ///< cell of the row; up to the first of the next run
    std::int16_t rows_off = 0;  ///< from the row to the obstacle's
  };
  /// Scratch, needed only while a field is built.
  struct Memory {
    Span<std::uint8_t> below;  ///< rows to the nearest obstacle below, a column
    Span<Run> runs;
  };
  template <class A>
  static constexpr Memory carve(A& arena, std::uint16_t max_side) {
    Memory m;
    m.below = arena.template take<std::uint8_t>(max_side, Part::spectral, Region::fast);
    m.runs = arena.template take<Run>(max_side, Part::spectral, Region::fast);
    return m;
  }

  /// Starts to fill `out` (side^2) with the distances of `grid`, in kFieldUnitsAtReach parts of `reach_m`. A cell is an
  /// obstacle from `occupied_from` 254ths of hits on. `memory` has at least a side of each, which the caller checks.
  void begin(const GridView& grid, float reach_m, std::uint8_t occupied_from, Span<std::uint8_t> out,
             const Memory& memory);

  /// `rows` rows of a sweep: O(side) each. True when the field is complete.
  bool step(std::uint32_t rows);

 private:
  void sweep_down(std::uint32_t row);
  void sweep_up(std::uint32_t row);
  std::size_t envelope(const std::uint8_t* above);
  void write_row(std::uint32_t row, std::size_t runs);
  void restart_column_counts();

  GridView grid_;
  Span<std::uint8_t> out_;
  Memory memory_;
  std::uint8_t occupied_from_ = 0;
  float reach_cells_ = 0.0F;
  float units_a_cell_ = 0.0F;
  std::uint8_t most_rows_ = 0;  ///< obstacles farther away along a column do not count
  std::uint32_t row_ = 0;       ///< rows done, of both sweeps
};

}  // namespace mellin
