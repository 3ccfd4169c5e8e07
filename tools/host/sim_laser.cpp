#include "host/sim_laser.hpp"

#include <algorithm>
#include <cmath>

namespace mellin::host {
namespace {

constexpr double kBeyondReach_m = 0.19;  // real scanners: 8 m reach, 8.19 where nothing was hit

// People: each walks past for so long, at so many metres from the robot.
constexpr double kWalk_s = 7.0;
constexpr double kWalkSpeed_m_s = 1.2;
constexpr double kNearestWalk_m = 0.8;
constexpr double kFarthestWalk_m = 5.0;
constexpr double kTouch_m = 0.3;

// Glass: of the beams that do not meet it nearly at a right angle, so many pass and so many return.
constexpr double kGlassPasses = 0.8;
constexpr double kGlassReturns = 0.1;
constexpr double kGlassStraightCos = 0.985;  // within 10 degrees of the normal it shines back

double rounded(double range) { return std::floor(range * 100.0 + 0.5) / 100.0; }

/// Cosine of the angle between a ray and a wall's normal.
double incidence_cos(const WallSegment& wall, double angle_rad) {
  const SinCos ray = sincos(angle_rad);
  const double length = distance(wall.a, wall.b);
  return length > 0.0 ? std::fabs(ray.cos * (wall.b.y - wall.a.y) - ray.sin * (wall.b.x - wall.a.x)) / length : 0.0;
}

/// Distance along a ray to a person; reach_m where the ray passes by.
double cast_person(Point2 person, Point2 from, const SinCos& ray, double reach_m) {
  const double along = ray.cos * (person.x - from.x) + ray.sin * (person.y - from.y);
  const double aside = ray.cos * (person.y - from.y) - ray.sin * (person.x - from.x);
  const double depth2 = kPersonRadius_m * kPersonRadius_m - aside * aside;
  return depth2 > 0.0 && along > 0.0 ? std::min(reach_m, along - std::sqrt(depth2)) : reach_m;
}

}  // namespace

double no_return_value(const SimOptions& options) { return rounded(options.range_m + kBeyondReach_m); }

double beam_increment(int beams) { return kPi / (beams % 2 == 0 ? beams : beams - 1); }

std::vector<Point2> people_near(const SimOptions& options, int session, const TimedPose& robot) {
  std::vector<Point2> people;
  for (int p = 0; p < options.people; ++p) {
    // They do not all come at the same time.
    const double time = robot.seconds / kWalk_s + static_cast<double>(p) / options.people;
    const double walk = std::floor(time);
    const std::uint64_t which = static_cast<std::uint64_t>(walk) * 1000U + static_cast<std::uint64_t>(p);
    Random random(random_stream(options, SimStream::people, session).bits(), which);
    const double bearing = between_limits(random, -kHalfPi, kHalfPi);
    const double away = between_limits(random, kNearestWalk_m, kFarthestWalk_m);
    const double course = between_limits(random, -kPi, kPi);
    const double walked = kWalkSpeed_m_s * kWalk_s * (time - walk - 0.5);
    const SinCos b = sincos(bearing);
    const SinCos c = sincos(course);
    const Point2 at = transform(robot.pose, away * b.cos + walked * c.cos, away * b.sin + walked * c.sin);
    if (distance(at, {robot.pose.x, robot.pose.y}) > kPersonRadius_m + kTouch_m) {
      people.push_back(at);
    }
  }
  return people;
}

Laser::Laser(const SimOptions& options, int session, const RayGrid& walls)
    : options_(options),
      session_(session),
      walls_(walls),
      noise_(random_stream(options, SimStream::laser, session)),
      panes_(random_stream(options, SimStream::panes, session)),
      missing_(random_stream(options, SimStream::missing, session)) {
  if (options.glass_share > 0.0) {
    Random glass = random_stream(options, SimStream::glass);
    for (std::size_t i = 0; i < walls.segments().size(); ++i) {
      glass_.push_back(glass.uniform() < options.glass_share);
    }
  }
}

/// To the first wall that sends the beam back, through glass that it passes.
double Laser::cast(Point2 from, double angle_rad) {
  RayGrid::Hit hit = walls_.cast(from, angle_rad, options_.range_m);
  while (hit.segment != RayGrid::kNothing && is_glass(hit.segment) &&
         incidence_cos(walls_.segments()[hit.segment], angle_rad) < kGlassStraightCos) {
    const double drawn = panes_.uniform();
    if (drawn >= kGlassPasses) {
      return drawn < kGlassPasses + kGlassReturns ? hit.distance_m : options_.range_m;
    }
    hit = walls_.cast(from, angle_rad, options_.range_m, hit.distance_m);
  }
  return hit.distance_m;
}

void Laser::drop_third(std::vector<float>& ranges) {
  const std::size_t block = ranges.size() / 3;
  const auto first = static_cast<std::ptrdiff_t>(missing_.bits() % (ranges.size() - block + 1));
  std::fill_n(ranges.begin() + first, block, static_cast<float>(no_return_value(options_)));
}

std::vector<float> Laser::scan(const TimedPose& robot) {
  std::vector<float> ranges(static_cast<std::size_t>(options_.beams));
  const std::vector<Point2> people = people_near(options_, session_, robot);
  const double increment = beam_increment(options_.beams);
  const Point2 from{robot.pose.x, robot.pose.y};
  for (int i = 0; i < options_.beams; ++i) {
    const double angle = robot.pose.theta - kHalfPi + increment * i;
    double range = cast(from, angle);
    for (const Point2& person : people) {
      range = cast_person(person, from, sincos(angle), range);
    }
    const bool hit = range < options_.range_m && noise_.uniform() >= options_.no_return_share;
    if (hit && noise_.uniform() < options_.outlier_share) {
      range *= noise_.uniform();
    }
    range += options_.range_noise_m * noise_.normal();
    range = hit ? std::clamp(range, 0.02, options_.range_m) : no_return_value(options_);
    ranges[static_cast<std::size_t>(i)] = static_cast<float>(rounded(range));
  }
  if (options_.missing_share > 0.0 && missing_.uniform() < options_.missing_share) {
    drop_third(ranges);
  }
  return ranges;
}

}  // namespace mellin::host
