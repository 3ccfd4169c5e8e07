// The rotation between two pictures, and their scale, from the magnitudes of their spectra (paper, Section IV-A step
// 2).
//
// The magnitude of a picture's spectrum does not depend on where the picture lies and turns with it; the half plane
// that a real picture's spectrum stores is all of it. Resampled to polar coordinates, angles along the rows, a rotation
// becomes a cyclic shift along the angle, and with logarithmic radii a scale becomes a shift along the radius. The
// shift is found by a correlation. Each peak stands for two rotations, beta and beta + 180 degrees.
//
// RotationMode says what is correlated. Rings: each row by itself, as a correlation coefficient, summed over the rows.
// The others: the polar picture as a whole by a phase-only matched filter. Submaps have one scale, so all modes but the
// paper's own look at no shift along the radius: that row of the surface is one inverse transform of the cross spectrum
// summed over the radial frequencies.
//
// A stage of the Matcher, which lends it scratch memory and its transforms.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/containers.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/spectral/features.hpp"
#include "mellin/spectral/fft2.hpp"
#include "mellin/spectral/matcher_config.hpp"

namespace mellin {

class PeakWindow;

struct RotationPeak {
  double angle_rad = 0.0;  ///< b turned by it, or by it and 180 degrees, looks like a; about 0 … 180 degrees
  float strength = 0.0F;   ///< of the correlation: 1 for equal pictures, over 0
  float scale = 1.0F;      ///< b enlarged by it looks like a; 1 where the mode holds it
  float variance = 0.0F;   ///< of the angle, rad^2, from the peak's strength and curvature
};

/// Strongest first.
using RotationPeakList = FixedList<RotationPeak, kMaxRotationPeaks>;

class RotationEstimator {
 public:
  struct Memory {
    Span<Complex> directions;  ///< cosine and sine of each angle
    Span<float> correlation;   ///< over the angles; the best of all scales
    Span<std::uint16_t> rows;  ///< of the correlation surface where that was, for RotationMode::log_polar_scale
  };
  /// Whose contents only have to stay while a job runs.
  struct Scratch {
    Span<float> magnitudes;  ///< spectrum_size(side), while features are made
    Span<float> rows;        ///< Fft2::kBlock rows
    Span<Complex> line;      ///< side / 2 + 1, while two are compared
    Span<Complex> surface;   ///< spectrum_size(side), while two are compared
  };

  /// Tables from `tables`, where they stay; what is needed only while a job runs from `work`.
  template <class A, class W>
  static constexpr Memory carve(A& tables, W& work, const MatcherConfig& config) {
    Memory m;
    m.directions = tables.template take<Complex>(angles(config), Part::spectral);
    m.correlation = work.template take<float>(config.side, Part::spectral);
    m.rows = work.template take<std::uint16_t>(seeks_scale(config) ? angles(config) : 0, Part::spectral);
    return m;
  }

  /// Tables. `config` is valid. insufficient_memory: `memory` or `scratch` is of another side.
  Status init(const MatcherConfig& config, const Memory& memory, const Scratch& scratch);

  /// Notes the magnitudes of column kx of a picture's spectrum, weighted by the high-pass (Fig. 1b). All columns are
  /// noted before begin_describe(). Returns the sum of the magnitudes without weights.
  double note_column(const Complex* column, std::size_t kx);
  /// Starts making the features from the magnitudes: Features::polar of `config`.
  void begin_describe(Span<Complex> polar);
  /// Starts looking for the rotations from b's to a's, both made by begin_describe(), that reach `least` strength.
  void begin_estimate(Span<const Complex> a, Span<const Complex> b, float least);
  /// Does one pass, or up to `lines` lines of it if that is not 0. True when the job is done. `fft` is of the side.
  bool step(Fft2& fft, std::size_t lines);

  /// Of the last begin_describe(). degenerate: the magnitudes do not depend on the angle.
  Status status() const { return status_; }
  /// Of the last begin_estimate(): all high peaks, not only the highest (IV-B3).
  const RotationPeakList& peaks() const { return peaks_; }

 private:
  enum class Stage : std::uint8_t { idle, sample, transform, scale, correlate, search, find };

  static constexpr bool seeks_scale(const MatcherConfig& config) {
    return config.rotation == RotationMode::log_polar_scale;
  }
  static constexpr bool is_log_polar(const MatcherConfig& config) {
    return config.rotation == RotationMode::log_polar || seeks_scale(config);
  }
  /// Angles over 180 degrees, the period of magnitudes.
  static constexpr std::size_t angles(const MatcherConfig& config) {
    return is_log_polar(config) ? config.side / 2U : config.side;
  }
  bool by_rings() const { return config_.rotation == RotationMode::rings; }
  std::size_t lines_of(Stage stage) const;
  void run(Fft2& fft, std::size_t first, std::size_t count);
  Stage after(Stage stage);
  void weigh_by_reddy(std::size_t kx, float* magnitudes);
  float radius(std::size_t row) const;
  void sample_rings(const Fft2& fft, std::size_t first, std::size_t count);
  void scale_rings(std::size_t first, std::size_t count);
  void correlate_rings(std::size_t first, std::size_t count);
  void sample_polar(Fft2& fft, std::size_t first, std::size_t count);
  void transform_polar(Fft2& fft, std::size_t first, std::size_t count);
  void whiten_polar(std::size_t first, std::size_t count);
  void correlate_polar(std::size_t first, std::size_t count);
  void correlate_scales(Fft2& fft, std::size_t first, std::size_t count);
  void search_scales(Fft2& fft, std::size_t first, std::size_t count);
  void find_peaks(Fft2& fft);
  RotationPeak refined(Fft2& fft, std::size_t angle) const;
  double variance(const PeakWindow& window, int rows) const;

  MatcherConfig config_;
  Memory memory_;
  Scratch scratch_;
  Stage stage_ = Stage::idle;
  std::size_t line_ = 0;  // next line of the stage
  Status status_ = Status::ok;
  Span<Complex> out_;
  double sum_ = 0.0;  // of the rings' energy, or of the polar spectrum's magnitudes
  Span<const Complex> a_;
  Span<const Complex> b_;
  float least_ = 0.0F;
  RotationPeakList peaks_;
};

}  // namespace mellin
