// The trace of a registration: what it shows is what the library did.
#include <doctest.h>

#include <algorithm>
#include <cmath>

#include "host/registration_trace.hpp"
#include "tests/support/submaps.hpp"

using namespace mellin;
using namespace mellin::host;

namespace {

OccupancyImage image_of(const RenderedSubmap& submap) { return {submap.side, submap.side, submap.cells}; }

/// Two submaps of the simulated floor that overlap by three quarters, B turned.
PaddedPair overlapping_pair() {
  const std::vector<PosedScan> scans = test::simulated_scans(3);
  return pad(image_of(test::submap(scans, 10, 40, 1, 0.0)), image_of(test::submap(scans, 20, 40, 1, 0.7)), 0.05);
}

/// The matcher's hypotheses of this angle, strongest first.
std::vector<Hypothesis> at_angle(const RegistrationTrace& trace, double angle_rad) {
  std::vector<Hypothesis> found;
  for (const Hypothesis& h : trace.matches) {
    if (std::fabs(wrap_angle(h.a_T_b.theta - angle_rad)) < 1e-6) {
      found.push_back(h);
    }
  }
  return found;
}

void check_trace(const PaddedPair& pair) {
  const RegistrationTrace trace = trace_registration(pair);
  const std::size_t side = trace.side();
  const auto pixel_m = static_cast<double>(pair.config.matcher.pixel_m);
  REQUIRE(!trace.matches.empty());
  REQUIRE(trace.candidates.size() == 2 * trace.rotations.size());

  // Each surface: its highest pixel is the strongest hypothesis at that angle.
  std::size_t compared = 0;
  for (const TracedCandidate& candidate : trace.candidates) {
    const auto top = std::max_element(candidate.surface.begin(), candidate.surface.end());
    const auto at = static_cast<std::size_t>(top - candidate.surface.begin());
    REQUIRE(!candidate.peaks.empty());
    CHECK(candidate.peaks[0].value == *top);
    CHECK(candidate.peaks[0].row * side + candidate.peaks[0].column == at);
    const std::vector<Hypothesis> found = at_angle(trace, candidate.angle_rad);
    if (found.empty()) {
      continue;  // fell out behind the strongest kMaxMatchHypotheses, or another said the same
    }
    ++compared;
    CHECK(static_cast<double>(found[0].peak) == doctest::Approx(static_cast<double>(*top)).epsilon(2e-3));
    const double period = pixel_m * static_cast<double>(side);
    const auto apart = [&](double p, double q) { return std::fabs(std::remainder(p - q, period)); };
    CHECK(apart(found[0].a_T_b.x, trace.shift(at % side) * pixel_m) <= pixel_m);
    CHECK(apart(found[0].a_T_b.y, trace.shift(at / side) * pixel_m) <= pixel_m);
  }
  CHECK(compared >= 2);
  const TracedCandidate* best = trace.best_candidate();
  REQUIRE(best != nullptr);
  CHECK(std::fabs(wrap_angle(trace.matches[0].a_T_b.theta - best->angle_rad)) < 1e-6);

  // The curve: each rotation that is tried is one of its local maxima, as high as it says.
  const std::vector<float>& curve = trace.rotation_correlation;
  for (const RotationPeak& peak : trace.rotations) {
    const double step_rad = kPi / static_cast<double>(curve.size());
    const auto near = static_cast<std::ptrdiff_t>(std::lround(peak.angle_rad / step_rad));
    const auto count = static_cast<std::ptrdiff_t>(curve.size());
    float highest = 0.0F;
    for (std::ptrdiff_t i = near - 1; i <= near + 1; ++i) {
      highest = std::max(highest, curve[static_cast<std::size_t>((i + count) % count)]);
    }
    CHECK(highest == peak.strength);
  }
  CHECK(trace.rotations[0].strength == *std::max_element(curve.begin(), curve.end()));
}

}  // namespace

TEST_CASE("the traced surfaces and angles are those of the matcher, in every rotation mode") {
  PaddedPair pair = overlapping_pair();
  for (const RotationMode mode :
       {RotationMode::rings, RotationMode::linear_polar, RotationMode::log_polar, RotationMode::log_polar_scale}) {
    CAPTURE(static_cast<int>(mode));
    pair.config.matcher.rotation = mode;
    check_trace(pair);
  }
}

TEST_CASE("the traced polar picture correlates as the matcher's features do") {
  const RegistrationTrace trace = trace_registration(overlapping_pair());
  // Rings: the correlation of the two polar pictures at a shift of k angles, over the roots of their energies.
  const std::size_t side = trace.side();
  const std::size_t rings = side / 2;
  REQUIRE(trace.a.polar.size() == rings * side);
  double energy_a = 0.0;
  double energy_b = 0.0;
  for (std::size_t i = 0; i < trace.a.polar.size(); ++i) {
    energy_a += static_cast<double>(trace.a.polar[i]) * static_cast<double>(trace.a.polar[i]);
    energy_b += static_cast<double>(trace.b.polar[i]) * static_cast<double>(trace.b.polar[i]);
  }
  for (std::size_t k = 0; k < side; k += 7) {
    double sum = 0.0;
    for (std::size_t r = 0; r < rings; ++r) {
      for (std::size_t i = 0; i < side; ++i) {
        sum += static_cast<double>(trace.a.polar[r * side + (i + k) % side]) *
               static_cast<double>(trace.b.polar[r * side + i]);
      }
    }
    CHECK(sum / std::sqrt(energy_a * energy_b) ==
          doctest::Approx(static_cast<double>(trace.rotation_correlation[k])).epsilon(1e-3));
  }
}

TEST_CASE("a trace of nothing shows nothing, and what has no phase-only surface is refused") {
  const OccupancyImage nothing{100, 60, std::vector<std::uint8_t>(6000, kUnobserved)};
  const RegistrationTrace trace = trace_registration(pad(nothing, nothing, 0.05));
  CHECK(!trace.a.ready);
  CHECK(trace.candidates.empty());
  CHECK(trace.hypotheses.empty());
  CHECK(trace.best_candidate() == nullptr);
  PaddedPair masked = pad(nothing, nothing, 0.05);
  masked.config.matcher.masked = true;
  CHECK_THROWS_AS((void)trace_registration(masked), std::invalid_argument);
}
