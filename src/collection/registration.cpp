#include "mellin/collection/registration.hpp"

#include "mellin/collection/screening.hpp"

namespace mellin {
namespace {

constexpr std::size_t kLinesPerStep = 32;

/// Alignment that moved a hypothesis farther than this has found something else.
constexpr double kSameDistance_m = 0.3;
constexpr double kSameAngle_rad = 0.05;

bool same_place(const Pose2& p, const Pose2& q) {
  const Pose2 off = between(p, q);
  return translation(off) < kSameDistance_m && off.theta < kSameAngle_rad && off.theta > -kSameAngle_rad;
}

}  // namespace

Status SpectralRegistration::init(const RegistrationConfig& config, const Memory& memory) {
  config_ = config;
  memory_ = memory;
  if (config.aligned < 1 || config.aligned > kMaxPlaceHypotheses || config.class_side == 0 ||
      config.grid_side % config.class_side != 0 || !(config.aligned_share >= 0.0F) || !(config.aligned_share <= 1.0F)) {
    return Status::invalid_config;
  }
  if (memory.scratch.size() < scratch_size(config)) {
    return Status::insufficient_memory;
  }
  const Status matcher = matcher_.init(config.matcher, memory.matcher);
  return matcher != Status::ok ? matcher : alignment_.init(alignment_config(config), memory.alignment);
}

Status SpectralRegistration::set_query(const GridView& b) {
  hypotheses_.clear();
  stage_ = Stage::idle;
  query_ready_ = false;
  const bool valid = b.side == config_.grid_side && alignment_.set_b(b) == Status::ok;
  b_ = valid ? b : GridView{};
  return valid ? Status::ok : Status::invalid_argument;
}

Status SpectralRegistration::begin(const GridView& a) {
  hypotheses_.clear();
  candidates_.clear();
  stage_ = Stage::idle;
  if (b_.side == 0 || a.side != config_.grid_side || alignment_.set_a(a) != Status::ok) {
    return Status::invalid_argument;
  }
  a_ = a;
  const bool begun = query_ready_ ? begin_picture(a_, Stage::picture_a) : begin_picture(b_, Stage::picture_b);
  return begun ? Status::ok : Status::invalid_argument;
}

bool SpectralRegistration::begin_picture(const GridView& grid, Stage stage) {
  stage_ = maker_.begin(grid, memory_.scratch, memory_.picture, config_.matcher.preprocessing) == Status::ok
               ? stage
               : Stage::idle;
  return stage_ != Stage::idle;
}

void SpectralRegistration::begin_extract(Features& out, Stage stage) {
  stage_ = matcher_.begin_extract(memory_.picture.obstacles, memory_.picture.observed, out) == Status::ok ? stage : Stage::idle;
}

bool SpectralRegistration::step() {
  switch (stage_) {
    case Stage::idle:
      return true;
    case Stage::picture_b:
      if (maker_.step(kLinesPerStep)) {
        begin_extract(memory_.features_b, Stage::extract_b);
      }
      break;
    case Stage::extract_b:
      if (matcher_.step()) {
        stage_ = Stage::classify_b;
      }
      break;
    case Stage::classify_b:
      classify_query();
      break;
    case Stage::picture_a:
      if (maker_.step(kLinesPerStep)) {
        begin_extract(memory_.features_a, Stage::extract_a);
      }
      break;
    case Stage::extract_a:
      if (matcher_.step()) {
        stage_ =
            matcher_.begin_match(memory_.features_a, memory_.features_b) == Status::ok ? Stage::match : Stage::idle;
      }
      break;
    case Stage::match:
      if (matcher_.step()) {
        stage_ = matcher_.hypotheses().empty() ? Stage::idle : Stage::classify_a;
      }
      break;
    case Stage::classify_a:
      classify_other();
      break;
    case Stage::verify:
      verify_candidate();
      break;
    case Stage::align:
      if (!alignment_.step()) {
        finish_alignment();
      }
      break;
  }
  return stage_ == Stage::idle;
}

void SpectralRegistration::classify_query() {
  const Result<ClassView> classes = classify(b_, config_.verification, config_.class_side, memory_.classes_b);
  query_ready_ = classes.ok();
  class_b_ = classes.ok() ? classes.value() : ClassView{};
  if (query_ready_) {
    (void)begin_picture(a_, Stage::picture_a);
  } else {
    stage_ = Stage::idle;
  }
}

void SpectralRegistration::classify_other() {
  const Result<ClassView> classes = classify(a_, config_.verification, config_.class_side, memory_.classes_a);
  class_a_ = classes.ok() ? classes.value() : ClassView{};
  next_ = 0;
  stage_ = classes.ok() ? Stage::verify : Stage::idle;
}

void SpectralRegistration::verify_candidate() {
  const Hypothesis& h = matcher_.hypotheses()[next_];
  const Result<Agreement> agreement = verify(class_a_, class_b_, h.a_T_b, config_.verification);
  if (agreement.ok()) {
    PlaceHypothesis candidate;
    candidate.a_T_b = h.a_T_b;
    candidate.peak = h.peak;
    candidate.agreement = agreement.value().score;
    candidate.overlap = agreement.value().overlap;
    insert_by_agreement(candidates_, candidate);
  }
  ++next_;
  if (next_ >= matcher_.hypotheses().size()) {
    next_ = 0;
    begin_alignment();
  }
}

void SpectralRegistration::begin_alignment() {
  stage_ = Stage::idle;
  if (next_ >= candidates_.size() || next_ >= config_.aligned) {
    return;
  }
  const float agreement = candidates_[next_].agreement;
  if (agreement >= config_.aligned_from && agreement >= config_.aligned_share * candidates_[0].agreement &&
      alignment_.begin(candidates_[next_].a_T_b) == Status::ok) {
    stage_ = Stage::align;
  }
}

void SpectralRegistration::finish_alignment() {
  PlaceHypothesis candidate = candidates_[next_];
  ++next_;
  const Result<AlignmentResult> aligned = alignment_.result();
  if (aligned.ok()) {
    const AlignmentResult& r = aligned.value();
    bool known = false;
    for (const PlaceHypothesis& other : hypotheses_) {
      known |= same_place(other.a_T_b, r.a_T_b);
    }
    const Result<Agreement> agreement = verify(class_a_, class_b_, r.a_T_b, config_.verification);
    Sym3 in_b;
    if (!known && agreement.ok() && invert(r.information + diagonal(1e-6, 1e-6, 1e-6), in_b)) {
      candidate.a_T_b = r.a_T_b;
      candidate.covariance = rotate(in_b, r.a_T_b.theta);
      candidate.inlier_share = r.inlier_share;
      candidate.agreement = agreement.value().score * r.inlier_share;
      candidate.overlap = agreement.value().overlap;
      insert_by_agreement(hypotheses_, candidate);
    }
  }
  begin_alignment();
}

}  // namespace mellin
