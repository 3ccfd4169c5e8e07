#include "host/sim_options.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace mellin::host {
namespace {

void check(bool good, const char* what) {
  if (!good) {
    throw std::invalid_argument(std::string("simulator: ") + what);
  }
}

/// Systematic errors, and deviations of a metre driven.
struct OdometryErrors {
  double scale = 0.0;
  double turn_rad_per_m = 0.0;
  double way_m = 0.0;
  double turn_rad = 0.0;
};

OdometryErrors errors_of(SimOdometry quality) {
  switch (quality) {
    case SimOdometry::good:
      return {0.01, 0.0002, 0.01, 0.002};
    case SimOdometry::plain:
      return {0.02, 0.001, 0.015, 0.005};
    case SimOdometry::slipping:
      return {0.03, 0.001, 0.06, 0.02};
    case SimOdometry::poor:
      break;
  }
  return {0.04, 0.003, 0.03, 0.01};
}

}  // namespace

SimOptions options_for(SimKind kind) {
  SimOptions o;
  o.kind = kind;
  switch (kind) {
    case SimKind::ring:
      break;
    case SimKind::offices:
      o.path_m = 450.0;
      o.range_m = 20.0;
      break;
    case SimKind::hall:
      o.path_m = 400.0;
      o.range_m = 50.0;
      break;
    case SimKind::corridor:
      o.path_m = 1900.0;
      o.range_m = 30.0;
      break;
    case SimKind::flat:
      o.path_m = 150.0;
      o.range_m = 8.0;
      break;
    case SimKind::cave:
      o.path_m = 350.0;
      o.range_m = 20.0;
      break;
  }
  return o;
}

void set_odometry(SimOptions& o, SimOdometry quality) {
  const OdometryErrors errors = errors_of(quality);
  Random random = random_stream(o, SimStream::signs);
  o.scale_error = random.uniform() < 0.5 ? errors.scale : -errors.scale;
  o.turn_error_rad_per_m = random.uniform() < 0.5 ? errors.turn_rad_per_m : -errors.turn_rad_per_m;
  o.way_noise = errors.way_m / std::sqrt(o.spacing_m);
  o.turn_noise_rad = errors.turn_rad * std::sqrt(o.spacing_m);
}

void check_options(const SimOptions& o, int session) {
  check(o.sessions >= 1 && o.sessions <= 100, "expected 1 to 100 sessions");
  check(session >= 0 && session < o.sessions, "expected a session below the number of sessions");
  check(o.bare_bends >= 0 && o.bare_bends <= 4, "expected 0 to 4 bare bends");
  check(o.loops >= 1 && o.loops <= 50, "expected 1 to 50 loops");
  check(o.path_m >= 10.0 && o.path_m <= 10000.0, "expected a way of 10 to 10000 m");
  check(o.beams == 180 || o.beams == 181 || o.beams == 360 || o.beams == 361, "expected 180, 181, 360 or 361 beams");
  check(o.range_m >= 1.0 && o.range_m <= 79.0, "expected a range of 1 to 79 m");
  check(o.spacing_m >= 0.01 && o.spacing_m <= 2.0, "expected 0.01 to 2 m between scans");
  check(o.turn_rad >= 0.01 && o.turn_rad <= 1.0, "expected turns of 0.01 to 1 rad between scans");
  for (const double share :
       {o.change, o.no_return_share, o.outlier_share, o.way_noise, o.glass_share, o.missing_share}) {
    check(share >= 0.0 && share <= 1.0, "expected shares of 0 to 1");
  }
  check(o.range_noise_m >= 0.0 && o.range_noise_m <= 1.0, "expected a range noise of 0 to 1 m");
  check(o.turn_noise_rad >= 0.0 && o.turn_noise_rad <= 1.0, "expected a turn noise of 0 to 1 rad");
  for (const double error : {o.scale_error, o.turn_error_rad_per_m}) {
    check(error >= -0.5 && error <= 0.5, "expected odometry errors of -0.5 to 0.5");
  }
  for (const int count : {o.people, o.stops, o.pushes, o.slips, o.kidnaps}) {
    check(count >= 0 && count <= 100, "expected 0 to 100 people, stops, pushes, slips and kidnaps");
  }
}

}  // namespace mellin::host
