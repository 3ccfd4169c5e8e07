// What the map collection asks of a method that recognises places: a digest of each submap that can be compared with
// all others quickly, and a comparison of two full grids that gives poses (paper, Sections III-C and IV; its Section
// III wants both replaceable). The spectral method is screening.hpp and registration.hpp; another one takes its place
// by implementing these two interfaces.
#pragma once

#include <cmath>
#include <cstdint>

#include "mellin/core/containers.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

/// One way in which submap b may lie in submap a.
struct PlaceHypothesis {
  Pose2 a_T_b;
  Sym3 covariance;            ///< of a_T_b over (x, y in a's frame, theta); from registration only
  float peak = 0.0F;          ///< strength of the match, 0 to 1
  float agreement = 0.0F;     ///< of what both observed, 0 to 1; after registration times inlier_share
  float overlap = 0.0F;       ///< shared observed area over the smaller one; from registration only
  float inlier_share = 0.0F;  ///< of the aligned points; from registration only
  float confidence = 0.0F;    ///< probability that the pose is right (spectral/confidence.hpp); from registration only
};

/// How promising a hypothesis is before it is aligned: over the pairs of recorded drives this ranks better than
/// agreement or peak alone (`mellin eval screening`, scores peak, agreement, rank).
inline float rank_of(float agreement, float peak) { return agreement * std::sqrt(peak > 0.0F ? peak : 0.0F); }

inline constexpr std::size_t kMaxPlaceHypotheses = 6;
/// Best first: by rank, after registration by confidence.
using PlaceHypotheses = FixedList<PlaceHypothesis, kMaxPlaceHypotheses>;

/// How far a comparison of two digests came.
enum class CompareEnd : std::uint8_t {
  compared,     ///< through all stages
  coarse,       ///< dropped: already coarser digests do not match
  rotation,     ///< dropped: no rotation stands out
  first_peaks,  ///< not all rotations were tried, since the first ones left no hope
};

/// Keeps a digest of each submap under an index and compares two of them. One job at a time, in bounded slices.
class DigestMatcher {
 public:
  /// Starts to describe a submap; `grid` must stay until step() says true. Indices may be used again.
  /// invalid_argument: index or size out of range.
  virtual Status begin_describe(std::uint32_t index, const GridView& grid) = 0;
  /// Starts to restore a description from the bytes that digest_bytes() gave.
  virtual Status begin_restore(std::uint32_t index, Span<const std::uint8_t> digest) = 0;
  /// Starts to compare two described submaps; `thorough`: the pair is likely, no early stage may drop it.
  /// invalid_argument; degenerate where one has nothing to compare.
  virtual Status begin_compare(std::uint32_t a, std::uint32_t b, bool thorough) = 0;
  /// One slice. True when the job is done.
  virtual bool step() = 0;
  virtual const PlaceHypotheses& hypotheses() const = 0;
  /// How the last comparison ended. A pair that was dropped (coarse, rotation) is no candidate whatever its hypotheses.
  virtual CompareEnd compare_end() const { return CompareEnd::compared; }
  /// What has to be stored to restore a description. Of the one described or restored last.
  virtual Span<const std::uint8_t> digest_bytes(std::uint32_t index) const = 0;
  /// Whether all descriptions are held. Otherwise only that of the submap described last and that of the one restored
  /// last are: who wants to compare the one with another restores that first.
  virtual bool holds_digests() const = 0;

 protected:
  ~DigestMatcher() = default;
};

/// Registers full grids: one, the query, with several others in turn, so that what is made of the query alone is made
/// once. One job at a time, in bounded slices.
class GridMatcher {
 public:
  /// Names the query. It must stay until the last step() against it. invalid_argument: size out of range.
  virtual Status set_query(const GridView& b) = 0;
  /// Starts to register the query (b) with `a`, which must stay until step() says true. invalid_argument: size out of
  /// range, no query.
  virtual Status begin(const GridView& a) = 0;
  virtual bool step() = 0;
  virtual const PlaceHypotheses& hypotheses() const = 0;

 protected:
  ~GridMatcher() = default;
};

}  // namespace mellin
