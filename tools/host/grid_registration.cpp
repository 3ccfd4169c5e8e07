#include "host/grid_registration.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "mellin/grid/digest.hpp"
#include "mellin/spectral/alignment.hpp"
#include "mellin/spectral/matcher.hpp"
#include "mellin/spectral/verification.hpp"

namespace mellin::host {
namespace {

constexpr double kRegistrationPixel_m = 0.2;  // coarse enough to be robust, fine enough for alignment's capture range
constexpr double kVerificationCell_m = 0.2;   // where verification discriminates best
constexpr std::size_t kFewestPixels = 96;
constexpr std::size_t kMostPixels = 1024;
constexpr std::size_t kAligned = 8;     // hypotheses that are aligned, by agreement before
constexpr double kSamePlace_m = 0.5;    // hypotheses closer than this …
constexpr double kSamePlace_rad = 0.1;  // … in both are one
constexpr double kElsewhere_m = 1.0;    // a rival must differ by this much …
constexpr double kElsewhere_rad = 0.2;  // … or this
constexpr double kLargestMargin = 0.3;

void require(Status status, const char* what) {
  if (status != Status::ok) {
    throw std::runtime_error(std::string(what) + ": " + to_string(status));
  }
}

/// Memory for one component, exactly as large as its carve() says.
class Memory {
 public:
  template <class Carve>
  auto carve(Carve&& carve) {
    MeasureArena measure;
    carve(measure);
    bytes_.resize(measure.use().total() / sizeof(double));
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(bytes_.data()), measure.use().total()));
    return carve(arena);
  }

 private:
  std::vector<double> bytes_;
};

/// Sides for both padded grids: `pixels` of the matcher times a power of two.
struct Sides {
  std::uint16_t pixels = 0;
  std::uint16_t cells = 0;
  std::uint16_t classes = 0;
};

/// `halvings` of the padded grid to the picture that is registered. None where no transform is that large.
std::optional<Sides> sides_for(std::size_t largest, unsigned halvings, double resolution_m) {
  const std::size_t fewest = std::max<std::size_t>((largest + (1U << halvings) - 1) >> halvings, kFewestPixels / 2);
  for (std::size_t pixels = (fewest + 3) / 4 * 4; pixels <= kMostPixels; pixels += 4) {
    if (is_fft_side(static_cast<std::uint32_t>(pixels)) && (pixels << halvings) <= 0xFFFF) {
      const std::size_t cells = pixels << halvings;
      std::size_t block = 1;
      while (resolution_m * 2.0 * static_cast<double>(block) <= kVerificationCell_m * 1.01 &&
             cells % (4 * block) == 0) {
        block *= 2;
      }
      return Sides{static_cast<std::uint16_t>(pixels), static_cast<std::uint16_t>(cells),
                   static_cast<std::uint16_t>(cells / block)};
    }
  }
  return std::nullopt;
}

/// Halvings that bring a cell near kRegistrationPixel_m, with enough pixels left.
unsigned halvings_for(std::size_t largest, double resolution_m) {
  unsigned halvings = 0;
  while (resolution_m * 2.0 * (1U << halvings) <= kRegistrationPixel_m * 1.01 &&
         (largest >> (halvings + 1)) >= kFewestPixels) {
    ++halvings;
  }
  while ((largest >> halvings) > kMostPixels) {
    ++halvings;
  }
  return halvings;
}

/// A grid in the middle of a square one.
struct Padded {
  std::vector<std::uint8_t> cells;
  std::uint16_t side = 0;
  float cell_m = 0.0F;
  Pose2 centre_T_corner;  ///< from the picture's frame to the submap's
  GridView view() const { return {{cells.data(), cells.size()}, side, cell_m}; }
};

Padded pad(const OccupancyImage& image, std::uint16_t side, double resolution_m) {
  Padded padded{
      std::vector<std::uint8_t>(std::size_t{side} * side, kUnobserved), side, static_cast<float>(resolution_m), {}};
  const std::size_t left = (side - image.width) / 2;
  const std::size_t below = (side - image.height) / 2;
  for (std::size_t row = 0; row < image.height; ++row) {
    std::copy_n(image.cells.begin() + static_cast<std::ptrdiff_t>(row * image.width), image.width,
                padded.cells.begin() + static_cast<std::ptrdiff_t>((row + below) * side + left));
  }
  const double half = 0.5 * side;
  padded.centre_T_corner = {(static_cast<double>(left) - half) * resolution_m,
                            (static_cast<double>(below) - half) * resolution_m, 0.0};
  return padded;
}

