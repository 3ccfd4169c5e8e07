#include "host/eval_matching.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "host/heap_arena.hpp"
#include "host/parallel.hpp"
#include "mellin/core/random.hpp"
#include "mellin/grid/digest.hpp"
#include "mellin/spectral/verification.hpp"

namespace mellin::host {
namespace {

constexpr std::uint16_t kDigestSide = 96;  ///< pictures up to this are verified on their own masks …
constexpr std::uint16_t kClassSide = 192;  ///< … and larger ones on classes of this side
constexpr double kWrong_m = 1e3;
constexpr double kDegrees = 180.0 / kPi;

void require(Status status, const char* what) {
  if (status != Status::ok) {
    throw std::runtime_error(std::string(what) + ": " + to_string(status));
  }
}

/// A submap as the matcher and the verification need it.
struct Described {
  HeapArena memory;
  Features features;
  std::vector<std::uint8_t> class_memory;
  ClassView classes;
  bool wanted = false;  ///< it occurs in a pair
};

/// What one thread works with.
struct Worker {
  HeapArena memory;
  Matcher matcher;
  std::vector<std::uint8_t> picture;
  std::vector<std::uint8_t> observed;
  std::vector<std::uint8_t> free;
  std::vector<float> scratch;
};

template <class T>
Span<T> span(std::vector<T>& v) {
  return {v.data(), v.size()};
}

class PairMatcher {
 public:
  PairMatcher(const std::vector<EvalSubmap>& submaps, const MatchVariant& variant, std::size_t threads)
      : submaps_(submaps), variant_(variant), workers_(std::max<std::size_t>(threads, 1)), described_(submaps.size()) {
    const GridView grid = submaps.front().grid.view();
    MatcherConfig& config = variant_.matcher;
    config.pixel_m = grid.cell_m * static_cast<float>(grid.side) / static_cast<float>(config.side);
    verification_ = config.side <= kDigestSide ? kDigestVerification : VerificationConfig{};
    for (Worker& worker : workers_) {
      require(
          worker.matcher.init(config, worker.memory.carve([&](auto& arena) { return Matcher::carve(arena, config); })),
          "matcher");
      worker.picture.resize(std::size_t{config.side} * config.side);
      worker.observed.resize(mask_bytes(config.side));
      worker.free.resize(mask_bytes(config.side));
      worker.scratch.resize(DigestMaker::scratch_size(grid.side, config.side, config.preprocessing));
    }
  }

  void describe(const std::vector<EvalPair>& pairs) {
    for (const EvalPair& pair : pairs) {
      described_[pair.a].wanted = true;
      described_[pair.b].wanted = true;
    }
    in_parallel(workers_.size(), submaps_.size(), [&](std::size_t worker, std::size_t i) {
      if (described_[i].wanted) {
        describe(workers_[worker], submaps_[i].grid.view(), described_[i]);
      }
    });
  }

  std::vector<FoundPose> match(std::size_t worker, const EvalPair& pair) {
    const Described& a = described_[pair.a];
    const Described& b = described_[pair.b];
    std::vector<FoundPose> found;
    if (!a.features.ready || !b.features.ready) {
      return found;
    }
    Matcher& matcher = workers_[worker].matcher;
    require(matcher.match(a.features, b.features), "match");
    for (const Hypothesis& h : matcher.hypotheses()) {
      FoundPose pose{h.a_T_b, static_cast<double>(h.peak), -1.0};
      if (found.size() < variant_.verified) {
        const Result<Agreement> agreement = verify(a.classes, b.classes, h.a_T_b, verification_);
        require(agreement.status(), "verification");
        pose.agreement = static_cast<double>(agreement.value().score);
      }
      found.push_back(pose);
    }
    return found;
  }

  std::size_t threads() const { return workers_.size(); }

 private:
  void describe(Worker& worker, const GridView& grid, Described& out) const {
    const MatcherConfig& config = variant_.matcher;
    DigestOut digest;
    digest.obstacles = span(worker.picture);
    digest.observed = span(worker.observed);
    digest.free = span(worker.free);
    digest.side = config.side;
    require(make_digest(grid, span(worker.scratch), digest, config.preprocessing), "digest");
    out.features = out.memory.carve([&](auto& arena) { return Features::carve(arena, config); });
    const Status status = worker.matcher.extract(digest.obstacles, out.features, digest.observed);
    if (status != Status::degenerate) {
      require(status, "features");
    }
    const std::uint16_t side = config.side <= kDigestSide ? config.side : std::min(kClassSide, grid.side);
    out.class_memory.resize(std::size_t{side} * side);
    const Result<ClassView> classes = config.side <= kDigestSide
                                          ? classify(digest.view(config.pixel_m), verification_, span(out.class_memory))
                                          : classify(grid, verification_, side, span(out.class_memory));
    require(classes.status(), "classes");
    out.classes = classes.value();
  }

