// Spectral registration of two submaps by the Fourier-Mellin transform (paper, Section IV): no initial guess, any
// rotation, several hypotheses.
//
// Method. The magnitude of a picture's spectrum does not depend on where the picture lies and turns with it. Resampled
// along half circles ("rings"; the other half is the same), a rotation becomes a cyclic shift of each ring, found by
// correlating all rings at once. Submaps have one scale, so scale is held at 1 and rings are spaced evenly, not
// logarithmically. For each peak of that correlation, both the angle beta and beta + 180 degrees are tried: picture b
// is turned, and a phase-only matched filter gives the translation.
//
// Use alone: make the features of each picture once with extract(), keep them, match() any two.
// Pictures are bytes, 0 free or unobserved, 255 an obstacle, as DigestMaker writes them; index order and frames as in
// grid/submap.hpp (origin at the centre of the grid).
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/containers.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/image.hpp"
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

/// Where b may lie in a.
struct Hypothesis {
  Pose2 a_T_b;                 ///< pose of b's frame in a's, m and rad, theta in [-pi, pi)
  float peak = 0.0F;           ///< of the phase-only filter: 1 for equal pictures, near 0 for unrelated ones
  float rotation_peak = 0.0F;  ///< correlation coefficient of the rings at this rotation, -1 … 1
};

/// Best first.
using HypothesisList = FixedList<Hypothesis, 2 * kMaxRotationPeaks>;

/// What a picture's features are kept for: to be `a` of a match takes filter and rings, to be `b` image and rings.
enum class FeatureUse : std::uint8_t { as_a, as_b, both };

/// A picture as the matcher needs it, over the caller's memory. Kept between matches as long as the caller likes; may
/// be copied with its memory. Empty spans are left out by extract().
struct Features {
  Span<float> image;     ///< seamless picture, side * side
  Span<Complex> filter;  ///< whitened spectrum times low-pass, spectrum_size(side)
  Span<Complex> rings;   ///< angular spectra of the rings of the magnitude, (side / 2 + 1) coefficients a ring
  float floor = 0.0F;    ///< what is added to magnitudes when a turned copy is whitened
  bool ready = false;    ///< extract() has succeeded

  static constexpr std::size_t image_count(std::uint16_t side) { return std::size_t{side} * side; }
  static constexpr std::size_t filter_count(std::uint16_t side) { return spectrum_size(side); }
  static constexpr std::size_t rings_count(std::uint16_t side) {
    return std::size_t{side} / 2U * (std::size_t{side} / 2U + 1U);
  }

  template <class A>
  static constexpr Features carve(A& arena, std::uint16_t side, FeatureUse use = FeatureUse::both,
                                  Part part = Part::spectral) {
    Features f;
    if (use != FeatureUse::as_a) {
      f.image = arena.template take<float>(image_count(side), part);
    }
    if (use != FeatureUse::as_b) {
      f.filter = arena.template take<Complex>(filter_count(side), part);
    }
    f.rings = arena.template take<Complex>(rings_count(side), part);
    return f;
  }
};

/// What may differ from match to match.
struct MatchOptions {
  std::uint8_t max_peaks = 0;       ///< rotation peaks to try; 0 means as configured, more than that is cut to it
  float min_rotation_peak = -1.0F;  ///< no translation is sought at rotations whose coefficient is lower
};

class Matcher {
 public:
  struct Memory {
    Fft2::Memory fft;
    Span<Complex> first;       ///< a spectrum
    Span<Complex> second;      ///< a spectrum; scratch memory of extract()
    Span<float> rows;          ///< Fft2::kBlock rows of an image
    Span<Complex> lines;       ///< twice kFftLanes columns of a spectrum and one more
    Span<Complex> directions;  ///< cosine and sine of each angle
    Span<float> lowpass;       ///< along one axis
    Span<float> correlation;   ///< over the angles
  };

  template <class A>
  static constexpr Memory carve(A& arena, const MatcherConfig& config) {
    return carve(arena, arena, config);
  }
  /// Plans and tables from `tables`, where they stay; what is needed only while a job runs from `work`.
  template <class A, class W>
  static constexpr Memory carve(A& tables, W& work, const MatcherConfig& config) {
    const std::size_t side = config.side;
    Memory m;
    m.fft = Fft2::carve(tables, work, config.side);
    m.first = work.template take<Complex>(spectrum_size(config.side), Part::spectral);
    m.second = work.template take<Complex>(spectrum_size(config.side), Part::spectral);
    m.rows = work.template take<float>(Fft2::kBlock * side, Part::spectral, Region::fast);
    m.lines = work.template take<Complex>(2 * (kFftLanes + 1) * side, Part::spectral, Region::fast);
    m.directions = tables.template take<Complex>(side, Part::spectral);
    m.lowpass = tables.template take<float>(side, Part::spectral, Region::fast);
    m.correlation = work.template take<float>(side, Part::spectral);
    return m;
  }

