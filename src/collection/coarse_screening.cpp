#include "mellin/collection/coarse_screening.hpp"

#include <algorithm>

#include "mellin/grid/image.hpp"

namespace mellin {
namespace {

void set_bit(Span<std::uint8_t> mask, std::size_t i) {
  mask[i / 8] = static_cast<std::uint8_t>(mask[i / 8] | (1U << (i % 8)));
}

void halve_masks(const DigestView& digest, const DigestOut& out) {
  std::fill(out.observed.begin(), out.observed.end(), std::uint8_t{0});
  std::fill(out.free.begin(), out.free.end(), std::uint8_t{0});
  const std::size_t side = digest.side;
  for (std::size_t row = 0; row < out.side; ++row) {
    for (std::size_t column = 0; column < out.side; ++column) {
      unsigned observed = 0;
      unsigned free = 0;
      for (const std::size_t offset : {std::size_t{0}, std::size_t{1}, side, side + 1}) {
        const std::size_t i = 2 * row * side + 2 * column + offset;
        observed += mask_bit(digest.observed, i) ? 1U : 0U;
        free += mask_bit(digest.free, i) ? 1U : 0U;
      }
      if (observed >= 2) {
        const std::size_t i = row * out.side + column;
        set_bit(out.observed, i);
        if (free == observed) {
          set_bit(out.free, i);
        }
      }
    }
  }
}

}  // namespace

Status halve_digest(const DigestView& digest, Span<float> scratch, const DigestOut& out) {
  const std::size_t pixels = std::size_t{digest.side} * digest.side;
  const std::size_t coarse_pixels = std::size_t{out.side} * out.side;
  const bool valid = digest.side > 0 && digest.side == 2 * out.side && digest.obstacles.size() == pixels &&
                     digest.observed.size() == mask_bytes(digest.side) &&
                     digest.free.size() == mask_bytes(digest.side) && out.obstacles.size() == coarse_pixels &&
                     out.observed.size() == mask_bytes(out.side) && out.free.size() == mask_bytes(out.side) &&
                     scratch.size() >= pixels;
  if (!valid) {
    return Status::invalid_argument;
  }
  for (std::size_t i = 0; i < pixels; ++i) {
    scratch[i] = static_cast<float>(digest.obstacles[i]);
  }
  const ImageView coarse{scratch.first(coarse_pixels), out.side};
  const Status halved = thicken_and_halve({scratch.first(pixels), digest.side}, coarse, 0, out.side);
  if (halved != Status::ok) {
    return halved;
  }
  (void)normalise(coarse);
  for (std::size_t i = 0; i < coarse_pixels; ++i) {
    out.obstacles[i] = static_cast<std::uint8_t>(std::min(255.0F, 255.0F * scratch[i] + 0.5F));
  }
  halve_masks(digest, out);
  return Status::ok;
}

Status CoarseScreening::init(const CoarseScreeningConfig& config, const Memory& memory) {
  config_ = config;
  memory_ = memory;
  stage_ = Stage::idle;
  query_ = kNone;
  if (!enabled()) {
    return Status::ok;
  }
  cache_ = FeatureCache(config.matcher, memory.features);
  verifier_ = DigestVerifier(config.verification, memory.verifier);
  return matcher_.init(config.matcher, memory.matcher);
}

DigestOut CoarseScreening::digest_out(std::uint32_t slot) const {
  const std::uint16_t side = config_.matcher.side;
  const std::size_t pixels = std::size_t{side} * side;
  const Span<std::uint8_t> bytes = memory_.digests.subspan(slot * digest_size(side), digest_size(side));
  return {bytes.first(pixels), bytes.subspan(pixels, mask_bytes(side)),
          bytes.subspan(pixels + mask_bytes(side), mask_bytes(side)), side};
}

Status CoarseScreening::begin_describe(std::uint32_t slot, const DigestView& digest, Span<float> scratch) {
  stage_ = Stage::idle;
  if (slot >= config_.slots) {
    return Status::invalid_argument;
  }
  query_ = slot == query_ ? kNone : query_;
  const DigestOut out = digest_out(slot);
  Status status = halve_digest(digest, scratch, out);
  if (status == Status::ok) {
    a_ = slot;
    features_ = cache_.at(slot);
    status = matcher_.begin_extract(out.obstacles, features_, out.observed);
    stage_ = status == Status::ok ? Stage::describe : Stage::idle;
  }
  return status;
}

Status CoarseScreening::begin_compare(std::uint32_t a, std::uint32_t b) {
  stage_ = Stage::idle;
  best_ = PlaceHypothesis();
  if (a >= config_.slots || b >= config_.slots) {
    return Status::invalid_argument;
  }
  a_ = a;
  b_ = b;
  const Features query = cache_.at(b);
  const bool known = query_ == b;
  if (!known) {
    matcher_.keep_turned(query);
    verifier_.set_b(digest_out(b).view(config_.matcher.pixel_m));
    query_ = b;
  }
  const Status begun = matcher_.begin_match(cache_.at(a), query);
  stage_ = begun == Status::ok ? Stage::match : Stage::idle;
  return begun;
}

bool CoarseScreening::step() {
  if (stage_ == Stage::idle || !matcher_.step()) {
    return stage_ == Stage::idle;
  }
  if (stage_ == Stage::describe) {
    cache_.keep(a_, features_);
  } else {
    verify_all();
  }
  stage_ = Stage::idle;
  return true;
}

void CoarseScreening::verify_all() {
  if (matcher_.hypotheses().empty()) {
    return;
  }
  verifier_.set_a(digest_out(a_).view(config_.matcher.pixel_m));
  for (const Hypothesis& hypothesis : matcher_.hypotheses()) {
    const float agreement = verifier_.agreement(hypothesis.a_T_b);
    if (agreement > best_.agreement || best_.peak == 0.0F) {
      best_.a_T_b = hypothesis.a_T_b;
      best_.peak = hypothesis.peak;
      best_.agreement = agreement;
    }
  }
}

}  // namespace mellin