struct Candidate {
  Pose2 a_T_b;  ///< of the grids' centres
  double peak = 0.0;
  double agreement = 0.0;
  double inlier_share = 0.0;
  double evidence() const { return agreement * inlier_share; }
};

bool within(const Pose2& a, const Pose2& b, double distance_m, double angle_rad) {
  const Pose2 apart = between(a, b);
  return translation(apart) <= distance_m && std::fabs(apart.theta) <= angle_rad;
}

/// The two grids prepared for one number of halvings.
class Pair {
 public:
  Pair(const OccupancyImage& a, const OccupancyImage& b, const Sides& sides, double resolution_m)
      : sides_(sides), a_(pad(a, sides.cells, resolution_m)), b_(pad(b, sides.cells, resolution_m)) {
    const auto classes = [&](const Padded& grid, std::vector<std::uint8_t>& memory) {
      memory.resize(std::size_t{sides.classes} * sides.classes);
      const Result<ClassView> view = classify(grid.view(), {}, sides.classes, {memory.data(), memory.size()});
      require(view.status(), "classes of the grid");
      return view.value();
    };
    classes_a_ = classes(a_, class_memory_a_);
    classes_b_ = classes(b_, class_memory_b_);
  }

  const Padded& a() const { return a_; }
  const Padded& b() const { return b_; }

  /// The matcher's hypotheses; each peak of its cyclic surface stands for up to four translations, of which the one
  /// that agrees best is kept.
  std::vector<Candidate> hypotheses() {
    MatcherConfig config;
    config.side = sides_.pixels;
    const int cells_a_pixel = sides_.cells / sides_.pixels;
    config.pixel_m = a_.cell_m * static_cast<float>(cells_a_pixel);
    Memory matcher_memory;
    Memory memory_a;
    Memory memory_b;
    Matcher matcher;
    require(matcher.init(config, matcher_memory.carve([&](auto& arena) { return Matcher::carve(arena, config); })),
            "matcher");
    Features features_a = memory_a.carve([&](auto& arena) { return Features::carve(arena, config, FeatureUse::as_a); });
    Features features_b = memory_b.carve([&](auto& arena) { return Features::carve(arena, config, FeatureUse::as_b); });
    std::vector<Candidate> found;
    if (!extract(matcher, a_, features_a) || !extract(matcher, b_, features_b)) {
      return found;
    }
    require(matcher.match(features_a, features_b), "match");
    for (const Hypothesis& hypothesis : matcher.hypotheses()) {
      found.push_back(unwrapped(hypothesis));
    }
    return found;
  }

  double agreement(const Pose2& a_T_b) const {
    const Result<Agreement> result = verify(classes_a_, classes_b_, a_T_b);
    require(result.status(), "verification");
    return static_cast<double>(result.value().score);
  }

  /// Aligns the candidates and judges them by the classes again.
  void align(std::vector<Candidate>& candidates) const {
    AlignmentConfig config;
    config.max_side = sides_.cells;
    Memory memory;
    Alignment alignment;
    require(alignment.init(config, memory.carve([&](auto& arena) { return Alignment::carve(arena, config); })),
            "alignment");
    for (Candidate& candidate : candidates) {
      require(alignment.begin(a_.view(), b_.view(), candidate.a_T_b), "alignment");
      while (alignment.step()) {
      }
      const Result<AlignmentResult> result = alignment.result();
      if (result.ok()) {
        candidate.a_T_b = result.value().a_T_b;
        candidate.inlier_share = static_cast<double>(result.value().inlier_share);
        candidate.agreement = agreement(candidate.a_T_b);
      }
    }
  }

 private:
  /// False where the grid shows nothing to match by.
  bool extract(Matcher& matcher, const Padded& grid, Features& features) const {
    const std::size_t count = std::size_t{sides_.pixels} * sides_.pixels;
    std::vector<std::uint8_t> picture(count);
    std::vector<float> scratch(DigestMaker::scratch_size(sides_.cells, sides_.pixels));
    DigestOut out;
    std::vector<std::uint8_t> observed(mask_bytes(sides_.pixels));
    out.obstacles = {picture.data(), count};
    out.observed = {observed.data(), observed.size()};
    out.side = sides_.pixels;
    require(make_digest(grid.view(), {scratch.data(), scratch.size()}, out), "picture of the grid");
    const Status status = matcher.extract({picture.data(), count}, {observed.data(), observed.size()}, features);
    if (status != Status::degenerate) {
      require(status, "features of the grid");
    }
    return status == Status::ok;
  }

