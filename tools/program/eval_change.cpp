// mellin eval change: how matching stands a building that changes between two sessions, and how far the threshold may
// be lowered for submaps that are apart in age (paper, Section IV-B3).
//
// Simulated buildings with exact truth, two sessions, a share of the furniture and the doors moved in between; pairs
// across the sessions. The age law: the score that most of the rightly registered pairs reach falls with the share
// that has changed; a line is fitted to it. What a lowered threshold costs is seen on buildings that had no part in
// the fit.
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>

#include "host/eval_curves.hpp"
#include "host/file.hpp"
#include "host/simulator.hpp"
#include "host/table.hpp"
#include "mellin/config.hpp"
#include "program/commands.hpp"
#include "program/eval_data.hpp"

namespace mellin::program {
namespace {

using host::fixed;
using host::PoseDecision;

/// Share of the rightly registered pairs that the threshold has to let pass.
constexpr double kKept = 0.9;

struct ChangeOptions {
  std::string directory;
  std::vector<double> changes{0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  std::vector<std::uint64_t> seeds{1, 2};
  std::vector<std::uint64_t> check{3, 4};
  host::SimKind kind = host::SimKind::offices;
  double path_m = 0.0;
  EvalOptions common;
};

/// The pairs of some buildings at one share of change, and what registration made of them.
struct Outcome {
  std::vector<PoseDecision> screened;    ///< by the peak, on digests of 96 pixels
  std::vector<PoseDecision> registered;  ///< by the whole registration
  std::vector<double> overlaps;          ///< of the pairs
};

void append(std::vector<PoseDecision>& to, const std::vector<PoseDecision>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// What a threshold does with the registered pairs of one share of change.
struct Effect {
  double recall = 0.0;
  std::size_t wrong = 0;
};

Effect effect_of(const std::vector<PoseDecision>& decisions, double threshold) {
  const host::Held held = host::hold_threshold(decisions, threshold);
  return {held.errors.recall, held.wrong};
}

/// The score that kKept of the rightly registered positive pairs reach; none where there is none.
std::optional<double> kept_score(const std::vector<PoseDecision>& decisions) {
  std::vector<host::Weighted> scores;
  for (const PoseDecision& d : decisions) {
    if (d.wanted && host::PoseLimits{}.hold(d)) {
      scores.push_back({d.score, d.weight});
    }
  }
  return scores.empty() ? std::nullopt : std::optional<double>(host::quantile(scores, 1.0 - kKept));
}

double best_wrong(const std::vector<PoseDecision>& decisions) {
  double best = 0.0;
  for (const PoseDecision& d : decisions) {
    best = host::PoseLimits{}.hold(d) ? best : std::max(best, d.score);
  }
  return best;
}

class ChangeEvaluation {
 public:
  explicit ChangeEvaluation(const ChangeOptions& options) : options_(options) {}

  void run() {
    std::filesystem::create_directories(options_.directory);
    std::map<double, Outcome> fitted;
    std::map<double, Outcome> checked;
    for (const double change : options_.changes) {
      fitted[change] = measure(change, options_.seeds);
      checked[change] = measure(change, options_.check);
    }
    const host::Line law = fit(fitted);
    write(fitted, checked, law);
  }

 private:
  Outcome measure(double change, const std::vector<std::uint64_t>& seeds) const {
    Outcome all;
    for (const std::uint64_t seed : seeds) {
      show_progress(options_.common, fixed(change, 2) + " changed, seed " + std::to_string(seed));
      const Outcome one = measure(change, seed);
      append(all.screened, one.screened);
      append(all.registered, one.registered);
      all.overlaps.insert(all.overlaps.end(), one.overlaps.begin(), one.overlaps.end());
    }
    return all;
  }

  Outcome measure(double change, std::uint64_t seed) const {
    host::SimOptions sim = host::options_for(options_.kind);
    sim.seed = seed;
    sim.sessions = 2;
    sim.change = change;
    sim.path_m = options_.path_m > 0.0 ? options_.path_m : sim.path_m;
    const std::string folder = options_.directory + "/sim-" + std::to_string(seed) + "-" + fixed(change, 2);
    std::filesystem::create_directories(folder);
    std::vector<host::LiveDrive> drives;
    for (const std::string& log : host::write_simulation(sim, folder)) {
      const std::string truth = log.substr(0, log.rfind('.')) + ".tum";
      drives.push_back(host::drive_live(host::read_carmen_log(log), host::read_tum(truth)));
    }
    std::filesystem::remove_all(folder);
    host::SubmapOptions submap_options;
    submap_options.seed = seed;
    const std::vector<host::EvalSubmap> submaps = host::make_submaps(drives, submap_options, options_.common.threads);
    const std::vector<host::EvalPair> pairs =
        host::sample_pairs(host::make_pairs(submaps, host::PairChoice::between_sessions), options_.common.pairs, seed);

    Outcome outcome;
    host::MatchVariant screening;
    screening.matcher.side = 96;
    outcome.screened = host::pose_decisions(
        pairs, host::match_pairs(submaps, pairs, screening, options_.common.threads), host::PairScore::peak);
    outcome.registered = host::pose_decisions(
        pairs, host::register_pairs(submaps, pairs, resolved(desktop_profile()).registration, options_.common.threads),
        host::PairScore::agreement);
    for (const host::EvalPair& pair : pairs) {
      outcome.overlaps.push_back(pair.overlap);
    }
    return outcome;
  }

  static host::Line fit(const std::map<double, Outcome>& fitted) {
    std::vector<double> shares;
    std::vector<double> scores;
    for (const auto& [change, outcome] : fitted) {
      const std::optional<double> score = kept_score(outcome.registered);
      if (score) {
        shares.push_back(change);
        scores.push_back(*score);
      }
    }
    if (shares.size() < 2) {
      throw std::runtime_error("expected rightly registered pairs at two shares of change, found them at " +
                               std::to_string(shares.size()));
    }
    return host::fit_line(shares, scores);
  }

  static std::vector<host::PrecisionRecall> detection(const Outcome& outcome) {
    std::vector<host::Decision> decisions;
    for (std::size_t i = 0; i < outcome.screened.size(); ++i) {
      const bool positive = outcome.screened[i].wanted;
      if (positive || outcome.overlaps[i] <= host::kNegativeOverlap) {
        decisions.push_back({outcome.screened[i].score, positive, positive, outcome.screened[i].weight});
      }
    }
    return host::precision_recall(decisions);
  }

  void write(const std::map<double, Outcome>& fitted, const std::map<double, Outcome>& checked,
             const host::Line& law) const {
    host::Table table({"buildings", "changed", "pairs", "positives", "detection_ap", "recall_at_p99", "right_pose",
                       "kept_score", "best_wrong", "fixed_recall", "fixed_wrong", "law_threshold", "law_recall",
                       "law_wrong"});
    host::PlotPanel detected{"Detection, 12.5 %", {"Share changed", 0.0, 0.6}, {"Recall, precision", 0.0, 1.0}, {}, {}};
    host::PlotPanel threshold{"Threshold", {"Share changed", 0.0, 0.6}, {"Score of registration", 0.0, 1.0}, {}, {}};
    host::PlotPanel recalls{"Registration", {"Share changed", 0.0, 0.6}, {"Recall", 0.0, 1.0}, {}, {}};
    std::size_t colour = 0;
    for (const auto* outcomes : {&fitted, &checked}) {
      const std::string name = outcomes == &fitted ? "fitted" : "checked";
      std::vector<host::PlotSeries> lines;
      for (const char* label : {"average precision", "recall at precision .99", "score that 90 % of the right reach",
                                "best wrong score", "recall, threshold fixed", "recall, threshold by the law"}) {
        lines.push_back({std::string(label) + " (" + name + ")", {}, lines.size() % 2, colour == 1});
      }
      for (const auto& [change, outcome] : *outcomes) {
        add_row(table, lines, name, change, outcome, law);
      }
      detected.series.insert(detected.series.end(), lines.begin(), lines.begin() + 2);
      threshold.series.insert(threshold.series.end(), lines.begin() + 2, lines.begin() + 4);
      recalls.series.insert(recalls.series.end(), lines.begin() + 4, lines.end());
      ++colour;
    }
    threshold.series.push_back({"the law", {{0.0, law.intercept}, {0.6, law.intercept + 0.6 * law.slope}}, 2, false});
    host::write_file(options_.directory + "/change.csv", table.csv());
    write_figure(options_.directory, "change", "Two sessions, furniture and doors changed in between",
                 {detected, threshold, recalls});
    std::fputs(table.text().c_str(), stdout);
    std::printf("\nThreshold of registration's score against the share changed: %.3f %+.3f * share\n", law.intercept,
                law.slope);
  }

  static void add_row(host::Table& table, std::vector<host::PlotSeries>& lines, const std::string& name, double change,
                      const Outcome& outcome, const host::Line& law) {
    const std::vector<host::PrecisionRecall> curve = detection(outcome);
    double positives = 0.0;
    double right = 0.0;
    for (const PoseDecision& d : outcome.registered) {
      positives += d.wanted ? d.weight : 0.0;
      right += d.wanted && host::PoseLimits{}.hold(d) ? d.weight : 0.0;
    }
    const double at = law.intercept + law.slope * change;
    const Effect unaged = effect_of(outcome.registered, law.intercept);
    const Effect aged = effect_of(outcome.registered, at);
    const double kept = kept_score(outcome.registered).value_or(0.0);
    const double wrong = best_wrong(outcome.registered);
    const double precision = host::average_precision(curve);
    const double recall = host::recall_at_precision(curve, 0.99);
    table.add({name, fixed(change, 2), std::to_string(outcome.registered.size()), fixed(positives, 0), fixed(precision),
               fixed(recall), fixed(positives > 0.0 ? right / positives : 0.0), fixed(kept), fixed(wrong),
               fixed(unaged.recall), std::to_string(unaged.wrong), fixed(at), fixed(aged.recall),
               std::to_string(aged.wrong)});
    const double values[] = {precision, recall, kept, wrong, unaged.recall, aged.recall};
    for (std::size_t i = 0; i < lines.size(); ++i) {
      lines[i].points.push_back({change, values[i]});
    }
  }

  const ChangeOptions& options_;
};

}  // namespace

void add_eval_change(CLI::App& eval) {
  static const std::map<std::string, host::SimKind> kKinds{
      {"ring", host::SimKind::ring}, {"offices", host::SimKind::offices}, {"flat", host::SimKind::flat}};
  auto options = std::make_shared<ChangeOptions>();
  CLI::App* command = eval.add_subcommand(
      "change", "Matching across two sessions of simulated buildings whose furniture moves; fits the age law");
  command->add_option("-o,--output", options->directory, "folder for tables and pictures; created")->required();
  command->add_option("--changes", options->changes, "shares of furniture and doors changed")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 1.0))
      ->default_str("0,0.1,…,0.6");
  command->add_option("--seeds", options->seeds, "buildings that the law is fitted on")
      ->delimiter(',')
      ->default_str("1,2");
  command->add_option("--check", options->check, "buildings that it is checked on")->delimiter(',')->default_str("3,4");
  command->add_option("--kind", options->kind, "building: offices, ring, flat")
      ->transform(CLI::CheckedTransformer(kKinds))
      ->default_str("offices");
  command->add_option("--path", options->path_m, "way of a session, m; the kind has its own")
      ->check(CLI::Range(20.0, 10000.0));
  command->add_option("--pairs", options->common.pairs, "pairs sampled of each building, a third positive; 0: all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--threads", options->common.threads, "threads; results do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command->add_flag("--progress", options->common.progress, "shows progress though standard error is no terminal");
  command->callback([options] { ChangeEvaluation(*options).run(); });
}

}  // namespace mellin::program
