// What the spectral matcher is told: one structure, each field with its section of the paper (Oberländer, Roennau,
// Dillmann, ICAR 2013).
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/grid/digest.hpp"
#include "mellin/spectral/fft2.hpp"

namespace mellin {

inline constexpr std::size_t kMaxRotationPeaks = 6;
inline constexpr std::size_t kMaxTranslationPeaks = 8;

/// How the rotation is found from the magnitudes of the pictures' spectra (paper, Section IV-A step 2).
enum class RotationMode : std::uint8_t {
  /// Each of side / 2 rings (half circles of one frequency, side angles over 180 degrees) is correlated by itself, and
  /// the correlations are summed. Scale held at 1.
  rings,
  /// Phase-only matched filter of the linear polar picture: side angles over 180 degrees, side radii. Scale held at 1.
  linear_polar,
  /// Phase-only matched filter of the log-polar picture: side angles over 360 degrees, side log radii. Scale held at 1:
  /// only shifts along the angle are looked at.
  log_polar,
  /// The same, shifts along both axes: rotation and scale. What the paper does.
  log_polar_scale,
};

/// What magnitudes are weighed with before the rotation is sought (Fig. 1b).
enum class HighPass : std::uint8_t {
  none,
  radius,  ///< the frequency
  reddy,   ///< (1 - X)(2 - X), X = cos(pi fx) cos(pi fy), frequencies in cycles per pixel (Reddy, Chatterji 1996, eq.
           ///< 17)
};

/// How a peak's position between the pixels is estimated.
enum class PeakFit : std::uint8_t {
  centre_of_mass,  ///< of its neighbourhood, values under 0 taken for 0 (Eq. 3)
  gaussian,  ///< parabola through the logarithms of the peak and its two neighbours, axis by axis; where one is not
             ///< over 0 the centre of mass with radius 1
};

struct MatcherConfig {
  /// Side of the pictures, pixels: is_fft_side(). The angular resolution is 180 degrees / side (log-polar: 360 / side),
  /// refined by the peak fit.
  std::uint16_t side = 96;
  /// At most so many rotation peaks are tried, strongest first (IV-B3): 1 … 6. Time is in proportion; each gives two
  /// hypotheses.
  std::uint8_t max_peaks = 6;
  /// At most so many translation peaks of each turned picture become hypotheses, highest first: 1 … 8. The paper takes
  /// one; more are worth it where what was observed is then asked which is right.
  std::uint8_t translation_peaks = 1;
  /// Radius of the neighbourhood whose centre of mass is the peak's position (Eq. 3, CoM_r): 0 … 3 pixels.
  std::uint8_t com_radius = 1;
  /// Edge of a pixel, m: gives the hypotheses their unit.
  float pixel_m = 0.4F;
  /// Rotation peaks of at least this share of the strongest count (IV-B3; the paper says 0.9), 0 … 1.
  float peak_share = 0.5F;
  /// Standard deviation of the Gaussian low-pass in the phase-only filter, cycles per pixel; 0 leaves it out (pure
  /// phase correlation, IV-A step 3).
  float lowpass_sigma = 0.25F;
  /// Added to magnitudes before phases are taken, as a share of their mean, so that coefficients which are only
  /// rounding have no say; over 0, up to 1.
  float whitening_floor = 1e-3F;
  /// Width of the margin that is blended into its cyclically blurred self (IV-A step 1), share of the side, over 0 up
  /// to 0.1.
  float edge_margin = 0.04F;
  /// What makes the pictures of grids (IV-B2): for those who call DigestMaker; the matcher itself takes pictures as
  /// they are.
  Preprocessing preprocessing = Preprocessing::erosion;
  /// How the rotation is found (IV-A step 2). Costs of a comparison: rings least, log_polar_scale a 2D transform more.
  RotationMode rotation = RotationMode::rings;
  /// Weight of magnitudes before the rotation is sought (Fig. 1b).
  HighPass high_pass = HighPass::radius;
  /// How peaks are placed between pixels and angles (IV-B2, Eq. 3).
  PeakFit peak_fit = PeakFit::centre_of_mass;
  /// Hypotheses with a lower peak are dropped (IV-B3), 0 … 1.
  float min_peak = 0.0F;
  /// What observed free space counts in the picture that is matched, where an obstacle counts 1 and what was not
  /// observed 0: an obstacle on the other's free space then speaks against a shift as one on an obstacle speaks for it,
  /// and the unknown says nothing. 0 is the paper's way, which takes unobserved space for free (IV-B1). Without an
  /// observed mask, or where `masked`, it has no effect. 0 … 4.
  float free_weight = 1.0F;
  /// b is turned by multiples of an angular bin (180 degrees / side) over this, which is the angle that a hypothesis
  /// says then: 1 … 8; 0: by the very angle of the peak.
  std::uint8_t turns_per_bin = 0;
  /// Turned spectra of one picture, the query, that are kept between matches (Matcher::keep_turned()), at most
  /// side * turns_per_bin: a spectrum's memory each. More than one picture is compared with it at half the cost. Has no
  /// influence on the results. Only with turns_per_bin.
  std::uint16_t kept_turns = 0;
  /// Only what both pictures have observed counts in the translation step (IV-B1, masked registration [19]): its peak
  /// is the normalised cross-correlation of the overlap, -1 … 1, without low-pass or whitening. Takes the observed
  /// masks of pictures, and seven spectra of memory more; a comparison costs some four times as much. The correlation
  /// is cyclic: borders that nobody observed keep the two ends of a picture apart.
  bool masked = false;
  /// Overlaps of less than this share of the smaller observed area have no peak, over 0 up to 1. For `masked`.
  float min_overlap = 0.3F;
  /// Lines (rows, columns, rings) that one step() treats; 0 means a whole pass.
  std::uint16_t lines_per_step = 0;
};

/// Whether the matcher takes `config`: each field within its limits.
constexpr bool is_valid(const MatcherConfig& config) {
  return is_fft_side(config.side) && config.pixel_m > 0.0F && config.pixel_m < 1e3F && config.peak_share >= 0.0F &&
         config.peak_share <= 1.0F && config.max_peaks >= 1 && config.max_peaks <= kMaxRotationPeaks &&
         config.translation_peaks >= 1 && config.translation_peaks <= kMaxTranslationPeaks && config.com_radius <= 3 &&
         config.lowpass_sigma >= 0.0F && config.lowpass_sigma < 1e3F && config.whitening_floor > 0.0F &&
         config.whitening_floor <= 1.0F && config.edge_margin > 0.0F && config.edge_margin <= 0.1F &&
         config.preprocessing <= Preprocessing::blur && config.rotation <= RotationMode::log_polar_scale &&
         config.high_pass <= HighPass::reddy && config.peak_fit <= PeakFit::gaussian && config.min_peak >= 0.0F &&
         config.min_peak <= 1.0F && config.min_overlap > 0.0F && config.min_overlap <= 1.0F &&
         config.free_weight >= 0.0F && config.free_weight <= 4.0F && config.turns_per_bin <= 8 &&
         config.kept_turns <= config.side * config.turns_per_bin;
}

/// The paper taken at its word: phase-only matched filters without low-pass for rotation with scale and for
/// translation, the high-pass of its reference [9], peaks of at least 90 % of the strongest, CoM1.
constexpr MatcherConfig paper_matcher(std::uint16_t side) {
  MatcherConfig config;
  config.side = side;
  config.peak_share = 0.9F;
  config.lowpass_sigma = 0.0F;
  config.free_weight = 0.0F;
  config.rotation = RotationMode::log_polar_scale;
  config.high_pass = HighPass::reddy;
  return config;
}

}  // namespace mellin
