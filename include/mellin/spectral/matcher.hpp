// Spectral registration of two submaps by the Fourier-Mellin transform (paper, Section IV): no initial guess, any
// rotation, several hypotheses.
//
// Method. The magnitudes of the pictures' spectra give the rotation, or several candidates for it (rotation.hpp). For
// each, both the angle beta and beta + 180 degrees are tried: picture b is turned, and a phase-only matched filter
// gives the translation.
//
// Use alone: make the features of each picture once with extract(), keep them, match() any two.
// Pictures are bytes, 0 free or unobserved, 255 an obstacle, as DigestMaker writes them; index order and frames as in
// grid/submap.hpp (origin at the centre of the grid).
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/containers.hpp"
#include "mellin/core/math.hpp"
#include "mellin/core/se2.hpp"
#include "mellin/core/span.hpp"
#include "mellin/core/status.hpp"
#include "mellin/grid/image.hpp"
#include "mellin/spectral/features.hpp"
#include "mellin/spectral/fft2.hpp"
#include "mellin/spectral/matcher_config.hpp"
#include "mellin/spectral/rotation.hpp"
#include "mellin/spectral/surface_peaks.hpp"

namespace mellin {

/// Covariance of a registered pose: x and y m^2, theta rad^2, theta taken for independent of the place.
///
/// For a correlation coefficient r the share 1 - r^2 of the other picture is unexplained: noise. It moves the peak by
/// H^-1 times its gradient, H the peak's curvature, so that the covariance is (1 - r^2) / (r n) H^-1. n is how many
/// independent samples the noise has: pictures differ by walls, not by pixels, so n grows with the side (measured,
/// tests/matcher_covariance_test.cpp). A phase-only filter makes every peak sharp, in a corridor, too; there r is its
/// peak, and H that of picture a's correlation with itself. Added is what the fit of a peak leans to.
struct PeakCovariance {
  float xx = 0.0F;
  float xy = 0.0F;
  float yy = 0.0F;
  float tt = 0.0F;
};

/// Where b may lie in a.
struct Hypothesis {
  Pose2 a_T_b;                 ///< pose of b's frame in a's, m and rad, theta in [-pi, pi)
  float peak = 0.0F;           ///< of the phase-only filter: 1 for equal pictures, near 0 for unrelated ones
  float rotation_peak = 0.0F;  ///< of the correlation that gave the rotation: 1 for equal pictures, over 0
  float scale = 1.0F;          ///< b enlarged by it about its origin, then moved by a_T_b, looks like a
  PeakCovariance covariance;   ///< of a_T_b, from noise only: a wrong hypothesis may have a small one
};

/// Of one match; the lowest peaks drop out.
inline constexpr std::size_t kMaxMatchHypotheses = 32;
/// Best first.
using HypothesisList = FixedList<Hypothesis, kMaxMatchHypotheses>;

/// What may differ from match to match.
struct MatchOptions {
  std::uint8_t max_peaks = 0;       ///< rotation peaks to try; 0 means as configured, more than that is cut to it
  float min_rotation_peak = -1.0F;  ///< no translation is sought at rotations whose coefficient is lower
};

struct PeakSpread;

class Matcher {
 public:
  struct Memory {
    Fft2::Memory fft;
    Span<Complex> first;      ///< a spectrum
    Span<Complex> second;     ///< a spectrum; scratch memory of extract()
    Span<float> rows;         ///< Fft2::kBlock rows of an image
    Span<Complex> lines;      ///< twice kFftLanes columns of a spectrum and one more
    Span<float> lowpass;      ///< along one axis
    Span<Complex> masked;     ///< seven spectra, for MatcherConfig::masked
    Span<float> masked_rows;  ///< seven blocks of rows, likewise
    RotationEstimator::Memory rotation;
    Span<Complex> turns;             ///< spectra of the query, turned and whitened, MatcherConfig::kept_turns of them
    Span<std::uint16_t> turn_place;  ///< of each angle: where in `turns`, from 1 on; 0: not there
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
    m.lowpass = tables.template take<float>(side, Part::spectral, Region::fast);
    m.masked = work.template take<Complex>(config.masked ? 7 * spectrum_size(config.side) : 0, Part::spectral);
    m.masked_rows = work.template take<float>(config.masked ? 7 * Fft2::kBlock * side : 0, Part::spectral);
    m.rotation = RotationEstimator::carve(tables, work, config);
    m.turns = work.template take<Complex>(config.kept_turns * spectrum_size(config.side), Part::spectral);
    m.turn_place =
        work.template take<std::uint16_t>(config.kept_turns > 0 ? side * config.turns_per_bin : 0, Part::spectral);
    return m;
  }

  /// Plans and tables. invalid_config: not is_valid(config). insufficient_memory: `memory` was carved for another side.
  /// The results do not depend on `unit`; the processor must have it.
  Status init(const MatcherConfig& config, const Memory& memory, VectorUnit unit = best_vector_unit());
  const MatcherConfig& config() const { return config_; }

  /// Starts making the features of a picture in `out`: its obstacles (side * side bytes) and the mask of what was
  /// observed (mask_bytes(side), see digest.hpp; empty: nothing is known to be free, all counts as observed where
  /// MatcherConfig::masked asks). All must live until
  /// the job is done. An unfinished earlier job is given up. invalid_argument: sizes do not hold.
  Status begin_extract(Span<const std::uint8_t> obstacles, Features& out, Span<const std::uint8_t> observed = {});
  /// Starts matching; the memory of both must live and stay until the job is done, and they may be the same. An
  /// unfinished earlier job is given up. invalid_argument: sizes do not hold, or a has no filter, or b no image.
  /// degenerate: one of them is not ready; there are no hypotheses then.
  Status begin_match(const Features& a, const Features& b, const MatchOptions& options = {});