  const std::vector<EvalSubmap>& submaps_;
  MatchVariant variant_;
  VerificationConfig verification_;
  std::vector<Worker> workers_;
  std::vector<Described> described_;
};

/// The indices of the pairs, those of one b in a row: registration makes what is of b alone once.
std::vector<std::vector<std::size_t>> by_query(const std::vector<EvalPair>& pairs, std::size_t submaps) {
  std::vector<std::vector<std::size_t>> groups(submaps);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    groups[pairs[i].b].push_back(i);
  }
  return groups;
}

double degrees_off(double found_rad, double expected_rad) {
  return std::fabs(wrap_angle(found_rad - expected_rad)) * kDegrees;
}

/// Direction of the longer axis of what a submap observed, in its frame, rad; none where neither is longer by half.
bool long_axis(const EvalSubmap& submap, double& angle_rad) {
  const RenderedSubmap& grid = submap.grid;
  double n = 0.0;
  double sx = 0.0;
  double sy = 0.0;
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    if (grid.cells[i] != kUnobserved) {
      const auto x = static_cast<double>(i % grid.side);
      const std::size_t row = i / grid.side;
      const auto y = static_cast<double>(row);
      n += 1.0;
      sx += x;
      sy += y;
      xx += x * x;
      xy += x * y;
      yy += y * y;
    }
  }
  if (n < 2.0) {
    return false;
  }
  const double a = xx / n - sx * sx / (n * n);
  const double b = xy / n - sx * sy / (n * n);
  const double c = yy / n - sy * sy / (n * n);
  const double spread = std::sqrt(0.25 * (a - c) * (a - c) + b * b);
  const double large = 0.5 * (a + c) + spread;
  const double small = 0.5 * (a + c) - spread;
  constexpr double kElongation = 1.5;
  angle_rad = 0.5 * std::atan2(2.0 * b, a - c);
  return large > kElongation * kElongation * small;
}

}  // namespace

std::vector<std::vector<FoundPose>> match_pairs(const std::vector<EvalSubmap>& submaps,
                                                const std::vector<EvalPair>& pairs, const MatchVariant& variant,
                                                std::size_t threads) {
  std::vector<std::vector<FoundPose>> found(pairs.size());
  if (!pairs.empty()) {
    PairMatcher matcher(submaps, variant, threads);
    matcher.describe(pairs);
    in_parallel(matcher.threads(), pairs.size(),
                [&](std::size_t worker, std::size_t i) { found[i] = matcher.match(worker, pairs[i]); });
  }
  return found;
}

std::vector<std::vector<FoundPose>> register_pairs(const std::vector<EvalSubmap>& submaps,
                                                   const std::vector<EvalPair>& pairs,
                                                   const RegistrationConfig& registration, std::size_t threads) {
  struct Registrar {
    HeapArena memory;
    SpectralRegistration registration;
  };
  std::vector<std::vector<FoundPose>> found(pairs.size());
  std::vector<std::unique_ptr<Registrar>> workers(std::max<std::size_t>(threads, 1));
  for (std::unique_ptr<Registrar>& worker : workers) {
    worker = std::make_unique<Registrar>();
    require(worker->registration.init(registration, worker->memory.carve([&](auto& arena) {
      return SpectralRegistration::carve(arena, registration);
    })),
            "registration");
  }
  const std::vector<std::vector<std::size_t>> groups = by_query(pairs, submaps.size());
  in_parallel(workers.size(), groups.size(), [&](std::size_t worker, std::size_t b) {
    if (groups[b].empty()) {
      return;
    }
    SpectralRegistration& matcher = workers[worker]->registration;
    require(matcher.set_query(submaps[b].grid.view()), "query");
    for (const std::size_t i : groups[b]) {
      require(matcher.begin(submaps[pairs[i].a].grid.view()), "registration");
      while (!matcher.step()) {
      }
      const PlaceHypotheses& hypotheses = matcher.hypotheses();
      for (std::size_t k = 0; k < hypotheses.size(); ++k) {
        const PlaceHypothesis& h = hypotheses[k];
        found[i].push_back({h.a_T_b, static_cast<double>(h.peak), static_cast<double>(h.agreement),
                            static_cast<double>(h.confidence), evidence_of(hypotheses, k)});
      }
    }
  });
  return found;
}

double score_of(const FoundPose& pose, PairScore score) {
  switch (score) {
    case PairScore::peak:
      return pose.peak;
    case PairScore::agreement:
      return pose.agreement;
    case PairScore::rank:
      return pose.agreement * std::sqrt(std::max(pose.peak, 0.0));
    case PairScore::confidence:
      break;
  }
  return pose.confidence;
}

