// mellin sim: simulated logs with their truth.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "host/simulator.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

struct SimCommand {
  host::SimOptions options;
  std::string directory;
};

void run(const SimCommand& command) {
  std::filesystem::create_directories(command.directory);
  for (const std::string& log : host::write_simulation(command.options, command.directory)) {
    std::printf("%s\n", log.c_str());
  }
}

}  // namespace

void add_sim(CLI::App& app) {
  auto sim = std::make_shared<SimCommand>();
  host::SimOptions& o = sim->options;
  CLI::App* command = app.add_subcommand("sim", "Writes simulated logs of an office floor with their exact truth");
  command->add_option("-o,--output", sim->directory, "folder for sim-K.log and sim-K.tum")->required();
  const auto number = [command](const char* name, auto& value, const char* text, double low, double high) {
    command->add_option(name, value, text)->check(CLI::Range(low, high))->capture_default_str();
  };
  command->add_option("--seed", o.seed, "of the floor, the drive and the noise")->capture_default_str();
  number("--sessions", o.sessions, "logs; each starts elsewhere", 1, 100);
  number("--change", o.change, "share of furniture and doors changed between sessions", 0, 1);
  number("--bare-bends", o.bare_bends, "bends of the ring with smooth walls", 0, 4);
  number("--loops", o.loops, "times round the ring in a session", 1, 50);
  command->add_option("--beams", o.beams, "of a scan: 180 or 360 over 180 degrees")
      ->check(CLI::IsMember({180, 360}))
      ->capture_default_str();
  number("--range", o.range_m, "reach of the laser, m", 1, 79);
  number("--spacing", o.spacing_m, "way between scans, m", 0.01, 2);
  number("--range-noise", o.range_noise_m, "deviation of a range, m", 0, 1);
  number("--scale-error", o.scale_error, "odometry: share by which a way reads too long", -0.5, 0.5);
  number("--turn-error", o.turn_error_rad_per_m, "odometry: bias of the heading, rad/m", -0.5, 0.5);
  command->callback([sim] { run(*sim); });
}

}  // namespace mellin::program
