#include "host/registration_trace.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "mellin/grid/digest.hpp"
#include "mellin/spectral/surface_peaks.hpp"

namespace mellin::host {
namespace {

void require(Status status, const char* what) {
  if (status != Status::ok) {
    throw std::runtime_error(std::string(what) + ": " + to_string(status));
  }
}

template <class T>
Span<T> span(std::vector<T>& v) {
  return {v.data(), v.size()};
}

/// A stage on its own, over memory of its own.
struct Rotation {
  HeapArena memory;
  std::vector<float> magnitudes;
  std::vector<float> rows;
  std::vector<Complex> line;
  std::vector<Complex> surface;
  RotationEstimator estimator;
  RotationEstimator::Memory carved;

  explicit Rotation(const MatcherConfig& config)
      : magnitudes(spectrum_size(config.side)),
        rows(Fft2::kBlock * config.side),
        line(config.side / 2U + 1U),
        surface(spectrum_size(config.side)),
        carved(memory.carve([&](auto& arena) { return RotationEstimator::carve(arena, arena, config); })) {
    require(estimator.init(config, carved, {span(magnitudes), span(rows), span(line), span(surface)}), "rotation");
  }
};

class Tracer {
 public:
  explicit Tracer(const PaddedPair& pair) : config_(pair.config.matcher), side_(config_.side), rotation_(config_) {
    trace_.pair = pair;
    require(fft_.init(config_.side, fft_memory_.carve([&](auto& arena) { return Fft2::carve(arena, config_.side); })),
            "transform");
    require(matcher_.init(config_, matcher_memory_.carve([&](auto& arena) { return Matcher::carve(arena, config_); })),
            "matcher");
    a_ = features_a_.carve([&](auto& arena) { return Features::carve(arena, config_); });
    b_ = features_b_.carve([&](auto& arena) { return Features::carve(arena, config_); });
  }

  RegistrationTrace run() {
    describe(trace_.pair.a, a_, trace_.a);
    describe(trace_.pair.b, b_, trace_.b);
    if (a_.ready && b_.ready) {
      estimate_rotations();
      for (const RotationPeak& rotation : trace_.rotations) {
        correlate(rotation, rotation.angle_rad);
        correlate(rotation, rotation.angle_rad + kPi);
      }
      require(matcher_.match(a_, b_), "match");
      trace_.matches.assign(matcher_.hypotheses().begin(), matcher_.hypotheses().end());
    }
    trace_.hypotheses = register_grids(trace_.pair);
    return std::move(trace_);
  }

 private:
  void describe(const PaddedGrid& grid, Features& features, TracedPicture& out) {
    out.obstacles.resize(side_ * side_);
    out.observed.resize(mask_bytes(config_.side));
    std::vector<float> scratch(DigestMaker::scratch_size(grid.side, config_.side, config_.preprocessing));
    DigestOut digest;
    digest.obstacles = span(out.obstacles);
    digest.observed = span(out.observed);
    digest.side = config_.side;
    require(make_digest(grid.view(), span(scratch), digest, config_.preprocessing), "picture");
    const Status status = matcher_.extract(digest.obstacles, features, digest.observed);
    if (status != Status::degenerate) {
      require(status, "features");
    }
    out.ready = features.ready;
    out.image.assign(features.image.begin(), features.image.end());
    describe_spectrum(out);
  }

  void describe_spectrum(TracedPicture& out) {
    std::vector<Complex> spectrum(spectrum_size(config_.side));
    require(fft_.forward(span(out.image), span(spectrum)), "transform");
    for (std::size_t kx = 0; kx <= side_ / 2; ++kx) {
      (void)rotation_.estimator.note_column(spectrum.data() + kx * side_, kx);
    }
    out.magnitudes = rotation_.magnitudes;
    // The first pass samples the magnitudes; what it leaves is the transform of the polar picture's rows.
    std::vector<Complex> polar(Features::polar_count(config_));
    rotation_.estimator.begin_describe(span(polar));
    (void)rotation_.estimator.step(fft_, 0);
    read_polar(polar, out.polar);
  }

  void read_polar(std::vector<Complex>& spectra, std::vector<float>& polar) {
    const bool rings = config_.rotation == RotationMode::rings;
    const std::size_t rows = rings ? side_ / 2 : side_;
    polar.resize(rows * side_);
    for (std::size_t r = 0; r < rows; ++r) {
      if (rings) {
        fft_.inverse_line(spectra.data() + r * (side_ / 2 + 1), polar.data() + r * side_);
      } else {
        fft_.inverse_rows(span(spectra), r, 1, polar.data() + r * side_);
      }
    }
    for (float& value : polar) {
      value /= static_cast<float>(side_);
    }
  }

