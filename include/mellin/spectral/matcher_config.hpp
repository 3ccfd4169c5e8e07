// What the spectral matcher is told: one structure, each field with its section of the paper (Oberländer, Roennau,
// Dillmann, ICAR 2013).
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/spectral/fft2.hpp"

namespace mellin {

inline constexpr std::size_t kMaxRotationPeaks = 6;

struct MatcherConfig {
  /// Side of the pictures, pixels: is_fft_side(). The angular resolution is 180 degrees / side, refined by the centre
  /// of mass.
  std::uint16_t side = 96;
  /// At most so many rotation peaks are tried, strongest first (IV-B3): 1 … 6. Time is in proportion; each gives two
  /// hypotheses.
  std::uint8_t max_peaks = 6;
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
  /// Weighs magnitudes in proportion to their frequency before the rotation is sought (high-pass, Fig. 1b).
  bool high_pass = true;
  /// Lines (rows, columns, rings) that one step() treats; 0 means a whole pass.
  std::uint16_t lines_per_step = 0;
};

/// Whether the matcher takes `config`: each field within its limits.
constexpr bool is_valid(const MatcherConfig& config) {
  return is_fft_side(config.side) && config.pixel_m > 0.0F && config.pixel_m < 1e3F && config.peak_share >= 0.0F &&
         config.peak_share <= 1.0F && config.max_peaks >= 1 && config.max_peaks <= kMaxRotationPeaks &&
         config.com_radius <= 3 && config.lowpass_sigma >= 0.0F && config.lowpass_sigma < 1e3F &&
         config.whitening_floor > 0.0F && config.whitening_floor <= 1.0F && config.edge_margin > 0.0F &&
         config.edge_margin <= 0.1F;
}

}  // namespace mellin