const FoundPose* deciding(const std::vector<FoundPose>& found, PairScore score) {
  const FoundPose* best = nullptr;
  for (const FoundPose& pose : found) {
    best = best == nullptr || score_of(pose, score) > score_of(*best, score) ? &pose : best;
  }
  return best;
}

PoseError pose_error(const EvalPair& pair, const FoundPose& found) {
  const Pose2 off = between(pair.a_T_b, found.a_T_b);
  return {translation(off), std::fabs(off.theta) * kDegrees};
}

std::vector<PoseDecision> pose_decisions(const std::vector<EvalPair>& pairs,
                                         const std::vector<std::vector<FoundPose>>& found, PairScore score) {
  std::vector<PoseDecision> decisions;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const FoundPose* const best = deciding(found[i], score);
    PoseDecision d{-1.0, pairs[i].overlap >= kPositiveOverlap, kWrong_m, 180.0, pairs[i].weight};
    if (best != nullptr) {
      const PoseError error = pose_error(pairs[i], *best);
      d.score = score_of(*best, score);
      d.metres = error.metres;
      d.degrees = error.degrees;
    }
    decisions.push_back(d);
  }
  return decisions;
}

const char* to_string(Confusion confusion) {
  switch (confusion) {
    case Confusion::near:
      return "near";
    case Confusion::elsewhere:
      return "elsewhere";
    case Confusion::half_turn:
      return "turned by 180 degrees";
    case Confusion::quarter_turn:
      return "turned by 90 degrees";
    case Confusion::slid:
      return "slid along a corridor";
    case Confusion::shifted:
      return "shifted";
    case Confusion::other:
      break;
  }
  return "other";
}

Confusion confusion_of(const EvalPair& pair, const EvalSubmap& a, const FoundPose& found) {
  constexpr double kSameTurn_deg = 15.0;
  constexpr double kAlong_deg = 20.0;
  constexpr double kNear_m = 1.0;
  constexpr double kNear_deg = 8.0;
  const PoseError error = pose_error(pair, found);
  if (error.metres <= kNear_m && error.degrees <= kNear_deg) {
    return Confusion::near;
  }
  if (pair.overlap <= kNegativeOverlap) {
    return Confusion::elsewhere;
  }
  if (degrees_off(found.a_T_b.theta, pair.a_T_b.theta + kPi) < kSameTurn_deg) {
    return Confusion::half_turn;
  }
  if (degrees_off(found.a_T_b.theta, pair.a_T_b.theta + kHalfPi) < kSameTurn_deg ||
      degrees_off(found.a_T_b.theta, pair.a_T_b.theta - kHalfPi) < kSameTurn_deg) {
    return Confusion::quarter_turn;
  }
  if (degrees_off(found.a_T_b.theta, pair.a_T_b.theta) >= kSameTurn_deg) {
    return Confusion::other;
  }
  const double way = std::atan2(found.a_T_b.y - pair.a_T_b.y, found.a_T_b.x - pair.a_T_b.x);
  double axis = 0.0;
  const bool along =
      long_axis(a, axis) && (degrees_off(way, axis) < kAlong_deg || degrees_off(way, axis + kPi) < kAlong_deg);
  return along ? Confusion::slid : Confusion::shifted;
}

std::vector<EvalPair> sample_pairs(const std::vector<EvalPair>& pairs, std::size_t count, std::uint64_t seed) {
  if (count == 0 || pairs.size() <= count) {
    return pairs;
  }
  const auto stratum_of = [](const EvalPair& pair) {
    return pair.overlap >= kPositiveOverlap ? 0U : pair.overlap <= kNegativeOverlap ? 1U : 2U;
  };
  std::vector<std::vector<std::size_t>> strata(3);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    strata[stratum_of(pairs[i])].push_back(i);
  }
  std::vector<std::size_t> chosen;
  std::vector<double> weights(3);
  Random random(seed, 0);
  for (std::size_t s = 0; s < strata.size(); ++s) {
    std::vector<std::size_t>& all = strata[s];
    const std::size_t wanted = std::min(all.size(), std::max<std::size_t>(count / 3, 1));
    for (std::size_t i = 0; i < wanted; ++i) {
      std::swap(all[i], all[i + static_cast<std::size_t>(random.bits() % (all.size() - i))]);
      chosen.push_back(all[i]);
    }
    weights[s] = wanted > 0 ? static_cast<double>(all.size()) / static_cast<double>(wanted) : 0.0;
  }
  std::sort(chosen.begin(), chosen.end());
  std::vector<EvalPair> sample;
  for (const std::size_t i : chosen) {
    sample.push_back(pairs[i]);
    sample.back().weight = weights[stratum_of(pairs[i])];
  }
  return sample;
}

}  // namespace mellin::host
