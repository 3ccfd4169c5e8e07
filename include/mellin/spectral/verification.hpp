// Verification of a registered pair of submaps: do they agree under a hypothesis a_T_b? Not in the paper, whose matcher
// trusts its correlation peak. Occupied cells of one submap that fall on the other's obstacles speak for the
// hypothesis (hits), those that fall on space that the other saw free speak against it (conflicts); what only one of
// them observed says nothing. It is the gate against false loop closures.
//
// Works on class grids: a byte a cell, reduced from a submap's grid or digest.
#pragma once

#include <cstdint>

#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

/// Bits of a class grid's cell.
inline constexpr std::uint8_t kClassObserved = 1;  ///< anything in the block was observed
inline constexpr std::uint8_t kClassOccupied = 2;  ///< an obstacle lies in the block
inline constexpr std::uint8_t kClassNear = 4;      ///< an obstacle lies in the block or beside it: a hit lands here
inline constexpr std::uint8_t kClassClear =
    8;  ///< observed free, further than clear_cells from any obstacle: a conflict

/// A square grid of class bits that somebody else owns; index order and frame as GridView.
struct ClassView {
  Span<const std::uint8_t> cells;  ///< side * side
  std::uint16_t side = 0;          ///< cells; even
  float cell_m = 0.0F;             ///< edge of a cell
};

struct VerificationConfig {
  /// A grid cell is an obstacle from this many 254ths of hits per observation on (1 to 254).
  std::uint8_t occupied_from = 127;
  /// Chebyshev distance, cells of the class grid, within which an occupied cell counts as a hit (0 to 4).
  std::uint8_t near_cells = 1;
  /// Chebyshev distance, cells, that free space must keep from obstacles to contradict one (near_cells to 4). The band
  /// between the two says nothing: it is where pose error and quantisation act.
  std::uint8_t clear_cells = 1;
  /// Length of wall, m, that a hypothesis must explain before it counts for one half without any conflict: it keeps
  /// slight overlaps from scoring well by chance.
  float doubt_m = 2.0F;
};

/// Defaults for digests, whose pixels are so large that a hit in the next one says little.
inline constexpr VerificationConfig kDigestVerification = {127, 0, 0, 6.0F};

/// The evidence for and against a hypothesis. Counts are cells of the class grids.
struct Agreement {
  float score = 0.0F;          ///< 0 to 1: hits / (hits + conflicts + doubt), over both directions
  float overlap = 0.0F;        ///< 0 to 1: area that both observed over the smaller observed area
  float union_overlap = 0.0F;  ///< 0 to 1: area that both observed over the area that either observed
  std::uint32_t hits_b_on_a = 0;
  std::uint32_t conflicts_b_on_a = 0;
  std::uint32_t hits_a_on_b = 0;
  std::uint32_t conflicts_a_on_b = 0;
  std::uint32_t shared_cells = 0;  ///< of b, whose centre falls on a cell that a observed
};

/// Reduces a submap's grid to `side` x `side` classes in `out` and returns their view. `side` divides grid.side and is
/// even; `out` holds at least side * side bytes. A block is occupied where any of its cells is, and free where none is
/// and at least half of them were observed. invalid_argument: sizes that do not fit, a cell size that is not a positive
/// number; invalid_config: `config` outside its stated limits. Cost: one pass over the grid, one over the classes.
Result<ClassView> classify(const GridView& grid, const VerificationConfig& config, std::uint16_t side,
                           Span<std::uint8_t> out);

/// The same from a digest with both masks, at its own side: occupied is what is observed and not free. `out` holds at
/// least side * side bytes. Statuses as above; invalid_argument too where a mask is missing.
Result<ClassView> classify(const DigestView& digest, const VerificationConfig& config, Span<std::uint8_t> out);

/// Evidence for b lying at a_T_b (poses of the class grids' centres). The grids may differ in side and in cell size;
/// best close to the same. invalid_argument: a view whose size does not fit, a pose that is not finite;
/// invalid_config. Cost: one rotation and look-up a cell of a and of b.
Result<Agreement> verify(const ClassView& a, const ClassView& b, const Pose2& a_T_b,
                         const VerificationConfig& config = {});

/// An occupied cell of a class grid.
struct ClassCell {
  std::uint16_t column = 0;
  std::uint16_t row = 0;
};

/// The occupied cells of `view`, row by row, in `out`, which holds at least as many as `view` has cells.
/// invalid_argument: sizes that do not fit. Cost: one pass over the classes.
Result<Span<const ClassCell>> obstacles(const ClassView& view, Span<ClassCell> out);

/// A class grid with its obstacles().
struct ClassObstacles {
  ClassView view;
  Span<const ClassCell> cells;
};

/// As verify(), but hits, conflicts and score alone; overlaps and shared cells stay 0. Cost: one rotation and look-up
/// an obstacle, some tenth of what verify() takes. Statuses as verify().
Result<Agreement> verify_obstacles(const ClassObstacles& a, const ClassObstacles& b, const Pose2& a_T_b,
                                   const VerificationConfig& config = {});

/// The same without lists of the obstacles, which are looked for among all cells, eight at a time.
Result<Agreement> verify_obstacles(const ClassView& a, const ClassView& b, const Pose2& a_T_b,
                                   const VerificationConfig& config = {});

}  // namespace mellin
