#include "mellin/collection/registration.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mellin/collection/screening.hpp"

namespace mellin {
namespace {

constexpr std::size_t kLinesPerStep = 32;

/// Alignment that moved a hypothesis farther than this has found something else.
constexpr double kSameDistance_m = 0.3;
constexpr double kSameAngle_rad = 0.05;

/// Hypotheses that differ by this are rivals: at most one can be right.
constexpr double kElsewhere_m = 1.0;
constexpr double kElsewhere_rad = 0.2;

/// Share of the grids' side: at larger shifts they hardly overlap.
constexpr double kFarthestShift = 0.75;

bool same_place(const Pose2& p, const Pose2& q) {
  const Pose2 off = between(p, q);
  return translation(off) < kSameDistance_m && off.theta < kSameAngle_rad && off.theta > -kSameAngle_rad;
}

}  // namespace

bool exclude_each_other(const Pose2& p, const Pose2& q) {
  const Pose2 off = between(p, q);
  return translation(off) >= kElsewhere_m || std::fabs(off.theta) >= kElsewhere_rad;
}

PoseEvidence evidence_of(const PlaceHypotheses& hypotheses, std::size_t i) {
  const PlaceHypothesis& place = hypotheses[i];
  PoseEvidence evidence;
  evidence.agreement = place.inlier_share > 0.0F ? place.agreement / place.inlier_share : 0.0F;
  evidence.inlier_share = place.inlier_share;
  evidence.overlap = place.overlap;
  evidence.peak = place.peak;
  for (const PlaceHypothesis& other : hypotheses) {
    if (exclude_each_other(place.a_T_b, other.a_T_b)) {
      evidence.rival_strength = std::max(evidence.rival_strength, other.agreement);
      evidence.rival_peak = std::max(evidence.rival_peak, other.peak);
    }
  }
  return evidence;
}

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
  stage_ = matcher_.begin_extract(memory_.picture.obstacles, out, memory_.picture.observed) == Status::ok ? stage
                                                                                                          : Stage::idle;
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

/// The surface that a peak lies on is cyclic: a large shift may as well be one the other way. What was observed
/// decides.
SpectralRegistration::Candidate SpectralRegistration::unwrapped(const Hypothesis& hypothesis) const {
  const Pose2& p = hypothesis.a_T_b;
  const double period = static_cast<double>(b_.cell_m) * config_.grid_side;
  const double shifts_x[] = {p.x, p.x - std::copysign(period, p.x)};
  const double shifts_y[] = {p.y, p.y - std::copysign(period, p.y)};
  Candidate best{p, hypothesis.peak, -1.0F, 0.0F};
  for (const double x : shifts_x) {
    for (const double y : shifts_y) {
      if (std::fabs(x) > kFarthestShift * period || std::fabs(y) > kFarthestShift * period) {
        continue;
      }
      const Result<Agreement> agreement = verify_obstacles(class_a_, class_b_, {x, y, p.theta}, config_.verification);
      if (agreement.ok() && agreement.value().score > best.agreement) {
        best.a_T_b = {x, y, p.theta};
        best.agreement = agreement.value().score;
      }
    }
  }
  best.rank = rank_of(best.agreement, best.peak);
  return best;
}

void SpectralRegistration::verify_candidate() {
  insert_candidate(unwrapped(matcher_.hypotheses()[next_]));
  ++next_;
  if (next_ >= matcher_.hypotheses().size()) {
    next_ = 0;
    begin_alignment();
  }
}

/// Of candidates that alignment would make one, the best stays.
void SpectralRegistration::insert_candidate(const Candidate& candidate) {
  for (std::size_t i = candidates_.size(); i-- > 0;) {
    if (same_place(candidates_[i].a_T_b, candidate.a_T_b)) {
      if (candidates_[i].rank >= candidate.rank) {
        return;
      }
      candidates_.erase(i);
    }
  }
  std::size_t at = 0;
  while (at < candidates_.size() && candidates_[at].rank >= candidate.rank) {
    ++at;
  }
  candidates_.insert(at, candidate);
}

void SpectralRegistration::begin_alignment() {
  stage_ = Stage::idle;
  if (next_ < candidates_.size() && next_ < config_.aligned) {
    const float agreement = candidates_[next_].agreement;
    if (agreement >= config_.aligned_from && agreement >= config_.aligned_share * candidates_[0].agreement &&
        alignment_.begin(candidates_[next_].a_T_b) == Status::ok) {
      stage_ = Stage::align;
      return;
    }
  }
  judge_hypotheses();
}

void SpectralRegistration::finish_alignment() {
  const Candidate& candidate = candidates_[next_];
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
      PlaceHypothesis place;
      place.a_T_b = r.a_T_b;
      place.covariance = rotate(in_b, r.a_T_b.theta);
      place.peak = candidate.peak;
      place.inlier_share = r.inlier_share;
      place.agreement = agreement.value().score * r.inlier_share;
      place.overlap = agreement.value().overlap;
      insert_by_rank(hypotheses_, place);
    }
  }
  begin_alignment();
}

/// Each hypothesis' confidence, which depends on the others, and their order by it.
void SpectralRegistration::judge_hypotheses() {
  float alone[kMaxPlaceHypotheses] = {};
  for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
    alone[i] = confidence(evidence_of(hypotheses_, i), config_.confidence);
  }
  for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
    float rival_odds = 0.0F;
    for (std::size_t k = 0; k < hypotheses_.size(); ++k) {
      if (exclude_each_other(hypotheses_[i].a_T_b, hypotheses_[k].a_T_b)) {
        rival_odds += odds(alone[k]);
      }
    }
    hypotheses_[i].confidence = beside_rivals(alone[i], rival_odds);
  }
  // By insertion: they are few, and std::stable_sort would ask for a heap.
  for (std::size_t i = 1; i < hypotheses_.size(); ++i) {
    for (std::size_t k = i; k > 0 && hypotheses_[k].confidence > hypotheses_[k - 1].confidence; --k) {
      std::swap(hypotheses_[k], hypotheses_[k - 1]);
    }
  }
}

}  // namespace mellin
