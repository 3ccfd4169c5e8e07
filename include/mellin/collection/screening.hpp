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
  /// Keeps each digest's features (spectra) in RAM, some 8 bytes x side^2 each; without, they are made again for each
  /// comparison, which takes about twice the time.
  bool cache_features = true;
};

class SpectralScreening final : public DigestMatcher {
 public:
  struct Memory {
    Span<std::uint8_t> digests;  ///< submap by submap: obstacles, observed mask, free mask
    Span<float> images;
    Span<Complex> filters;
    Span<Complex> rings;
    Span<float> floors;
    Span<std::uint8_t> ready;
    Matcher::Memory matcher;
    Span<std::uint8_t> classes_a;
    Span<std::uint8_t> classes_b;
  };

  static constexpr std::size_t digest_size(std::uint16_t side) {
    return std::size_t{side} * side + 2 * mask_bytes(side);
  }
  static constexpr std::size_t feature_slots(const ScreeningConfig& config) {
    return config.cache_features ? config.max_submaps : 2;
  }
  template <class A>
  static constexpr Memory carve(A& arena, const ScreeningConfig& config) {
    const std::uint16_t side = config.matcher.side;
    const std::size_t slots = feature_slots(config);
    Memory m;
    m.digests = arena.template take<std::uint8_t>(digest_size(side) * config.max_submaps, Part::digests);
    m.images = arena.template take<float>(slots * Features::image_count(side), Part::digests);
    m.filters = arena.template take<Complex>(slots * Features::filter_count(side), Part::digests);
    m.rings = arena.template take<Complex>(slots * Features::rings_count(side), Part::digests);
    m.floors = arena.template take<float>(slots, Part::digests);
    m.ready = arena.template take<std::uint8_t>(slots, Part::digests);
    m.matcher = Matcher::carve(arena, config.matcher);
    m.classes_a = arena.template take<std::uint8_t>(std::size_t{side} * side, Part::spectral);
    m.classes_b = arena.template take<std::uint8_t>(std::size_t{side} * side, Part::spectral);
    return m;
  }
  /// Floats of scratch that set_scratch() needs; may be shared with jobs that do not run at the same time.
  static constexpr std::size_t scratch_size(const ScreeningConfig& config) {
    return DigestMaker::scratch_size(config.grid_side, config.matcher.side);
  }

  /// invalid_config: the digests' side does not come from the grids' by halving, or the matcher refuses its config.
  Status init(const ScreeningConfig& config, const Memory& memory, Span<float> scratch);

  Status begin_describe(std::uint32_t index, const GridView& grid) override;
  Status begin_restore(std::uint32_t index, Span<const std::uint8_t> digest) override;
  Status begin_compare(std::uint32_t a, std::uint32_t b) override;
  bool step() override;
  const PlaceHypotheses& hypotheses() const override { return hypotheses_; }
  Span<const std::uint8_t> digest_bytes(std::uint32_t index) const override;
  DigestView digest(std::uint32_t index) const;

 private:
  enum class Stage : std::uint8_t { idle, digest, features, extract_a, extract_b, match, verify };

  DigestOut digest_out(std::uint32_t index) const;
  Features features(std::size_t slot) const;
  void begin_features(std::uint32_t index, std::size_t slot, Stage stage);
  void keep_features(std::size_t slot);
  void begin_match();
  ClassView classes(std::uint32_t index, Span<std::uint8_t> out);
  void verify_one();

  ScreeningConfig config_;
  Memory memory_;
  Span<float> scratch_;
  Matcher matcher_;
  DigestMaker maker_;
  Stage stage_ = Stage::idle;
  std::uint32_t a_ = 0;
  std::uint32_t b_ = 0;
  std::uint32_t classified_b_ = 0xFFFFFFFFU;  ///< whose classes classes_b holds
  Features working_;
  std::size_t verify_next_ = 0;
  ClassView class_a_;
  ClassView class_b_;
  PlaceHypotheses hypotheses_;
};

/// Inserts by falling agreement, then peak; the worst drops out when full.
void insert_by_agreement(PlaceHypotheses& list, const PlaceHypothesis& hypothesis);

}  // namespace mellin
