#include "host/sim_drive.hpp"

#include <cmath>

namespace mellin::host {
namespace {

constexpr double kSpeed_m_s = 0.5;
constexpr double kTurnSpeed_rad_s = 0.7;
constexpr double kLeastStep_m = 0.005;
constexpr double kLeastStep_rad = 0.005;
constexpr double kSharp_rad = 0.35;  // a corner of more is turned on the spot

}  // namespace

Drive::Drive(const SimOptions& options, const Pose2& start)
    : spacing_m_(options.spacing_m), turn_rad_(options.turn_rad), poses_{{0.0, start}} {}

void Drive::move_to(const Pose2& next) {
  const double way = translation(between(pose(), next));
  const double turn = std::fabs(wrap_angle(next.theta - pose().theta));
  if (way < kLeastStep_m && turn < kLeastStep_rad) {
    return;
  }
  poses_.push_back({poses_.back().seconds + way / kSpeed_m_s + turn / kTurnSpeed_rad_s, next});
}

void Drive::turn_by(double angle) {
  const int steps = static_cast<int>(std::ceil(std::fabs(angle) / turn_rad_));
  const Pose2 from = pose();
  for (int i = 1; i <= steps; ++i) {
    move_to({from.x, from.y, wrap_angle(from.theta + angle * i / steps)});
  }
}

void Drive::turn_to(double theta) { turn_by(wrap_angle(theta - pose().theta)); }

void Drive::go_to(Point2 to) {
  const Pose2 from = pose();
  const double theta = mellin::atan2(to.y - from.y, to.x - from.x);
  turn_to(theta);
  const double way = translation(between(from, {to.x, to.y, 0.0}));
  const int steps = static_cast<int>(std::ceil(way / spacing_m_));
  for (int i = 1; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    move_to({from.x + share * (to.x - from.x), from.y + share * (to.y - from.y), theta});
  }
}

void Drive::follow(const std::vector<Point2>& line) {
  double rest = spacing_m_;  // to the next scan
  double heading = pose().theta;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Point2 from = line[i];
    const Point2 to = line[i + 1];
    const double theta = mellin::atan2(to.y - from.y, to.x - from.x);
    const bool sharp = std::fabs(wrap_angle(theta - heading)) > kSharp_rad;
    if (sharp || std::fabs(wrap_angle(theta - pose().theta)) > turn_rad_) {
      move_to({from.x, from.y, heading});
      rest = spacing_m_;
    }
    if (sharp) {
      turn_to(theta);
    }
    heading = theta;
    const double length = distance(from, to);
    double along = 0.0;
    while (length - along >= rest) {
      along += rest;
      rest = spacing_m_;
      const Point2 at = between_points(from, to, along / length);
      move_to({at.x, at.y, theta});
    }
    rest -= length - along;
  }
  move_to({line.back().x, line.back().y, heading});
}

Drive drive_session(const SimOptions& options, const Floor& floor, int session) {
  if (options.kind == SimKind::ring) {
    return drive_ring(options, floor, session);
  }
  Random random = random_stream(options, SimStream::drive, session);
  const std::vector<Point2> line = plan_tour(floor, options.path_m, random);
  Drive drive(options, {line[0].x, line[0].y, mellin::atan2(line[1].y - line[0].y, line[1].x - line[0].x)});
  drive.follow(line);
  return drive;
}

}  // namespace mellin::host
