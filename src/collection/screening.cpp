#include "mellin/collection/screening.hpp"

#include <cstring>

namespace mellin {
namespace {

constexpr std::size_t kLinesPerStep = 32;

}  // namespace

void insert_by_agreement(PlaceHypotheses& list, const PlaceHypothesis& hypothesis) {
  std::size_t at = 0;
  while (at < list.size() && (list[at].agreement > hypothesis.agreement ||
                              (list[at].agreement == hypothesis.agreement && list[at].peak >= hypothesis.peak))) {
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
  if (side != config.matcher.side || config.max_submaps == 0 || (config.cache_features && !config.hold_digests)) {
    return Status::invalid_config;
  }
  const std::size_t held = config.hold_digests ? config.max_submaps : 2;
  if (memory.scratch.size() < scratch_size(config) || memory.digests.size() < held * digest_size(config.matcher.side)) {
    return Status::insufficient_memory;
  }
  return matcher_.init(config.matcher, memory.matcher);
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

Features SpectralScreening::cached_features(std::uint32_t index) const {
  const std::size_t slot = index;
  Features f;
  f.image =
      memory_.images.subspan(slot * Features::image_count(config_.matcher), Features::image_count(config_.matcher));
  f.filter =
      memory_.filters.subspan(slot * Features::filter_count(config_.matcher), Features::filter_count(config_.matcher));
  const std::size_t polar = Features::polar_count(config_.matcher);
  f.polar = memory_.polar.subspan(slot * polar, polar);
  f.floor = memory_.floors[slot];
  f.curvature = memory_.curvatures[slot];
  f.ready = memory_.ready[slot] != 0;
  return f;
}

void SpectralScreening::begin_features(std::uint32_t index, Features& out, Stage stage) {
  const DigestOut digest = digest_out(index);
  stage_ = matcher_.begin_extract(digest.obstacles, out, digest.observed) == Status::ok ? stage : Stage::idle;
}

void SpectralScreening::begin_caching(std::uint32_t index) {
  features_a_ = cached_features(index);
  begin_features(index, features_a_, Stage::features);
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

Status SpectralScreening::begin_compare(std::uint32_t a, std::uint32_t b) {
  hypotheses_.clear();
  stage_ = Stage::idle;
  if (!holds(a) || !holds(b)) {
    return Status::invalid_argument;
  }
  a_ = a;
  b_ = b;
  if (config_.cache_features) {
    begin_match();
  } else if (featured_b_ == b) {
    begin_features(a, features_a_, Stage::extract_a);
  } else {
    begin_features(b, features_b_, Stage::extract_b);
  }
  return stage_ == Stage::idle ? Status::degenerate : Status::ok;
}

void SpectralScreening::begin_match() {
  const bool cached = config_.cache_features;
  const Features fa = cached ? cached_features(a_) : features_a_;
  const Features fb = cached ? cached_features(b_) : features_b_;
  if (kept_b_ != b_) {
    matcher_.keep_turned(fb);
    kept_b_ = b_;
  }
  stage_ = matcher_.begin_match(fa, fb) == Status::ok ? Stage::match : Stage::idle;
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
        memory_.floors[a_] = features_a_.floor;
        memory_.curvatures[a_] = features_a_.curvature;
        memory_.ready[a_] = features_a_.ready ? 1 : 0;
        stage_ = Stage::idle;
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
        class_a_ = classes(a_, memory_.classes_a, memory_.obstacles_a);
        if (classified_b_ != b_) {
          class_b_ = classes(b_, memory_.classes_b, memory_.obstacles_b);
          classified_b_ = b_;
        }
        verify_next_ = 0;
        stage_ = matcher_.hypotheses().empty() ? Stage::idle : Stage::verify;
      }
      break;
    case Stage::verify:
      verify_one();
      break;
  }
  return stage_ == Stage::idle;
}

ClassObstacles SpectralScreening::classes(std::uint32_t index, Span<std::uint8_t> out, Span<ClassCell> cells) {
  const Result<ClassView> view = classify(digest_out(index).view(config_.matcher.pixel_m), config_.verification, out);
  if (!view.ok()) {
    return {};
  }
  const Result<Span<const ClassCell>> found = obstacles(view.value(), cells);
  return {view.value(), found.ok() ? found.value() : Span<const ClassCell>()};
}

void SpectralScreening::verify_one() {
  const HypothesisList& found = matcher_.hypotheses();
  const Hypothesis& h = found[verify_next_];
  const Result<Agreement> agreement = verify_obstacles(class_a_, class_b_, h.a_T_b, config_.verification);
  PlaceHypothesis out;
  out.a_T_b = h.a_T_b;
  out.peak = h.peak;
  if (agreement.ok()) {
    out.agreement = agreement.value().score;
  }
  insert_by_agreement(hypotheses_, out);
  ++verify_next_;
  if (verify_next_ >= found.size() || verify_next_ >= config_.verified) {
    stage_ = Stage::idle;
  }
}

}  // namespace mellin
