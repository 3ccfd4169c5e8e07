// First stage of the screening cascade: digests of half the side, made of the held ones, tell at a quarter of the cost
// which pairs are not worth more (paper, Section V-A compares the scales).
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/collection/digest_verifier.hpp"
#include "mellin/collection/feature_cache.hpp"
#include "mellin/collection/place_matcher.hpp"
#include "mellin/core/arena.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/matcher.hpp"
#include "mellin/spectral/verification.hpp"

namespace mellin {

struct CoarseScreeningConfig {
  MatcherConfig matcher;  ///< its side is half of the digests'; its max_peaks are all tried
  VerificationConfig verification = kDigestVerification;
  std::uint32_t slots = 0;  ///< digests that are kept; 0: there is no coarse stage
};

class CoarseScreening {
 public:
  struct Memory {
    Matcher::Memory matcher;
    FeatureCache::Memory features;
    Span<std::uint8_t> digests;  ///< slot by slot: obstacles, observed mask, free mask
    DigestVerifier::Memory verifier;
  };
  static constexpr std::size_t digest_size(std::uint16_t side) {
    return std::size_t{side} * side + 2 * mask_bytes(side);
  }
  /// What is kept comes from `kept`, what is needed while a query is compared from `work`.
  template <class A, class W>
  static constexpr Memory carve(A& kept, W& work, const CoarseScreeningConfig& config) {
    Memory m;
    if (config.slots > 0) {
      m.matcher = Matcher::carve(kept, work, config.matcher);
      m.features = FeatureCache::carve(kept, config.matcher, config.slots);
      m.digests = kept.template take<std::uint8_t>(config.slots * digest_size(config.matcher.side), Part::digests);
      m.verifier = DigestVerifier::carve(work, config.matcher.side);
    }
    return m;
  }
  /// Floats that begin_describe() needs.
  static constexpr std::size_t scratch_size(const CoarseScreeningConfig& config) {
    return config.slots > 0 ? std::size_t{4} * config.matcher.side * config.matcher.side : 0;
  }

  /// Statuses of Matcher::init(). Nothing to do without slots.
  Status init(const CoarseScreeningConfig& config, const Memory& memory);
  bool enabled() const { return config_.slots > 0; }

  /// Starts to describe a digest with both masks, which may go when this returns. One pass over it; scratch memory
  /// until it returns. invalid_argument: sizes do not hold, slot out of range.
  Status begin_describe(std::uint32_t slot, const DigestView& digest, Span<float> scratch);
  /// Starts to compare two described ones. degenerate: one has nothing to compare, step() is true at once.
  Status begin_compare(std::uint32_t a, std::uint32_t b);
  /// One slice; true when the job is done.
  bool step();
  /// Of the comparison: the hypothesis that agrees best; agreement and peak 0 where there is none.
  const PlaceHypothesis& best() const { return best_; }
  /// Lets go of what is kept of the query: its slot is going to be described anew.
  void forget_query() { query_ = kNone; }

 private:
  enum class Stage : std::uint8_t { idle, describe, match };
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  DigestOut digest_out(std::uint32_t slot) const;
  void verify_all();

  CoarseScreeningConfig config_;
  Memory memory_;
  Matcher matcher_;
  FeatureCache cache_;
  DigestVerifier verifier_;
  Stage stage_ = Stage::idle;
  std::uint32_t a_ = 0;
  std::uint32_t b_ = 0;
  std::uint32_t query_ = kNone;  ///< whose turned spectra the matcher and whose classes the verifier keep
  Features features_;            ///< under way
  PlaceHypothesis best_;
};

/// Of a digest with both masks, one of half the side (out, with both masks): obstacles thickened, halved and normalised
/// as the digest's own were; a pixel is observed where two of four are, and free where besides none holds an obstacle.
/// `scratch` holds at least side * side floats. invalid_argument: sizes do not hold. One pass over the pixels.
Status halve_digest(const DigestView& digest, Span<float> scratch, const DigestOut& out);

}  // namespace mellin
