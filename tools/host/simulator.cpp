// The log: the drive, what the laser and the wheels say on it, the files.
#include "host/simulator.hpp"

#include <cstdio>

#include "host/file.hpp"
#include "host/sim_disturb.hpp"

namespace mellin::host {
namespace {

constexpr double kSessionApart_s = 100000.0;

/// The step that the wheels report for a true one.
Pose2 odometry_step(const SimOptions& options, const Pose2& step, Random& random) {
  const double way = translation(step);
  const double scale = 1.0 + options.scale_error + options.way_noise * random.normal();
  const double turned = way > 0.0 || step.theta != 0.0 ? options.turn_noise_rad * random.normal() : 0.0;
  return {step.x * scale, step.y * scale, wrap_angle(step.theta + options.turn_error_rad_per_m * way + turned)};
}

/// Where the wheels' frame lies: each session but the first has one of its own.
Pose2 odometry_start(const SimOptions& options, int session) {
  if (session == 0) {
    return {};
  }
  Random frame = random_stream(options, SimStream::frame, session);
  return {20.0 * frame.uniform() - 10.0, 20.0 * frame.uniform() - 10.0, wrap_angle(kTwoPi * frame.uniform())};
}

}  // namespace

SimSession simulate(const SimOptions& options, int session) {
  const Floor floor = make_floor(options, session);
  const RayGrid walls(obstacles(floor));
  const std::vector<Move> moves = disturbed_moves(options, session, drive_session(options, floor, session), walls);
  Laser laser(options, session, walls);
  Random wheels = random_stream(options, SimStream::wheels, session);
  Pose2 odometry = odometry_start(options, session);
  SimSession result;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const Move& move = moves[i];
    if (i > 0) {
      odometry = compose(odometry, odometry_step(options, move.turned_wheels, wheels));
      result.path_m += move.carried ? 0.0 : translation(between(moves[i - 1].to.pose, move.to.pose));
    }
    result.scans.push_back({kSessionApart_s * session + move.to.seconds, move.to.pose, odometry, laser.scan(move.to)});
  }
  return result;
}

namespace {

std::string carmen_line(const SimScan& scan) {
  char text[256];
  std::string line = "FLASER " + std::to_string(scan.ranges.size());
  for (const float range : scan.ranges) {
    (void)std::snprintf(text, sizeof(text), " %.2f", static_cast<double>(range));
    line += text;
  }
  const Pose2& o = scan.odometry_T_base;
  (void)std::snprintf(text, sizeof(text), " %.6f %.6f %.6f %.6f %.6f %.6f %.6f sim %.6f\n", o.x, o.y, o.theta, o.x, o.y,
                      o.theta, scan.seconds, scan.seconds);
  return line + text;
}

/// Half angles through the library's own sine, so that the file's bytes do not depend on libm.
std::string tum_line(const SimScan& scan) {
  char text[256];
  const Pose2& p = scan.world_T_base;
  const SinCos half = sincos(p.theta / 2.0);
  (void)std::snprintf(text, sizeof(text), "%.6f %.6f %.6f 0 0 0 %.9f %.9f\n", scan.seconds, p.x, p.y, half.sin,
                      half.cos);
  return text;
}

}  // namespace

std::vector<std::string> write_simulation(const SimOptions& options, const std::string& directory) {
  std::vector<std::string> logs;
  for (int k = 0; k < options.sessions; ++k) {
    const SimSession session = simulate(options, k);
    std::string log = "# simulated, seed " + std::to_string(options.seed) + ", session " + std::to_string(k) + "\n";
    std::string truth;
    for (const SimScan& scan : session.scans) {
      log += carmen_line(scan);
      truth += tum_line(scan);
    }
    const std::string stem = directory + "/sim-" + std::to_string(k);
    write_file(stem + ".log", log);
    write_file(stem + ".tum", truth);
    logs.push_back(stem + ".log");
  }
  return logs;
}

}  // namespace mellin::host
