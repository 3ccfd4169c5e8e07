// What the kinds of `mellin eval` have in common: logs with their truth, submaps, pairs.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host/eval_matching.hpp"
#include "host/eval_submaps.hpp"
#include "host/plot.hpp"

namespace mellin::program {

struct EvalOptions {
  std::vector<std::string> logs;
  std::vector<std::string> truths;  ///< one a log; empty: beside it, .tum in place of .log or .log.gz
  std::string directory;
  std::vector<std::string> frames{"random"};
  std::size_t pairs = 300;  ///< sampled where a pair costs much; 0: all
  bool full = false;        ///< all pairs everywhere
  bool together = false;    ///< all logs are sessions in one building, in one truth frame
  std::uint64_t seed = 1;
  std::uint16_t particles = 1;
  std::size_t threads = 1;
  bool progress = false;
};

/// LOG…, --truth, -o, --frames, --pairs, --full, --together, --seed, --particles, --threads, --progress.
void add_eval_options(CLI::App& command, EvalOptions& options);

/// One building: a log, or several together.
struct EvalBuilding {
  std::string name;
  std::vector<host::LiveDrive> drives;
};

/// Reads the logs and maps them; makes the output folder. Throws CLI::ValidationError where the numbers of logs and
/// truths differ, std::runtime_error where a file is at fault.
std::vector<EvalBuilding> load_buildings(const EvalOptions& options);

/// Submaps of K scans of a building and their pairs, made once.
class EvalSets {
 public:
  struct Set {
    std::vector<host::EvalSubmap> submaps;
    std::vector<host::EvalPair> pairs;
  };
  EvalSets(const EvalBuilding& building, const EvalOptions& options, host::SubmapFrames frames)
      : building_(building), options_(options), frames_(frames) {}
  const Set& of(std::uint16_t scans);

 private:
  const EvalBuilding& building_;
  const EvalOptions& options_;
  host::SubmapFrames frames_;
  std::map<std::uint16_t, Set> sets_;
};

/// Sides for which a pair costs so much that pairs are sampled.
inline constexpr std::uint16_t kSampledFromSide = 384;

/// The pairs that are evaluated at a side: sampled or all.
std::vector<host::EvalPair> chosen_pairs(const std::vector<host::EvalPair>& pairs, const EvalOptions& options,
                                         std::uint16_t side);

/// What one curve is measured with.
struct EvalCurve {
  std::uint16_t scans = 40;
  double scale = 100.0;  ///< per cent of the submap's pixels
  int com = kOwnFit;     ///< radius of the peak's centre of mass, or how the matcher fits peaks by itself
  std::string preprocessing = "erosion";
  std::string method = "best";

  std::uint16_t side() const { return static_cast<std::uint16_t>(kFullSide * scale / 100.0); }
  MatcherConfig matcher() const;
  /// As cells of a table, under curve_columns().
  std::vector<std::string> cells() const;
  std::string key() const;

  static constexpr double kFullSide = 768.0;
  static constexpr int kOwnFit = -1;
};
std::vector<std::string> curve_columns();

/// Combinations asked for on the command line instead of the paper's figures.
struct EvalChoice {
  std::vector<std::string> methods{"best", "paper"};
  std::vector<double> scales;
  std::vector<std::uint16_t> scans;
  std::vector<int> com;
  std::vector<std::string> preprocessing;

  bool any() const { return !scales.empty() || !scans.empty() || !com.empty() || !preprocessing.empty(); }
  /// Every combination; what was left open is 40 scans, 25 %, the matcher's own fit of peaks, erosion.
  std::vector<EvalCurve> combinations() const;
};
/// --method, --scales, --scans, --com, --preprocessing.
void add_choice_options(CLI::App& command, EvalChoice& choice);

/// Curves drawn into one panel, with their labels.
struct EvalPanel {
  std::string title;
  std::vector<std::pair<std::string, EvalCurve>> curves;
};
struct EvalFigure {
  std::string name;
  std::string title;
  std::vector<EvalPanel> panels;
};
/// A panel for each number of scans and scale.
EvalFigure figure_of(const EvalChoice& choice, const std::string& title);

/// The whole registration as `mellin match` runs it: at the curve's scale, as many hypotheses aligned as can be.
RegistrationConfig registration_of(const EvalCurve& curve);

/// Scans a submap that the paper compares.
inline constexpr std::uint16_t kContexts[] = {20, 40, 80};

/// A line on standard error, where progress is shown.
void show_progress(const EvalOptions& options, const std::string& line);

host::SubmapFrames frames_named(const std::string& name);
host::PairScore score_named(const std::string& name);

/// At most so many points of a curve for a picture, evenly spread, the first and the last among them.
std::vector<host::PlotPoint> thinned(const std::vector<host::PlotPoint>& points, std::size_t count = 400);

/// Writes DIR/NAME.svg.
void write_figure(const std::string& directory, const std::string& name, const std::string& title,
                  const std::vector<host::PlotPanel>& panels);

}  // namespace mellin::program
