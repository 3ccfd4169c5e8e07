// mellin sim: simulated logs with their truth.
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "host/simulator.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

using host::SimKind;
using host::SimOdometry;

/// What the kind of building and the preset of the odometry decide where an option does not.
struct SimCommand {
  host::SimOptions options;
  std::string directory;
  SimKind kind = SimKind::ring;
  std::optional<SimOdometry> odometry;
  std::optional<double> path_m;
  std::optional<double> range_m;
  std::optional<double> scale_error;
  std::optional<double> turn_error;
};

host::SimOptions complete(const SimCommand& command) {
  const host::SimOptions usual = host::options_for(command.kind);
  host::SimOptions o = command.options;
  o.kind = command.kind;
  o.path_m = command.path_m.value_or(usual.path_m);
  o.range_m = command.range_m.value_or(usual.range_m);
  if (command.odometry) {
    host::set_odometry(o, *command.odometry);
  }
  o.scale_error = command.scale_error.value_or(o.scale_error);
  o.turn_error_rad_per_m = command.turn_error.value_or(o.turn_error_rad_per_m);
  return o;
}

void run(const SimCommand& command) {
  std::filesystem::create_directories(command.directory);
  for (const std::string& log : host::write_simulation(complete(command), command.directory)) {
    std::printf("%s\n", log.c_str());
  }
}

}  // namespace

void add_sim(CLI::App& app) {
  static const std::map<std::string, SimKind> kKinds{{"ring", SimKind::ring}, {"offices", SimKind::offices},
                                                     {"hall", SimKind::hall}, {"corridor", SimKind::corridor},
                                                     {"flat", SimKind::flat}, {"cave", SimKind::cave}};
  static const std::map<std::string, SimOdometry> kOdometries{{"good", SimOdometry::good},
                                                              {"plain", SimOdometry::plain},
                                                              {"poor", SimOdometry::poor},
                                                              {"slipping", SimOdometry::slipping}};
  auto sim = std::make_shared<SimCommand>();
  host::SimOptions& o = sim->options;
  CLI::App* command = app.add_subcommand("sim", "Writes simulated logs of a building with their exact truth");
  command->add_option("-o,--output", sim->directory, "folder for sim-K.log and sim-K.tum")->required();
  const auto number = [command](const char* name, auto& value, const char* text, double low, double high) {
    return command->add_option(name, value, text)->check(CLI::Range(low, high));
  };
  command->add_option("--kind", sim->kind, "building: ring, offices, hall, corridor, flat, cave")
      ->transform(CLI::CheckedTransformer(kKinds))
      ->default_str("ring");
  command->add_option("--seed", o.seed, "of the floor, the drive and the noise")->capture_default_str();
  number("--sessions", o.sessions, "logs; each starts elsewhere", 1, 100)->capture_default_str();
  number("--change", o.change, "share of furniture and doors changed between sessions", 0, 1)->capture_default_str();
  number("--bare-bends", o.bare_bends, "ring: bends with smooth walls", 0, 4)->capture_default_str();
  number("--loops", o.loops, "ring: times round it in a session", 1, 50)->capture_default_str();
  number("--path", sim->path_m, "other kinds: way of a session, m; each kind has its own", 10, 10000);
  command->add_option("--beams", o.beams, "of a scan: 180, 181, 360 or 361 over 180 degrees")
      ->check(CLI::IsMember({180, 181, 360, 361}))
      ->capture_default_str();
  number("--range", sim->range_m, "reach of the laser, m; each kind has its own", 1, 79);
  number("--spacing", o.spacing_m, "way between scans, m", 0.01, 2)->capture_default_str();
  number("--range-noise", o.range_noise_m, "deviation of a range, m", 0, 1)->capture_default_str();
  command->add_option("--odometry", sim->odometry, "good, plain, poor or slipping, with signs from the seed")
      ->transform(CLI::CheckedTransformer(kOdometries));
  number("--scale-error", sim->scale_error, "odometry: share by which a way reads too long", -0.5, 0.5);
  number("--turn-error", sim->turn_error, "odometry: bias of the heading, rad/m", -0.5, 0.5);
  number("--people", o.people, "that walk before the robot", 0, 100)->capture_default_str();
  number("--glass", o.glass_share, "share of the pieces of wall that most beams pass", 0, 1)->capture_default_str();
  number("--missing", o.missing_share, "share of the scans that lack a third of their beams", 0, 1)
      ->capture_default_str();
  number("--stops", o.stops, "stands of a minute", 0, 100)->capture_default_str();
  number("--pushes", o.pushes, "of half a metre to the side, unseen by the odometry", 0, 100)->capture_default_str();
  number("--slips", o.slips, "of the wheels, 0.5 to 1 m without motion", 0, 100)->capture_default_str();
  number("--kidnaps", o.kidnaps, "times that the robot is carried 10 m or more, unseen", 0, 100)->capture_default_str();
  command->callback([sim] { run(*sim); });
}

}  // namespace mellin::program
