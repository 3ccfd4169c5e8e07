// mellin match: registers two occupancy grids.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "host/explain_registration.hpp"
#include "host/grid_image.hpp"
#include "host/grid_registration.hpp"
#include "host/registration_trace.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

struct MatchCommand {
  std::string a;
  std::string b;
  std::string mask_a;
  std::string mask_b;
  std::string explain;
  double resolution_m = 0.05;
  bool all = false;
};

host::OccupancyImage read(const std::string& path, const std::string& mask) {
  host::OccupancyImage image = host::read_occupancy_image(path);
  if (!mask.empty()) {
    host::apply_mask(image, mask);
  }
  return image;
}

void explain(const MatchCommand& command, const host::OccupancyImage& a, const host::OccupancyImage& b,
             const host::PaddedPair& pair) {
  const auto name = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  host::write_explanation({name(command.a), name(command.b), a, b, command.resolution_m},
                          host::trace_registration(pair), command.explain);
}

void run(const MatchCommand& command) {
  const host::OccupancyImage a = read(command.a, command.mask_a);
  const host::OccupancyImage b = read(command.b, command.mask_b);
  const auto start = std::chrono::steady_clock::now();
  const host::PaddedPair pair = host::pad(a, b, command.resolution_m);
  const std::vector<host::GridHypothesis> hypotheses = host::register_grids(pair);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (!command.explain.empty()) {
    explain(command, a, b, pair);
  }

  nlohmann::ordered_json out;
  out["hypotheses"] = nlohmann::ordered_json::array();
  for (const host::GridHypothesis& h : hypotheses) {
    if (command.all || h.confidence >= host::kAcceptedConfidence) {
      out["hypotheses"].push_back({{"x", h.a_T_b.x},
                                   {"y", h.a_T_b.y},
                                   {"theta", h.a_T_b.theta},
                                   {"confidence", h.confidence},
                                   {"peak", h.peak},
                                   {"agreement", h.agreement}});
    }
  }
  out["seconds"] = seconds.count();
  std::printf("%s\n", out.dump().c_str());
}

}  // namespace

void add_match(CLI::App& app) {
  auto match = std::make_shared<MatchCommand>();
  CLI::App* command = app.add_subcommand(
      "match",
      "Registers two occupancy grids (PGM or PNG: dark occupied, light free, 205 unobserved; of any sizes up to 8192 "
      "pixels a side, a whole map and a part of it among them) and prints the poses of B's frame in A's as JSON, best "
      "first. Frames have their origin at the lower left corner. The confidence is the probability that the pose is "
      "right, within 0.5 m and 4 degrees; a pose is a match from 0.5 on");
  command->add_option("A", match->a, "a grid")->required();
  command->add_option("B", match->b, "the grid to be placed in it")->required();
  command->add_option("--mask-a", match->mask_a, "picture that is white where A is observed");
  command->add_option("--mask-b", match->mask_b, "picture that is white where B is observed");
  command->add_option("--resolution", match->resolution_m, "edge of a cell, m")
      ->check(CLI::Range(host::kFinestResolution_m, host::kCoarsestResolution_m))
      ->capture_default_str();
  command->add_flag("--all", match->all, "print the hypotheses under the acceptance threshold (0.5) too");
  command->add_option("--explain", match->explain,
                      "folder for a page with a picture of every step, of what was tried and what came of it");
  command->callback([match] { run(*match); });
}

}  // namespace mellin::program
