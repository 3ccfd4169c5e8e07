// Screening by Fourier-Mellin registration of thumbnails (paper, Sections III-C and V-A), each hypothesis checked
// against what the digests' masks say was observed.
#pragma once

#include <cstdint>

#include "mellin/collection/place_matcher.hpp"
#include "mellin/core/arena.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/matcher.hpp"
#include "mellin/spectral/verification.hpp"

namespace mellin {

struct ScreeningConfig {
  std::uint16_t grid_side = 768;  ///< of the submaps
  std::uint32_t max_submaps = 512;
  MatcherConfig matcher;  ///< its side is the digests': grid_side over a power of two
  VerificationConfig verification = kDigestVerification;
  std::uint8_t verified = 4;  ///< hypotheses of a pair whose agreement is looked at, strongest peaks first
  /// Keeps each digest in RAM, 1.25 bytes x side^2 each; without, two of them (the newest submap's, and the one that it
  /// is compared with), and the others are read from the store whenever they are compared, so that there has to be one.
  bool hold_digests = true;
  /// Keeps each digest's features (spectra) in RAM too, some 10 bytes x side^2 each; without, those of the older submap
  /// are made again for each comparison.
  bool cache_features = true;
};

class SpectralScreening final : public DigestMatcher {
 public:
  struct Memory {
    Span<std::uint8_t> digests;  ///< submap by submap, or the two held ones: obstacles, observed mask, free mask
    Span<float> images;          ///< of the cached features, submap by submap …
    Span<Complex> filters;
    Span<Complex> polar;
    Span<float> floors;
    Span<PictureCurvature> curvatures;
    Span<std::uint8_t> ready;
    Features features_a;  ///< … or of the two that are compared
    Features features_b;
    Matcher::Memory matcher;
    Span<std::uint8_t> classes_a;
    Span<std::uint8_t> classes_b;
    Span<ClassCell> obstacles_a;
    Span<ClassCell> obstacles_b;
    Span<float> scratch;  ///< for making digests
  };

  static constexpr std::size_t digest_size(std::uint16_t side) {
    return std::size_t{side} * side + 2 * mask_bytes(side);
  }
  template <class A>
  static constexpr Memory carve(A& arena, const ScreeningConfig& config) {
    return carve(arena, arena, config);
  }
  /// What is kept comes from `kept`. `work` is needed from begin_describe() of a submap to the last comparison with it,
  /// and may be lent to others before and after.
  template <class A, class W>
  static constexpr Memory carve(A& kept, W& work, const ScreeningConfig& config) {
    const std::uint16_t side = config.matcher.side;
    const std::size_t pixels = std::size_t{side} * side;
    Memory m;
    if (config.hold_digests) {
      m.digests = kept.template take<std::uint8_t>(digest_size(side) * config.max_submaps, Part::digests);
    } else {
      m.digests = work.template take<std::uint8_t>(digest_size(side) * 2, Part::digests);
    }
    if (config.cache_features) {
      const std::size_t slots = config.max_submaps;
      m.images = kept.template take<float>(slots * Features::image_count(config.matcher), Part::digests);
      m.filters = kept.template take<Complex>(slots * Features::filter_count(config.matcher), Part::digests);
      m.polar = kept.template take<Complex>(slots * Features::polar_count(config.matcher), Part::digests);
      m.floors = kept.template take<float>(slots, Part::digests);
      m.curvatures = kept.template take<PictureCurvature>(slots, Part::digests);
      m.ready = kept.template take<std::uint8_t>(slots, Part::digests);
    } else {
      m.features_a = Features::carve(work, config.matcher, FeatureUse::as_a);
      m.features_b = Features::carve(work, config.matcher, FeatureUse::as_b);
    }
    m.matcher = Matcher::carve(kept, work, config.matcher);
    m.classes_a = work.template take<std::uint8_t>(pixels, Part::spectral);
    m.classes_b = work.template take<std::uint8_t>(pixels, Part::spectral);
    m.obstacles_a = work.template take<ClassCell>(pixels, Part::spectral);
    m.obstacles_b = work.template take<ClassCell>(pixels, Part::spectral);
    m.scratch = work.template take<float>(scratch_size(config), Part::spectral);
    return m;
  }

  /// invalid_config: the digests' side does not come from the grids' by halving, features are to be cached of digests
  /// that are not held, or the matcher refuses its config. insufficient_memory: `memory` is not what carve() makes of
  /// `config`.
  Status init(const ScreeningConfig& config, const Memory& memory);

  Status begin_describe(std::uint32_t index, const GridView& grid) override;
  Status begin_restore(std::uint32_t index, Span<const std::uint8_t> digest) override;
  Status begin_compare(std::uint32_t a, std::uint32_t b) override;
  bool step() override;
  const PlaceHypotheses& hypotheses() const override { return hypotheses_; }
  Span<const std::uint8_t> digest_bytes(std::uint32_t index) const override;
  bool holds_digests() const override { return config_.hold_digests; }

 private:
  enum class Stage : std::uint8_t { idle, digest, features, extract_a, extract_b, match, verify };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  static constexpr std::size_t scratch_size(const ScreeningConfig& config) {
    return DigestMaker::scratch_size(config.grid_side, config.matcher.side, config.matcher.preprocessing);
  }
  bool holds(std::uint32_t index) const;
  DigestOut digest_out(std::uint32_t index) const;
  Features cached_features(std::uint32_t index) const;
  void begin_caching(std::uint32_t index);
  void begin_features(std::uint32_t index, Features& out, Stage stage);
  void begin_match();
  ClassObstacles classes(std::uint32_t index, Span<std::uint8_t> out, Span<ClassCell> cells);
  void verify_one();

  ScreeningConfig config_;
  Memory memory_;
  Matcher matcher_;
  DigestMaker maker_;
  Stage stage_ = Stage::idle;
  std::uint32_t a_ = 0;
  std::uint32_t b_ = 0;
  std::uint32_t described_ = kNone;     ///< whose digest is held in the second place, unless all are …
  std::uint32_t restored_ = kNone;      ///< … and in the first
  std::uint32_t featured_b_ = kNone;    ///< whose features features_b_ holds
  std::uint32_t kept_b_ = kNone;        ///< whose turned spectra the matcher keeps
  std::uint32_t classified_b_ = kNone;  ///< whose classes classes_b holds
  Features features_a_;                 ///< while they are cached, those under way
  Features features_b_;
  std::size_t verify_next_ = 0;
  ClassObstacles class_a_;
  ClassObstacles class_b_;
  PlaceHypotheses hypotheses_;
};

/// Inserts by falling agreement, then peak; the worst drops out when full.
void insert_by_agreement(PlaceHypotheses& list, const PlaceHypothesis& hypothesis);

}  // namespace mellin
