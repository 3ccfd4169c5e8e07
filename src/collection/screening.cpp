#include "mellin/collection/screening.hpp"

#include <cstring>

namespace mellin {
namespace {

constexpr std::size_t kLinesPerStep = 32;

}  // namespace

void insert_by_rank(PlaceHypotheses& list, const PlaceHypothesis& hypothesis) {
  const float rank = rank_of(hypothesis.agreement, hypothesis.peak);
  std::size_t at = 0;
  while (at < list.size() && rank_of(list[at].agreement, list[at].peak) >= rank) {
    ++at;
  }
  list.insert(at, hypothesis);
}

Status SpectralScreening::init(const ScreeningConfig& config, const Memory& memory) {
  config_ = config;
  memory_ = memory;
  features_a_ = memory.features_a;
  features_b_ = memory.features_b;
  std::uint32_t side = config.grid_side;
  while (side > config.matcher.side && side % 2 == 0) {
    side /= 2;
  }
  if (side != config.matcher.side || config.max_submaps == 0 || (config.cache_features && !config.hold_digests) ||
      (config.coarse_peaks > 0 && !config.cache_features) || config.first_peaks == 0) {
    return Status::invalid_config;
  }
  const std::size_t held = config.hold_digests ? config.max_submaps : 2;
  if (memory.scratch.size() < scratch_size(config) || memory.digests.size() < held * digest_size(config.matcher.side)) {
    return Status::insufficient_memory;
  }
  cache_ = FeatureCache(config.matcher, memory.features);
  verifier_ = DigestVerifier(config.verification, memory.verifier);
  const Status coarse = coarse_.init(coarse_config(config), memory.coarse);
  return coarse == Status::ok ? matcher_.init(config.matcher, memory.matcher) : coarse;
}

bool SpectralScreening::holds(std::uint32_t index) const {
  return index < config_.max_submaps && (config_.hold_digests || index == described_ || index == restored_);
}

/// Requires holds(index).
DigestOut SpectralScreening::digest_out(std::uint32_t index) const {
  const std::uint16_t side = config_.matcher.side;
  const std::size_t pixels = std::size_t{side} * side;
  const std::size_t place = config_.hold_digests ? index : (index == described_ ? 1 : 0);
  const Span<std::uint8_t> bytes = memory_.digests.subspan(place * digest_size(side), digest_size(side));
  DigestOut out;
  out.obstacles = bytes.first(pixels);
  out.observed = bytes.subspan(pixels, mask_bytes(side));
  out.free = bytes.subspan(pixels + mask_bytes(side), mask_bytes(side));
  out.side = side;
  return out;
}

Span<const std::uint8_t> SpectralScreening::digest_bytes(std::uint32_t index) const {
  if (!holds(index)) {
    return {};
  }
  return {digest_out(index).obstacles.data(), digest_size(config_.matcher.side)};
}

void SpectralScreening::begin_features(std::uint32_t index, Features& out, Stage stage) {
  const DigestOut digest = digest_out(index);
  stage_ = matcher_.begin_extract(digest.obstacles, out, digest.observed) == Status::ok ? stage : Stage::idle;
}

void SpectralScreening::begin_caching(std::uint32_t index) {
  features_a_ = cache_.at(index);
  begin_features(index, features_a_, Stage::features);
}

void SpectralScreening::begin_describing_coarse() {
  const bool begun = coarse_.enabled() && coarse_.begin_describe(a_, digest_view(a_), memory_.scratch) == Status::ok;
  stage_ = begun ? Stage::describe_coarse : Stage::idle;
}

Status SpectralScreening::begin_describe(std::uint32_t index, const GridView& grid) {
  stage_ = Stage::idle;
  if (index >= config_.max_submaps) {
    return Status::invalid_argument;
  }
  a_ = index;
  featured_b_ = kNone;
  kept_b_ = kNone;
  classified_b_ = kNone;
  coarse_.forget_query();
  described_ = index;
  restored_ = kNone;
  const Status status = maker_.begin(grid, memory_.scratch, digest_out(index), config_.matcher.preprocessing);
  stage_ = status == Status::ok ? Stage::digest : Stage::idle;
  return status;
}

Status SpectralScreening::begin_restore(std::uint32_t index, Span<const std::uint8_t> digest) {
  stage_ = Stage::idle;
  if (index >= config_.max_submaps || digest.size() != digest_size(config_.matcher.side)) {
    return Status::invalid_argument;
  }
  if (index == classified_b_ || index == featured_b_ || index == kept_b_) {
    featured_b_ = kNone;
    kept_b_ = kNone;
    classified_b_ = kNone;
  }
  restored_ = index;
  std::memcpy(digest_out(index).obstacles.data(), digest.data(), digest.size());
  a_ = index;
  if (config_.cache_features) {
    begin_caching(index);
  }
  return Status::ok;
}

Status SpectralScreening::begin_compare(std::uint32_t a, std::uint32_t b, bool thorough) {
  hypotheses_.clear();
  stage_ = Stage::idle;
  if (!holds(a) || !holds(b)) {
    return Status::invalid_argument;
  }
  a_ = a;
  b_ = b;
  thorough_ = thorough;
  end_ = CompareEnd::compared;
  classified_a_ = kNone;
  // Where a coarse digest has lost all structure, the full one decides.
  if (coarse_.enabled() && !thorough && coarse_.begin_compare(a, b) == Status::ok) {
    stage_ = Stage::compare_coarse;
  } else {
    begin_full_comparison();
  }
  return stage_ == Stage::idle ? Status::degenerate : Status::ok;
}

void SpectralScreening::begin_full_comparison() {
  if (config_.cache_features) {
    begin_match();
  } else if (featured_b_ == b_) {
    begin_features(a_, features_a_, Stage::extract_a);
  } else {
    begin_features(b_, features_b_, Stage::extract_b);
  }
}

void SpectralScreening::begin_match() {
  const bool cached = config_.cache_features;
  const Features fa = cached ? cache_.at(a_) : features_a_;
  const Features fb = cached ? cache_.at(b_) : features_b_;
  if (kept_b_ != b_) {
    matcher_.keep_turned(fb);
    kept_b_ = b_;
  }
  const MatchOptions options = {config_.first_peaks, thorough_ ? 0.0F : config_.min_rotation_peak};
  stage_ = matcher_.begin_match(fa, fb, options) == Status::ok ? Stage::match : Stage::idle;
}

bool SpectralScreening::step() {
  switch (stage_) {
    case Stage::idle:
      return true;
    case Stage::digest:
      if (maker_.step(kLinesPerStep)) {
        stage_ = Stage::idle;
        if (config_.cache_features) {
          begin_caching(a_);
        }
      }
      break;
    case Stage::features:
      if (matcher_.step()) {
        cache_.keep(a_, features_a_);
        begin_describing_coarse();
      }
      break;
    case Stage::describe_coarse:
      if (coarse_.step()) {
        stage_ = Stage::idle;
      }
      break;
    case Stage::compare_coarse:
      if (coarse_.step()) {
        finish_coarse();
      }
      break;
    case Stage::extract_b:
      if (matcher_.step()) {
        featured_b_ = b_;
        begin_features(a_, features_a_, Stage::extract_a);
      }
      break;
    case Stage::extract_a:
      if (matcher_.step()) {
        begin_match();
      }
      break;
    case Stage::match:
      if (matcher_.step()) {
        finish_match();
      }
      break;
    case Stage::verify:
      verify_one();
      break;
  }
  return stage_ == Stage::idle;
}

/// What the coarse digests' best hypothesis says is all that is known of a pair that is dropped.
void SpectralScreening::finish_coarse() {
  const PlaceHypothesis& best = coarse_.best();
  if (best.peak < config_.coarse_peak || best.agreement < config_.coarse_agreement) {
    end_ = CompareEnd::coarse;
    hypotheses_.insert(0, best);
    stage_ = Stage::idle;
    return;
  }
  begin_full_comparison();
}

void SpectralScreening::finish_match() {
  verify_next_ = 0;
  if (matcher_.hypotheses().empty()) {
    const bool dropped = hypotheses_.empty() && config_.min_rotation_peak > 0.0F && !thorough_;
    end_ = dropped ? CompareEnd::rotation : end_;
    stage_ = Stage::idle;
    return;
  }
  if (classified_a_ != a_) {
    verifier_.set_a(digest_view(a_));
    classified_a_ = a_;
  }
  if (classified_b_ != b_) {
    verifier_.set_b(digest_view(b_));
    classified_b_ = b_;
  }
  stage_ = Stage::verify;
}

void SpectralScreening::verify_one() {
  const HypothesisList& found = matcher_.hypotheses();
  const Hypothesis& h = found[verify_next_];
  PlaceHypothesis out;
  out.a_T_b = h.a_T_b;
  out.peak = h.peak;
  out.agreement = verifier_.agreement(h.a_T_b);
  insert_by_rank(hypotheses_, out);
  ++verify_next_;
  if (verify_next_ >= found.size() || verify_next_ >= config_.verified ||
      found[verify_next_].peak < config_.verified_share * found[0].peak) {
    finish_verification();
  }
}

/// Further rotations only where the first ones leave hope.
void SpectralScreening::finish_verification() {
  stage_ = Stage::idle;
  if (matcher_.untried_rotations() == 0) {
    return;
  }
  if (!thorough_ && hypotheses_[0].agreement < config_.further_agreement) {
    end_ = CompareEnd::first_peaks;
  } else if (matcher_.begin_further()) {
    stage_ = Stage::match;
  }
}

}  // namespace mellin