  /// Plans and tables. invalid_config: not is_valid(config). insufficient_memory: `memory` was carved for another side.
  /// The results do not depend on `unit`; the processor must have it.
  Status init(const MatcherConfig& config, const Memory& memory, VectorUnit unit = best_vector_unit());
  const MatcherConfig& config() const { return config_; }

  /// Starts making the features of `picture` (side * side bytes) in `out`; both must live until the job is done. An
  /// unfinished earlier job is given up. invalid_argument: sizes do not hold.
  Status begin_extract(Span<const std::uint8_t> picture, Features& out);
  /// Starts matching; the memory of both must live and stay until the job is done, and they may be the same. An
  /// unfinished earlier job is given up. invalid_argument: sizes do not hold, or a has no filter, or b no image.
  /// degenerate: one of them is not ready; there are no hypotheses then.
  Status begin_match(const Features& a, const Features& b, const MatchOptions& options = {});

  /// Does one pass, or lines_per_step lines of it, of the job. True when the job is done, or there is none.
  /// Costliest pass: the filtered columns of a turned picture, two FFTs a column.
  bool step();
  /// How the last job ended, once step() has returned true. ok; degenerate: the picture of an extract() has no
  /// structure to match by (all free, all unknown, all one value), its features stay not ready.
  Status status() const { return status_; }
  /// Of the last match, best first; may be empty.
  const HypothesisList& hypotheses() const { return hypotheses_; }

  /// begin_extract() and all its steps. Status of both.
  Status extract(Span<const std::uint8_t> picture, Features& out);
  /// begin_match() and all its steps. Status of both; see hypotheses().
  Status match(const Features& a, const Features& b, const MatchOptions& options = {});

 private:
  enum class Stage : std::uint8_t {
    idle,
    load,
    blur_edges,
    picture_rows,
    picture_columns,
    whiten,
    rings,
    scale_rings,
    correlate_rings,
    find_rotations,
    turned_rows,
    turned_columns,
    filter_columns,
    surface_rows,
    locate_peak
  };
  struct RotationPeak {
    double angle_rad = 0.0;
    float strength = 0.0F;
  };

  std::size_t lines_of(Stage stage) const;
  void run(Stage stage, std::size_t first, std::size_t count);
  Stage after(Stage stage);

  ImageView picture_image() const;
  void load_rows(std::size_t first, std::size_t count);
  void blur_edges(std::size_t first, std::size_t count);
  void transform_picture_rows(std::size_t first, std::size_t count);
  void transform_picture_columns(std::size_t first, std::size_t count);
  void end_magnitudes();
  void whiten_columns(std::size_t first, std::size_t count);
  void sample_rings(std::size_t first, std::size_t count);
  void scale_rings(std::size_t first, std::size_t count);
  void correlate_rings(std::size_t first, std::size_t count);
  void find_rotations();
  void transform_turned_rows(std::size_t first, std::size_t count);
  void whiten_turned_columns(std::size_t first, std::size_t count);
  void filter_turned_columns(std::size_t first, std::size_t count);
  void search_surface_rows(std::size_t first, std::size_t count);
  void locate_peak();
  void add_hypothesis(const Hypothesis& hypothesis);
  /// Sum of the rings' cross spectra; the columns' lines are not in use meanwhile.
  Span<Complex> cross_spectrum() const { return memory_.lines.first(config_.side / 2U + 1U); }
  /// Spectrum of the correlation surface under way, columns back.
  Span<Complex> surface() const { return half_turn_ ? memory_.second : memory_.first; }

  MatcherConfig config_;
  Memory memory_;
  Fft2 fft_;
  EdgeBlur edge_blur_;
  std::uint16_t margin_ = 0;
  float filter_scale_ = 1.0F;

  Stage stage_ = Stage::idle;
  std::size_t line_ = 0;  // next line of the stage
  Status status_ = Status::ok;

  Span<const std::uint8_t> picture_;
  Features* out_ = nullptr;
  std::uint8_t lowest_ = 0;  // of the picture's bytes
  std::uint8_t highest_ = 0;
  double sum_ = 0.0;  // of magnitudes, then of the rings' energy

  Features a_;
  Features b_;
  MatchOptions options_;
  FixedList<RotationPeak, kMaxRotationPeaks> rotations_;
  std::size_t rotation_count_ = 0;  // of them that are tried
  std::size_t rotation_ = 0;        // the one under way
  bool half_turn_ = false;          // looking at beta + 180 degrees
  float best_ = 0.0F;               // highest value of the correlation surface so far, and where
  std::size_t best_row_ = 0;
  std::size_t best_column_ = 0;
  HypothesisList hypotheses_;
};

}  // namespace mellin
