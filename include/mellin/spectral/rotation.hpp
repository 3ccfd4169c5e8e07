// The rotation between two pictures, from the magnitudes of their spectra (paper, Section IV-A step 2).
//
// The magnitude of a picture's spectrum does not depend on where the picture lies and turns with it. Resampled along
// half circles ("rings"; the other half is the same), a rotation becomes a cyclic shift of each ring, found by
// correlating all rings at once. Submaps have one scale, so scale is held at 1 and rings are spaced evenly, not
// logarithmically. Each peak stands for two rotations, beta and beta + 180 degrees.
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

struct RotationPeak {
  double angle_rad = 0.0;  ///< b turned by it, or by it and 180 degrees, looks like a; about 0 … 180 degrees
  float strength = 0.0F;   ///< correlation coefficient of the rings, over 0 up to 1
};

/// Strongest first.
using RotationPeakList = FixedList<RotationPeak, kMaxRotationPeaks>;

class RotationEstimator {
 public:
  struct Memory {
    Span<Complex> directions;  ///< cosine and sine of each angle
    Span<float> correlation;   ///< over the angles
  };
  /// Whose contents only have to stay while a job runs.
  struct Scratch {
    Span<float> magnitudes;  ///< spectrum_size(side), while features are made
    Span<float> row;         ///< side
    Span<Complex> line;      ///< side / 2 + 1, while two are compared
  };

  /// Tables from `tables`, where they stay; what is needed only while a job runs from `work`.
  template <class A, class W>
  static constexpr Memory carve(A& tables, W& work, const MatcherConfig& config) {
    const std::size_t side = config.side;
    Memory m;
    m.directions = tables.template take<Complex>(side, Part::spectral);
    m.correlation = work.template take<float>(side, Part::spectral);
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
  bool step(const Fft2& fft, std::size_t lines);

  /// Of the last begin_describe(). degenerate: the magnitudes do not depend on the angle.
  Status status() const { return status_; }
  /// Of the last begin_estimate(): all high peaks, not only the highest (IV-B3).
  const RotationPeakList& peaks() const { return peaks_; }

 private:
  enum class Stage : std::uint8_t { idle, sample, scale, correlate, find };

  std::size_t lines_of(Stage stage) const;
  void run(const Fft2& fft, std::size_t first, std::size_t count);
  Stage after(Stage stage);
  void sample_rings(const Fft2& fft, std::size_t first, std::size_t count);
  void scale_rings(std::size_t first, std::size_t count);
  void correlate_rings(std::size_t first, std::size_t count);
  void find_peaks(const Fft2& fft);
  double peak_position(std::size_t i) const;

  MatcherConfig config_;
  Memory memory_;
  Scratch scratch_;
  Stage stage_ = Stage::idle;
  std::size_t line_ = 0;  // next line of the stage
  Status status_ = Status::ok;
  Span<Complex> out_;
  double energy_ = 0.0;  // of the rings
  Span<const Complex> a_;
  Span<const Complex> b_;
  float least_ = 0.0F;
  RotationPeakList peaks_;
};

}  // namespace mellin