  Candidate unwrapped(const Hypothesis& hypothesis) const {
    const double period = static_cast<double>(a_.cell_m) * a_.side;
    const Pose2& p = hypothesis.a_T_b;
    Candidate best{p, static_cast<double>(hypothesis.peak), -1.0, 0.0};
    for (const double x : {p.x, p.x - std::copysign(period, p.x)}) {
      for (const double y : {p.y, p.y - std::copysign(period, p.y)}) {
        const double found = agreement({x, y, p.theta});
        if (found > best.agreement) {
          best.a_T_b = {x, y, p.theta};
          best.agreement = found;
        }
      }
    }
    return best;
  }

  Sides sides_;
  Padded a_;
  Padded b_;
  std::vector<std::uint8_t> class_memory_a_;
  std::vector<std::uint8_t> class_memory_b_;
  ClassView classes_a_;
  ClassView classes_b_;
};

/// Best first, without those close to a better one.
template <class Better>
void keep_distinct(std::vector<Candidate>& candidates, Better better) {
  std::stable_sort(candidates.begin(), candidates.end(), better);
  std::vector<Candidate> distinct;
  for (const Candidate& candidate : candidates) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Candidate& other) {
      return within(candidate.a_T_b, other.a_T_b, kSamePlace_m, kSamePlace_rad);
    });
    if (!known) {
      distinct.push_back(candidate);
    }
  }
  candidates = std::move(distinct);
}

double margin_of(const Candidate& candidate, const std::vector<Candidate>& all) {
  double rival = 0.0;
  for (const Candidate& other : all) {
    if (&other != &candidate && !within(candidate.a_T_b, other.a_T_b, kElsewhere_m, kElsewhere_rad)) {
      rival = std::max(rival, other.evidence());
    }
  }
  return candidate.evidence() - rival;
}

}  // namespace

double confidence_of(double agreement, double inlier_share, double margin, double peak) {
  constexpr double kEven = 0.85;
  constexpr double kWidth = 0.06;
  const double quality = agreement * inlier_share + 0.5 * std::min(margin, kLargestMargin) + 0.25 * peak;
  return 1.0 / (1.0 + std::exp(-(quality - kEven) / kWidth));
}

std::vector<GridHypothesis> register_grids(const OccupancyImage& a, const OccupancyImage& b, double resolution_m) {
  if (!(resolution_m > 0.0) || !std::isfinite(resolution_m)) {
    throw std::invalid_argument("the resolution is a positive number of metres");
  }
  const std::size_t largest = std::max({a.width, a.height, b.width, b.height});
  const unsigned halvings = halvings_for(largest, resolution_m);
  const std::optional<Sides> sides = sides_for(largest, halvings, resolution_m);
  if (!sides) {
    throw std::invalid_argument("the grids are too large");
  }
  Pair pair(a, b, *sides, resolution_m);
  std::vector<Candidate> candidates = pair.hypotheses();
  keep_distinct(candidates, [](const Candidate& x, const Candidate& y) { return x.agreement > y.agreement; });
  candidates.resize(std::min(candidates.size(), kAligned));
  pair.align(candidates);
  keep_distinct(candidates, [](const Candidate& x, const Candidate& y) { return x.evidence() > y.evidence(); });

  std::vector<GridHypothesis> hypotheses;
  for (const Candidate& c : candidates) {
    const Pose2 a_T_b = compose(compose(inverse(pair.a().centre_T_corner), c.a_T_b), pair.b().centre_T_corner);
    const double confidence = confidence_of(c.agreement, c.inlier_share, margin_of(c, candidates), c.peak);
    hypotheses.push_back({a_T_b, confidence, c.peak, c.agreement, c.inlier_share, 0.0, margin_of(c, candidates)});
  }
  std::stable_sort(hypotheses.begin(), hypotheses.end(),
                   [](const GridHypothesis& x, const GridHypothesis& y) { return x.confidence > y.confidence; });
  return hypotheses;
}

}  // namespace mellin::host