  void estimate_rotations() {
    rotation_.estimator.begin_estimate(a_.polar, b_.polar, -1.0F);
    while (!rotation_.estimator.step(fft_, 0)) {
    }
    const bool log_polar =
        config_.rotation == RotationMode::log_polar || config_.rotation == RotationMode::log_polar_scale;
    const Span<float> curve = rotation_.carved.correlation.first(log_polar ? side_ / 2 : side_);
    trace_.rotation_correlation.assign(curve.begin(), curve.end());
    for (const RotationPeak& peak : rotation_.estimator.peaks()) {
      if (trace_.rotations.size() < config_.max_peaks) {
        trace_.rotations.push_back(peak);
      }
    }
  }

  float image_of_b(long column, long row) const {
    const auto side = static_cast<long>(side_);
    return column >= 0 && column < side && row >= 0 && row < side
               ? trace_.b.image[static_cast<std::size_t>(row * side + column)]
               : 0.0F;
  }

  /// Bilinear, nothing beyond the borders.
  float sample_b(double x, double y) const {
    const double column = std::floor(x);
    const double row = std::floor(y);
    const auto c = static_cast<long>(column);
    const auto r = static_cast<long>(row);
    const auto right = static_cast<float>(x - column);
    const auto up = static_cast<float>(y - row);
    const float lower = image_of_b(c, r) * (1.0F - right) + image_of_b(c + 1, r) * right;
    const float upper = image_of_b(c, r + 1) * (1.0F - right) + image_of_b(c + 1, r + 1) * right;
    return lower * (1.0F - up) + upper * up;
  }

  std::vector<float> turned_b(double angle_rad, double scale) const {
    std::vector<float> out(side_ * side_);
    const SinCos turn = sincos(angle_rad);
    const double centre = 0.5 * static_cast<double>(side_ - 1);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t column = i % side_;
      const std::size_t row = i / side_;
      const double dx = (static_cast<double>(column) - centre) / scale;
      const double dy = (static_cast<double>(row) - centre) / scale;
      out[i] = sample_b(centre + turn.cos * dx + turn.sin * dy, centre + turn.cos * dy - turn.sin * dx);
    }
    return out;
  }

  /// The phase-only matched filter of one candidate (IV-A step 3). The library gets the half turn from the conjugate
  /// spectrum; here it is turned like any other.
  void correlate(const RotationPeak& rotation, double angle_rad) {
    TracedCandidate candidate;
    candidate.rotation = rotation;
    candidate.angle_rad = wrap_angle(angle_rad);
    candidate.turned = turned_b(angle_rad, static_cast<double>(rotation.scale));
    std::vector<Complex> spectrum(spectrum_size(config_.side));
    require(fft_.forward(span(candidate.turned), span(spectrum)), "transform");
    for (std::size_t i = 0; i < spectrum.size(); ++i) {
      const Complex z = spectrum[i];
      const float weight = 1.0F / (std::sqrt(z.re * z.re + z.im * z.im) + b_.floor);
      const Complex f = a_.filter[i];
      spectrum[i] = {weight * (f.re * z.re + f.im * z.im), weight * (f.im * z.re - f.re * z.im)};
    }
    candidate.surface.resize(side_ * side_);
    require(fft_.inverse(span(spectrum), span(candidate.surface)), "transform");
    SurfacePeaks peaks;
    peaks.begin(side_, config_.translation_peaks);
    for (std::size_t r = 0; r < side_; ++r) {
      peaks.add_row(r, {candidate.surface.data() + r * side_, side_});
    }
    for (std::size_t i = 0; i < peaks.size(); ++i) {
      candidate.peaks.push_back(peaks[i]);
    }
    trace_.candidates.push_back(std::move(candidate));
  }

  MatcherConfig config_;
  std::size_t side_;
  Rotation rotation_;
  HeapArena fft_memory_;
  HeapArena matcher_memory_;
  HeapArena features_a_;
  HeapArena features_b_;
  Fft2 fft_;
  Matcher matcher_;
  Features a_;
  Features b_;
  RegistrationTrace trace_;
};

}  // namespace

const TracedCandidate* RegistrationTrace::best_candidate() const {
  const TracedCandidate* best = nullptr;
  for (const TracedCandidate& candidate : candidates) {
    if (!candidate.peaks.empty() && (best == nullptr || candidate.peaks[0].value > best->peaks[0].value)) {
      best = &candidate;
    }
  }
  return best;
}

RegistrationTrace trace_registration(const PaddedPair& pair) {
  if (pair.config.matcher.masked || pair.config.matcher.turns_per_bin != 0) {
    throw std::invalid_argument("only the phase-only filter at the peaks' own angles is traced");
  }
  return Tracer(pair).run();
}

}  // namespace mellin::host
