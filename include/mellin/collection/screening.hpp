// Screening by Fourier-Mellin registration of thumbnails (paper, Sections III-C and V-A), each hypothesis checked
// against what the digests' masks say was observed. A cascade: coarse digests first, rotations that stand out, few of
// them before all.
#pragma once

#include <cstdint>

#include "mellin/collection/coarse_screening.hpp"
#include "mellin/collection/digest_verifier.hpp"
#include "mellin/collection/feature_cache.hpp"
#include "mellin/collection/place_matcher.hpp"
#include "mellin/core/arena.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/matcher.hpp"
#include "mellin/spectral/verification.hpp"

namespace mellin {

/// Of the rotation peaks the third and all after it are worth less than they cost: on three recorded drives, in all
/// profiles, edges and errors are the same without (tools/accuracy.sh --set screening.max_peaks=6).
constexpr MatcherConfig screening_matcher() {
  MatcherConfig config;
  config.max_peaks = 2;
  return config;
}

/// The cascade. A pair goes from the cheapest look to the dearest, and is dropped as soon as nothing speaks for it.
/// Each stage can be left out. What each drops and keeps on recorded drives: `mellin eval cascade`, which gave the
/// figures here: of pairs that share no scans dropped / of those that became loop edges kept, on intel, fr079 and aces,
/// at two rotation peaks; chosen on intel. A pair that the graph has in one place already is always looked at in full.
struct ScreeningConfig {
  std::uint16_t grid_side = 768;  ///< of the submaps
  std::uint32_t max_submaps = 512;
  MatcherConfig matcher = screening_matcher();  ///< its side is the digests': grid_side over a power of two
  VerificationConfig verification = kDigestVerification;
  /// First stage: rotation peaks that are tried on digests of half the side, 1 … 6; 0 leaves the stage out. Takes
  /// cache_features, and a quarter of the held digests' memory more. With two peaks and a coarse_peak of 0.2 it drops
  /// 52, 36, 82 % and keeps 97.7, 97.3, 85 %: less than the second stage does, which costs next to nothing.
  std::uint8_t coarse_peaks = 0;
  float coarse_peak = 0.0F;       ///< 0 … 1: a pair is dropped whose coarse digests match with a lower peak …
  float coarse_agreement = 0.0F;  ///< … or agree less, 0 … 1
  /// Second stage: no translation is sought at rotations whose coefficient is lower, 0 … 1; 0 leaves the stage out.
  /// Drops 42, 36, 5 % and keeps 99.5, 99.7, 100 % (without it 99.7, 99.7, 100 % of what six rotation peaks find).
  float min_rotation_peak = 0.35F;
  /// Third stage: so many rotation peaks are tried first, 1 … 6, and the others … Of two peaks the second one is spared
  /// so rarely that it gains nothing; it is for those who try more.
  std::uint8_t first_peaks = kMaxRotationPeaks;
  float further_agreement = 0.0F;  ///< … only where one of the first leads to at least this agreement, 0 … 1
  std::uint8_t verified = 4;       ///< hypotheses of a pair whose agreement is looked at, strongest peaks first …
  float verified_share = 0.0F;     ///< … as long as their peaks are at least this share of the strongest, 0 … 1
  /// Keeps each digest in RAM, 1.25 bytes x side^2 each; without, two of them (the newest submap's, and the one that it
  /// is compared with), and the others are read from the store whenever they are compared, so that there has to be one.
  bool hold_digests = true;
  /// Keeps each digest's features (spectra) in RAM too, some 10 bytes x side^2 each; without, those of the older submap
  /// are made again for each comparison.
  bool cache_features = true;
};

/// What the first stage does: the same matcher at half the side.
constexpr CoarseScreeningConfig coarse_config(const ScreeningConfig& config) {
  CoarseScreeningConfig coarse;
  coarse.matcher = config.matcher;
  coarse.matcher.side = static_cast<std::uint16_t>(config.matcher.side / 2);
  coarse.matcher.pixel_m = 2.0F * config.matcher.pixel_m;
  coarse.matcher.max_peaks = config.coarse_peaks;
  const auto turns = static_cast<std::uint16_t>(coarse.matcher.side * config.matcher.turns_per_bin);
  coarse.matcher.kept_turns = config.matcher.kept_turns < turns ? config.matcher.kept_turns : turns;
  coarse.verification = config.verification;
  coarse.slots = config.coarse_peaks > 0 ? config.max_submaps : 0;
  return coarse;
}

class SpectralScreening final : public DigestMatcher {
 public:
  struct Memory {
    Span<std::uint8_t> digests;     ///< submap by submap, or the two held ones: obstacles, observed mask, free mask
    FeatureCache::Memory features;  ///< of all submaps …
    Features features_a;            ///< … or of the two that are compared
    Features features_b;
    Matcher::Memory matcher;
    DigestVerifier::Memory verifier;
    CoarseScreening::Memory coarse;
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
    Memory m;
    if (config.hold_digests) {
      m.digests = kept.template take<std::uint8_t>(digest_size(side) * config.max_submaps, Part::digests);
    } else {
      m.digests = work.template take<std::uint8_t>(digest_size(side) * 2, Part::digests);
    }
    if (config.cache_features) {
      m.features = FeatureCache::carve(kept, config.matcher, config.max_submaps);
    } else {
      m.features_a = Features::carve(work, config.matcher, FeatureUse::as_a);
      m.features_b = Features::carve(work, config.matcher, FeatureUse::as_b);
    }
    m.matcher = Matcher::carve(kept, work, config.matcher);
    m.verifier = DigestVerifier::carve(work, side);
    m.coarse = CoarseScreening::carve(kept, work, coarse_config(config));
    m.scratch = work.template take<float>(scratch_size(config), Part::spectral);
    return m;
  }