  /// Rotation peaks that the last match found and left aside for MatchOptions::max_peaks. Once step() has returned
  /// true.
  std::size_t untried_rotations() const;
  /// Goes on with the last match, which has ended and no other job has followed: its untried rotations are tried.
  /// hypotheses() are of these alone then. False where there are none.
  bool begin_further();

  /// Names the query: from now on matches with `b`, told by where its image lies, keep its turned spectra for the next
  /// one, until b is extracted anew or another query is named. Only where MatcherConfig::kept_turns is not 0.
  void keep_turned(const Features& b);

  /// Does one pass, or lines_per_step lines of it, of the job. True when the job is done, or there is none.
  /// Costliest pass: the filtered columns of a turned picture, two FFTs a column.
  bool step();
  /// How the last job ended, once step() has returned true. ok; degenerate: the picture of an extract() has no
  /// structure to match by (all free, all unknown, all one value), its features stay not ready.
  Status status() const { return status_; }
  /// Of the last match, best first; may be empty.
  const HypothesisList& hypotheses() const { return hypotheses_; }

  /// begin_extract() and all its steps. Status of both.
  Status extract(Span<const std::uint8_t> obstacles, Features& out, Span<const std::uint8_t> observed = {});
  /// begin_match() and all its steps. Status of both; see hypotheses().
  Status match(const Features& a, const Features& b, const MatchOptions& options = {});

 private:
  enum class Stage : std::uint8_t {
    idle,
    load,
    blur_edges,
    picture_rows,
    masked_rows,
    masked_columns,
    picture_columns,
    whiten,
    describe_rotation,
    estimate_rotation,
    masked_turned_rows,
    masked_turned_columns,
    masked_correlation,
    masked_search,
    turned_rows,
    turned_columns,
    filter_columns,
    surface_rows,
    locate_peak
  };

  /// A spectrum's memory lent to real numbers: at least side * (side + 2) of them.
  static Span<float> as_floats(Span<Complex> memory) {
    return Span<float>(reinterpret_cast<float*>(memory.data()), 2 * memory.size());
  }
  std::size_t lines_of(Stage stage) const;
  void run(Stage stage, std::size_t first, std::size_t count);
  Stage after(Stage stage);

  ImageView picture_image() const;
  void add_curvature(std::size_t row);
  void end_curvature();
  void load_rows(std::size_t first, std::size_t count);
  void blur_edges(std::size_t first, std::size_t count);
  void transform_picture_rows(std::size_t first, std::size_t count);
  void transform_picture_columns(std::size_t first, std::size_t count);
  void end_magnitudes();
  void whiten_columns(std::size_t first, std::size_t count);
  Stage begin_rotation();
  std::uint32_t turn_index() const;
  double turned_angle() const;
  float turn_variance() const;
  void keep_turn();
  void transform_turned_rows(std::size_t first, std::size_t count);
  void whiten_turned_columns(std::size_t first, std::size_t count);
  void filter_turned_columns(std::size_t first, std::size_t count);
  SinCosF turn_under_way() const;
  void fill_masked_row(const float* picture, const float* mask, std::size_t row_in_block);
  void transform_masked_block(std::size_t row, std::size_t rows, const Span<Complex> (&spectra)[3]);
  void transform_masked_rows(std::size_t first, std::size_t count);
  void transform_masked_columns(std::size_t first, std::size_t count);
  void transform_masked_turned_rows(std::size_t first, std::size_t count);
  void transform_masked_turned_columns(std::size_t first, std::size_t count);
  void correlate_masked_columns(std::size_t first, std::size_t count);
  const float* masked_surface_rows(std::size_t first, std::size_t count);
  void search_masked_rows(std::size_t first, std::size_t count);
  Span<Complex> masked_spectrum_of_b(std::size_t i) const;
  Span<Complex> masked_sum(std::size_t i) const;
  void begin_surface();
  void search_surface_rows(std::size_t first, std::size_t count);
  const float* surface_row(std::size_t row, bool begins);
  PeakSpread translation_spread(const PeakWindow& window, int radius) const;
  void locate_peak(const Fft2::Peak& peak);
  /// Rotation peaks that are tried.
  std::size_t rotation_count() const;
  void add_hypothesis(const Hypothesis& hypothesis);
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

  Span<const std::uint8_t> picture_;  // obstacles …
  Span<const std::uint8_t> observed_;
  Features* out_ = nullptr;
  std::uint8_t lowest_ = 0;  // of the picture's bytes
  std::uint8_t highest_ = 0;
  double sum_ = 0.0;        // of magnitudes
  double moments_[5] = {};  // of the picture: its sum, that of its squares, of squared differences along x, y and both

  Features a_;
  Features b_;
  MatchOptions options_;
  RotationEstimator rotation_;
  std::size_t rotation_index_ = 0;  // of its peaks, the one under way
  bool half_turn_ = false;          // looking at beta + 180 degrees
  const float* query_ = nullptr;    // image of the picture whose turned spectra are kept
  std::size_t turns_ = 0;           // that are kept so far
  std::size_t block_row_ = 0;       // first of the surface's rows that are at hand
  Span<Complex> turned_;            // b under way: turned, in the end whitened too
  SurfacePeaks peaks_;              // of the correlation surface so far
  Fft2::Peak peak_;                 // the highest, where only that is asked for
  HypothesisList hypotheses_;
};

/// Bytes that a matcher takes from an arena, beside its own size and its pictures' features.
constexpr std::size_t required_bytes(const MatcherConfig& config) {
  MeasureArena measure;
  Matcher::carve(measure, config);
  return measure.use().total();
}

}  // namespace mellin
