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

Status SpectralScreening::init(const ScreeningConfig& config, const Memory& memory, Span<float> scratch) {
  config_ = config;
  memory_ = memory;
  scratch_ = scratch;
  std::uint32_t side = config.grid_side;
  while (side > config.matcher.side && side % 2 == 0) {
    side /= 2;
  }
  if (side != config.matcher.side || config.max_submaps == 0) {
    return Status::invalid_config;
  }
  if (scratch.size() < scratch_size(config)) {
    return Status::insufficient_memory;
  }
  return matcher_.init(config.matcher, memory.matcher);
}

DigestOut SpectralScreening::digest_out(std::uint32_t index) const {
  const std::uint16_t side = config_.matcher.side;
  const std::size_t pixels = std::size_t{side} * side;
  const Span<std::uint8_t> bytes = memory_.digests.subspan(index * digest_size(side), digest_size(side));
  DigestOut out;
  out.obstacles = bytes.first(pixels);
  out.observed = bytes.subspan(pixels, mask_bytes(side));
  out.free = bytes.subspan(pixels + mask_bytes(side), mask_bytes(side));
  out.side = side;
  return out;
}

Span<const std::uint8_t> SpectralScreening::digest_bytes(std::uint32_t index) const {
  const std::size_t size = digest_size(config_.matcher.side);
  return memory_.digests.subspan(index * size, size);
}

DigestView SpectralScreening::digest(std::uint32_t index) const {
  return digest_out(index).view(config_.matcher.pixel_m);
}

Features SpectralScreening::features(std::size_t slot) const {
  const std::uint16_t side = config_.matcher.side;
  Features f;
  f.image = memory_.images.subspan(slot * Features::image_count(side), Features::image_count(side));
  f.filter = memory_.filters.subspan(slot * Features::filter_count(side), Features::filter_count(side));
  f.rings = memory_.rings.subspan(slot * Features::rings_count(side), Features::rings_count(side));
  f.floor = memory_.floors[slot];
  f.ready = memory_.ready[slot] != 0;
  return f;
}

void SpectralScreening::begin_features(std::uint32_t index, std::size_t slot, Stage stage) {
  working_ = features(slot);
  working_.ready = false;
  stage_ = matcher_.begin_extract(digest_out(index).obstacles, working_) == Status::ok ? stage : Stage::idle;
}

void SpectralScreening::keep_features(std::size_t slot) {
  memory_.floors[slot] = working_.floor;
  memory_.ready[slot] = working_.ready ? 1 : 0;
}

Status SpectralScreening::begin_describe(std::uint32_t index, const GridView& grid) {
  if (index >= config_.max_submaps) {
    return Status::invalid_argument;
  }
  a_ = index;
  classified_b_ = 0xFFFFFFFFU;
  const Status status = maker_.begin(grid, scratch_, digest_out(index));
  stage_ = status == Status::ok ? Stage::digest : Stage::idle;
  return status;
}

Status SpectralScreening::begin_restore(std::uint32_t index, Span<const std::uint8_t> digest) {
  const std::size_t size = digest_size(config_.matcher.side);
  if (index >= config_.max_submaps || digest.size() != size) {
    return Status::invalid_argument;
  }
  std::memcpy(memory_.digests.data() + index * size, digest.data(), size);
  a_ = index;
  classified_b_ = 0xFFFFFFFFU;
  stage_ = Stage::idle;
  if (config_.cache_features) {
    begin_features(index, index, Stage::features);
  }
  return Status::ok;
}

Status SpectralScreening::begin_compare(std::uint32_t a, std::uint32_t b) {
  hypotheses_.clear();
  stage_ = Stage::idle;
  if (a >= config_.max_submaps || b >= config_.max_submaps) {
    return Status::invalid_argument;
  }
  a_ = a;
  b_ = b;
  if (config_.cache_features) {
    begin_match();
  } else {
    begin_features(b, 1, Stage::extract_b);
  }
  return stage_ == Stage::idle ? Status::degenerate : Status::ok;
}

void SpectralScreening::begin_match() {
  const Features fa = features(config_.cache_features ? a_ : 0);
  const Features fb = features(config_.cache_features ? b_ : 1);
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
          begin_features(a_, a_, Stage::features);
        }
      }
      break;
    case Stage::features:
      if (matcher_.step()) {
        keep_features(a_);
        stage_ = Stage::idle;
      }
      break;
    case Stage::extract_b:
      if (matcher_.step()) {
        keep_features(1);
        begin_features(a_, 0, Stage::extract_a);
      }
      break;
    case Stage::extract_a:
      if (matcher_.step()) {
        keep_features(0);
        begin_match();
      }
      break;
    case Stage::match:
      if (matcher_.step()) {
        class_a_ = classes(a_, memory_.classes_a);
        if (classified_b_ != b_) {
          class_b_ = classes(b_, memory_.classes_b);
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

ClassView SpectralScreening::classes(std::uint32_t index, Span<std::uint8_t> out) {
  const Result<ClassView> view = classify(digest(index), config_.verification, out);
  return view.ok() ? view.value() : ClassView{};
}

void SpectralScreening::verify_one() {
  const HypothesisList& found = matcher_.hypotheses();
  const Hypothesis& h = found[verify_next_];
  const Result<Agreement> agreement = verify(class_a_, class_b_, h.a_T_b, config_.verification);
  PlaceHypothesis out;
  out.a_T_b = h.a_T_b;
  out.peak = h.peak;
  if (agreement.ok()) {
    out.agreement = agreement.value().score;
    out.overlap = agreement.value().overlap;
  }
  insert_by_agreement(hypotheses_, out);
  ++verify_next_;
  if (verify_next_ >= found.size() || verify_next_ >= config_.verified) {
    stage_ = Stage::idle;
  }
}

}  // namespace mellin
