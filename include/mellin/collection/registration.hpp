// Registration of two submaps from their full grids (paper, Sections IV and V-B): Fourier-Mellin at a fine scale, each
// hypothesis verified, the best ones aligned on the likelihood field and verified again.
#pragma once

#include <cstdint>

#include "mellin/collection/place_matcher.hpp"
#include "mellin/core/arena.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/alignment.hpp"
#include "mellin/spectral/confidence.hpp"
#include "mellin/spectral/matcher.hpp"
#include "mellin/spectral/verification.hpp"

namespace mellin {

/// Registration asks what was observed of several translation peaks; they cost little beside the transforms.
constexpr MatcherConfig registration_matcher() {
  MatcherConfig config;
  config.translation_peaks = 4;
  return config;
}

struct RegistrationConfig {
  std::uint16_t grid_side = 768;  ///< of the submaps
  MatcherConfig matcher =
      registration_matcher();  ///< its side is the scale of registration: grid_side over a power of two
  VerificationConfig verification;
  std::uint16_t class_side = 192;  ///< cells of the grids that are compared; divides grid_side
  AlignmentConfig alignment;
  std::uint8_t aligned = 2;    ///< hypotheses that are aligned, best first: 1 to kMaxPlaceHypotheses …
  float aligned_share = 0.6F;  ///< … as long as they agree at least this share as well as the best one …
  float aligned_from = 0.1F;   ///< … and at least so well
  ConfidenceModel confidence;
};

/// Whether at most one of two poses of b in a can be right: they differ by 1 m or 0.2 rad at least.
bool exclude_each_other(const Pose2& p, const Pose2& q);

/// What speaks for hypothesis `i` of a registration's, the best of the others as its rival.
PoseEvidence evidence_of(const PlaceHypotheses& hypotheses, std::size_t i);

class SpectralRegistration final : public GridMatcher {
 public:
  struct Memory {
    Matcher::Memory matcher;
    Features features_a;
    Features features_b;
    DigestOut picture;
    Span<std::uint8_t> classes_a;
    Span<std::uint8_t> classes_b;
    Alignment::Memory alignment;
    Span<float> scratch;  ///< for making pictures
  };
  static constexpr AlignmentConfig alignment_config(const RegistrationConfig& config) {
    AlignmentConfig alignment = config.alignment;
    alignment.max_side = config.grid_side;
    return alignment;
  }
  template <class A>
  static constexpr Memory carve(A& arena, const RegistrationConfig& config) {
    return carve(arena, arena, config);
  }
  /// `work` is needed from set_query() to the end of the last registration of that query, and may be lent to others
  /// before and after.
  template <class A, class W>
  static constexpr Memory carve(A& tables, W& work, const RegistrationConfig& config) {
    const std::uint16_t side = config.matcher.side;
    const std::size_t classes = std::size_t{config.class_side} * config.class_side;
    Memory m;
    m.matcher = Matcher::carve(tables, work, config.matcher);
    m.features_a = Features::carve(work, config.matcher, FeatureUse::as_a);
    m.features_b = Features::carve(work, config.matcher, FeatureUse::as_b);
    m.picture.obstacles = work.template take<std::uint8_t>(std::size_t{side} * side, Part::spectral);
    m.picture.observed = work.template take<std::uint8_t>(mask_bytes(side), Part::spectral);
    m.picture.side = side;
    m.classes_a = work.template take<std::uint8_t>(classes, Part::spectral);
    m.classes_b = work.template take<std::uint8_t>(classes, Part::spectral);
    carve_in_turn(work, config, m);
    return m;
  }

  Status init(const RegistrationConfig& config, const Memory& memory);
  Status set_query(const GridView& b) override;
  Status begin(const GridView& a) override;
  bool step() override;
  const PlaceHypotheses& hypotheses() const override { return hypotheses_; }

 private:
  static constexpr std::size_t scratch_size(const RegistrationConfig& config) {
    return DigestMaker::scratch_size(config.grid_side, config.matcher.side, config.matcher.preprocessing);
  }
  /// Pictures are made before anything is aligned; only what alignment keeps from pair to pair stands in the way.
  template <class W>
  static constexpr void carve_in_turn(W& work, const RegistrationConfig& config, Memory& m) {
    const AlignmentConfig alignment = alignment_config(config);
    const std::size_t scratch = scratch_size(config);
    if (alignment.keep_both) {
      m.alignment = Alignment::carve(work, alignment);
      m.scratch = work.template take<float>(scratch, Part::spectral);
      return;
    }
    const auto take_scratch = [&](auto& arena) { return arena.template take<float>(scratch, Part::spectral); };
    const auto take_alignment = [&](auto& arena) { return Alignment::carve(arena, alignment); };
    const auto block = work.take_workspace(larger(measured(take_scratch), measured(take_alignment)));
    auto first = work.over(block);
    m.scratch = take_scratch(first);
    auto second = work.over(block);
    m.alignment = take_alignment(second);
  }

  enum class Stage : std::uint8_t {
    idle,
    picture_b,
    extract_b,
    classify_b,
    picture_a,
    extract_a,
    match,
    classify_a,
    verify,
    align,
  };

  /// A hypothesis of the matcher, verified.
  struct Candidate {
    Pose2 a_T_b;
    float peak = 0.0F;
    float agreement = 0.0F;
    float rank = 0.0F;
  };

  bool begin_picture(const GridView& grid, Stage stage);
  void begin_extract(Features& out, Stage stage);
  void classify_query();
  void classify_other();
  void verify_candidate();
  Candidate unwrapped(const Hypothesis& hypothesis) const;
  void insert_candidate(const Candidate& candidate);
  void begin_alignment();
  void finish_alignment();
  void judge_hypotheses();

  RegistrationConfig config_;
  Memory memory_;
  Matcher matcher_;
  DigestMaker maker_;
  Alignment alignment_;
  Stage stage_ = Stage::idle;
  GridView a_;
  GridView b_;
  bool query_ready_ = false;  ///< features and classes of b_ are made
  ClassView class_a_;
  ClassView class_b_;
  std::size_t next_ = 0;
  FixedList<Candidate, kMaxPlaceHypotheses> candidates_;  ///< best rank first
  PlaceHypotheses hypotheses_;
};

}  // namespace mellin
