// What register_grids() goes through on its way to the hypotheses (paper, Fig. 1), made anew stage by stage with the
// library's own parts.
#pragma once

#include <vector>

#include "host/grid_registration.hpp"
#include "host/heap_arena.hpp"
#include "mellin/spectral/matcher.hpp"

namespace mellin::host {

/// A grid on its way to its features. Pictures are row-major, row 0 at the bottom.
struct TracedPicture {
  std::vector<std::uint8_t> obstacles;  ///< thickened, scaled, normalised: side * side
  std::vector<std::uint8_t> observed;   ///< mask_bytes(side)
  std::vector<float> image;             ///< as it is transformed: seamless, observed free space below 0
  std::vector<float> magnitudes;        ///< after the high-pass, laid out as a spectrum is (spectral/fft2.hpp)
  std::vector<float> polar;             ///< rows of equal frequency over the angles; rings without their means
  bool ready = false;                   ///< it shows something to match by
};

/// B turned by a rotation that was tried, and how it correlates with A.
struct TracedCandidate {
  RotationPeak rotation;
  double angle_rad = 0.0;         ///< the rotation's, or 180 degrees more
  std::vector<float> turned;      ///< side * side
  std::vector<float> surface;     ///< side * side, cyclic; a shift of (x, y) pixels at column x, row y
  std::vector<Fft2::Peak> peaks;  ///< those that become hypotheses, highest first
};

struct RegistrationTrace {
  PaddedPair pair;
  TracedPicture a;
  TracedPicture b;
  std::vector<float> rotation_correlation;  ///< over 180 degrees in equal steps
  std::vector<RotationPeak> rotations;      ///< that are tried, strongest first
  std::vector<TracedCandidate> candidates;  ///< two a rotation
  std::vector<Hypothesis> matches;          ///< the matcher's, strongest peak first; between the padded grids
  std::vector<GridHypothesis> hypotheses;   ///< verified, aligned, judged: what register_grids() returns

  std::size_t side() const { return pair.config.matcher.side; }
  /// A shift along a cyclic axis of that many pixels as the one nearest to none.
  double shift(std::size_t position) const {
    return position < (side() + 1) / 2 ? static_cast<double>(position)
                                       : static_cast<double>(position) - static_cast<double>(side());
  }
  /// The candidate with the highest peak; nullptr where there is none.
  const TracedCandidate* best_candidate() const;
};

/// Throws std::invalid_argument where the matcher is `masked` (it has no phase-only surface), std::runtime_error where
/// the library refuses the pair. Memory: 12 side^2 floats and more, 50 MB at most.
RegistrationTrace trace_registration(const PaddedPair& pair);

}  // namespace mellin::host
