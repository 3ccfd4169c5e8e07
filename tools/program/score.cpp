// mellin score: a trajectory against ground truth.
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "host/scorer.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

struct ScoreOptions {
  std::string estimate;
  std::string truth;
  std::string relations;
  double gap_s = 1.0;
  bool json = false;
};

void run(const ScoreOptions& options) {
  const std::vector<host::StampedPose> estimate = host::read_tum(options.estimate);
  const host::TrajectoryScore score = host::score_trajectory(estimate, host::read_tum(options.truth));
  std::optional<host::RelativeError> relations;
  std::size_t total = 0;
  if (!options.relations.empty()) {
    const std::vector<host::Relation> list = host::read_relations(options.relations);
    total = list.size();
    relations = host::score_relations(estimate, list, options.gap_s);
  }
  const std::string text =
      options.json ? host::to_json(score, relations, total) : host::to_text(score, relations, total);
  std::fputs(text.c_str(), stdout);
  if (!score.scored) {
    throw std::runtime_error(options.estimate + ": expected at least 3 poses at stamps of " + options.truth +
                             ", found " + std::to_string(score.paired));
  }
}

}  // namespace

void add_score(CLI::App& app) {
  auto options = std::make_shared<ScoreOptions>();
  CLI::App* command = app.add_subcommand("score", "Scores a trajectory against ground truth");
  command->add_option("estimate", options->estimate, "the trajectory (TUM)")->required();
  command->add_option("truth", options->truth, "the true one (TUM)")->required();
  command->add_option("--relations", options->relations, "true relations between poses (Freiburg SLAM benchmark)");
  command->add_option("--gap", options->gap_s, "leave out relations farther than this from a pose, s")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--json", options->json, "print JSON");
  command->callback([options] { run(*options); });
}

}  // namespace mellin::program