  /// invalid_config: the digests' side does not come from the grids' by halving, features are to be cached of digests
  /// that are not held, the coarse stage is to go without cached features, or a matcher refuses its config (the coarse
  /// one's side has to be a transform's, too). insufficient_memory: `memory` is not what carve() makes of
  /// `config`.
  Status init(const ScreeningConfig& config, const Memory& memory);

  Status begin_describe(std::uint32_t index, const GridView& grid) override;
  Status begin_restore(std::uint32_t index, Span<const std::uint8_t> digest) override;
  Status begin_compare(std::uint32_t a, std::uint32_t b, bool thorough = false) override;
  bool step() override;
  /// Of the stage that the comparison came to.
  const PlaceHypotheses& hypotheses() const override { return hypotheses_; }
  CompareEnd compare_end() const override { return end_; }
  Span<const std::uint8_t> digest_bytes(std::uint32_t index) const override;
  bool holds_digests() const override { return config_.hold_digests; }

 private:
  enum class Stage : std::uint8_t {
    idle,
    digest,
    features,
    describe_coarse,
    compare_coarse,
    extract_a,
    extract_b,
    match,
    verify
  };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  static constexpr std::size_t scratch_size(const ScreeningConfig& config) {
    const std::size_t maker =
        DigestMaker::scratch_size(config.grid_side, config.matcher.side, config.matcher.preprocessing);
    const std::size_t coarse = CoarseScreening::scratch_size(coarse_config(config));
    return maker > coarse ? maker : coarse;
  }
  bool holds(std::uint32_t index) const;
  DigestOut digest_out(std::uint32_t index) const;
  DigestView digest_view(std::uint32_t index) const { return digest_out(index).view(config_.matcher.pixel_m); }
  void begin_caching(std::uint32_t index);
  void begin_describing_coarse();
  void begin_features(std::uint32_t index, Features& out, Stage stage);
  void begin_full_comparison();
  void finish_coarse();
  void begin_match();
  void finish_match();
  void verify_one();
  void finish_verification();

  ScreeningConfig config_;
  Memory memory_;
  Matcher matcher_;
  DigestMaker maker_;
  FeatureCache cache_;
  DigestVerifier verifier_;
  CoarseScreening coarse_;
  Stage stage_ = Stage::idle;
  std::uint32_t a_ = 0;
  std::uint32_t b_ = 0;
  bool thorough_ = false;               ///< the comparison under way
  std::uint32_t described_ = kNone;     ///< whose digest is held in the second place, unless all are …
  std::uint32_t restored_ = kNone;      ///< … and in the first
  std::uint32_t featured_b_ = kNone;    ///< whose features features_b_ holds
  std::uint32_t kept_b_ = kNone;        ///< whose turned spectra the matcher keeps
  std::uint32_t classified_b_ = kNone;  ///< whose classes the verifier holds
  std::uint32_t classified_a_ = kNone;  ///< likewise, of the comparison under way
  Features features_a_;                 ///< while they are cached, those under way
  Features features_b_;
  std::size_t verify_next_ = 0;
  CompareEnd end_ = CompareEnd::compared;
  PlaceHypotheses hypotheses_;
};

/// Inserts by falling rank; the worst drops out when full.
void insert_by_rank(PlaceHypotheses& list, const PlaceHypothesis& hypothesis);

}  // namespace mellin
