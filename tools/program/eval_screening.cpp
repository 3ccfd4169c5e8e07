// mellin eval screening: how well overlapping submaps are told from others (paper, Section V-A, Figs. 3 to 5).
#include <cstdio>
#include <memory>

#include "host/eval_curves.hpp"
#include "host/file.hpp"
#include "host/table.hpp"
#include "program/commands.hpp"
#include "program/eval_data.hpp"

namespace mellin::program {
namespace {

using host::Decision;
using host::fixed;
using host::PrecisionRecall;

struct ScreeningOptions {
  EvalOptions common;
  EvalChoice choice;
  std::vector<int> figures{3, 4, 5};
};

EvalFigure figure_3(const std::string& method) {
  EvalFigure figure{"fig3-" + method, "Match detection, unprocessed, peak position (" + method + " matcher)", {}};
  for (const std::uint16_t scans : kContexts) {
    EvalPanel panel{"Context: " + std::to_string(scans) + " scans", {}};
    for (const int com : {0, 1, 2}) {
      panel.curves.push_back({"CoM" + std::to_string(com), {scans, 100.0, com, "none", method}});
    }
    figure.panels.push_back(panel);
  }
  return figure;
}

EvalFigure figure_4(const std::string& method) {
  EvalFigure figure{"fig4-" + method, "Match detection, preprocessing (" + method + " matcher)", {}};
  for (const std::uint16_t scans : kContexts) {
    EvalPanel panel{"Context: " + std::to_string(scans) + " scans", {}};
    for (const char* preprocessing : {"none", "erosion", "blur"}) {
      panel.curves.push_back({preprocessing, {scans, 100.0, 1, preprocessing, method}});
    }
    figure.panels.push_back(panel);
  }
  return figure;
}

EvalFigure figure_5(const std::string& method) {
  EvalFigure figure{"fig5-" + method, "Match detection at reduced scale (" + method + " matcher)", {}};
  for (const double scale : {50.0, 25.0, 12.5, 6.25}) {
    EvalPanel panel{"Scale: " + fixed(scale, 2) + " %", {}};
    for (const char* preprocessing : {"erosion", "blur"}) {
      panel.curves.push_back({preprocessing, {40, scale, EvalCurve::kOwnFit, preprocessing, method}});
    }
    figure.panels.push_back(panel);
  }
  return figure;
}

std::vector<EvalFigure> figures_of(const ScreeningOptions& o) {
  if (o.choice.any()) {
    return {figure_of(o.choice, "Match detection")};
  }
  std::vector<EvalFigure> figures;
  for (const std::string& method : o.choice.methods) {
    for (const int number : o.figures) {
      figures.push_back(number == 3 ? figure_3(method) : number == 4 ? figure_4(method) : figure_5(method));
    }
  }
  return figures;
}

/// What a pair has to be to count.
enum class Judged {
  overlap,  ///< detection alone; the paper's definition of overlap
  united,   ///< detection alone, by intersection over union
  joint,    ///< positive and negative pairs; right only with the right pose
  all,      ///< all pairs, those of 10 to 40 % overlap included, judged by pose alone
};
constexpr Judged kJudged[] = {Judged::overlap, Judged::united, Judged::joint, Judged::all};

const char* to_string(Judged judged) {
  switch (judged) {
    case Judged::overlap:
      return "overlap";
    case Judged::united:
      return "union";
    case Judged::joint:
      return "joint";
    case Judged::all:
      break;
  }
  return "all-by-pose";
}

std::vector<Decision> decisions_of(const std::vector<host::EvalPair>& pairs,
                                   const std::vector<host::PoseDecision>& poses, Judged judged) {
  std::vector<Decision> decisions;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double overlap = judged == Judged::united ? pairs[i].union_overlap : pairs[i].overlap;
    const bool positive = overlap >= host::kPositiveOverlap;
    if (!positive && overlap > host::kNegativeOverlap && judged != Judged::all) {
      continue;
    }
    const bool pose_right = host::PoseLimits{}.hold(poses[i]);
    const bool right = judged == Judged::all ? pose_right : judged == Judged::joint ? positive && pose_right : positive;
    decisions.push_back({poses[i].score, positive, right, pairs[i].weight});
  }
  return decisions;
}

/// What it is measured against, for submaps in random orientation.
struct Goal {
  double average_precision = 0.0;
  double recall_99 = 0.0;
};
bool goal_of(const std::string& building, const std::string& frames, const EvalCurve& curve, Judged judged,
             Goal& goal) {
  if (frames != "random" || curve.scans != 40 || curve.method != "best") {
    return false;
  }
  if (judged == Judged::overlap && curve.scale == 25.0 && (building == "intel" || building == "fr079")) {
    goal = building == "intel" ? Goal{0.99, 0.95} : Goal{0.97, 0.80};
    return true;
  }
  if (judged == Judged::overlap && curve.scale == 12.5 && (building == "intel" || building == "fr079")) {
    goal = building == "intel" ? Goal{0.99, 0.91} : Goal{0.955, 0.70};
    return true;
  }
  goal = {0.995, 0.97};
  return judged == Judged::united && curve.scale == 12.5;
}

class ScreeningEvaluation {
 public:
  explicit ScreeningEvaluation(const ScreeningOptions& options)
      : options_(options),
        summary_({"log", "frames", "scans", "scale", "com", "preprocessing", "method", "score", "judged", "pairs",
                  "positives", "average_precision", "recall_at_p99", "recall_at_p95", "best_f1", "goal_ap",
                  "goal_recall_at_p99"}),
        printed_({"log", "frames", "scans", "scale", "com", "preprocessing", "method", "score", "pairs", "AP", "R@.99",
                  "(goal)", "union AP", "R@.99", "(goal)", "joint AP", "R@.99", "all AP", "R@.99"}),
        curves_({"log", "frames", "scans", "scale", "com", "preprocessing", "method", "score", "judged", "threshold",
                 "precision", "recall"}) {}

  void run() {
    for (const EvalBuilding& building : load_buildings(options_.common)) {
      for (const std::string& frames : options_.common.frames) {
        run(building, frames);
      }
    }
    host::write_file(options_.common.directory + "/screening.csv", summary_.csv());
    host::write_file(options_.common.directory + "/screening-curves.csv", curves_.csv());
    std::fputs(printed_.text().c_str(), stdout);
  }

 private:
  using Found = std::map<std::string, std::vector<PrecisionRecall>>;  ///< by score

  void run(const EvalBuilding& building, const std::string& frames) {
    EvalSets sets(building, options_.common, frames_named(frames));
    std::map<std::string, Found> done;
    for (const EvalFigure& figure : figures_of(options_)) {
      for (const EvalPanel& panel : figure.panels) {
        for (const auto& [label, curve] : panel.curves) {
          if (done.count(curve.key()) == 0) {
            done[curve.key()] = evaluate(building.name, frames, curve, sets.of(curve.scans));
          }
        }
      }
      draw(building.name, frames, figure, done);
    }
  }

  /// The curves of detection by each score; fills the tables.
  Found evaluate(const std::string& building, const std::string& frames, const EvalCurve& curve,
                 const EvalSets::Set& set) {
    host::MatchVariant variant;
    variant.matcher = curve.matcher();
    const std::vector<host::EvalPair> pairs = chosen_pairs(set.pairs, options_.common, curve.side());
    show_progress(options_.common, building + ", " + frames + " frames, " + curve.key() + ": " +
                                       std::to_string(pairs.size()) + " of " + std::to_string(set.pairs.size()) +
                                       " pairs");
    const std::vector<std::vector<host::FoundPose>> found =
        host::match_pairs(set.submaps, pairs, variant, options_.common.threads);
    Found result;
    for (const char* score : {"peak", "agreement", "rank"}) {
      const std::vector<host::PoseDecision> poses = host::pose_decisions(pairs, found, score_named(score));
      std::vector<std::string> row{building, frames};
      const std::vector<std::string> cells = curve.cells();
      row.insert(row.end(), cells.begin(), cells.end());
      row.emplace_back(score);
      std::vector<std::string> printed = row;
      printed.push_back(std::to_string(pairs.size()));
      for (const Judged judged : kJudged) {
        const std::vector<Decision> decisions = decisions_of(pairs, poses, judged);
        const std::vector<PrecisionRecall> points = host::precision_recall(decisions);
        Goal goal;
        const bool has_goal = goal_of(building, frames, curve, judged, goal);
        record(row, judged, decisions, points, has_goal ? &goal : nullptr, printed);
        if (judged == Judged::overlap) {
          result[score] = points;
        }
      }
      printed_.add(printed);
    }
    return result;
  }

  /// A row of the summary and of the curves, and its share of the printed row.
  void record(const std::vector<std::string>& name, Judged judged, const std::vector<Decision>& decisions,
              const std::vector<PrecisionRecall>& points, const Goal* goal, std::vector<std::string>& printed) {
    std::size_t positives = 0;
    for (const Decision& d : decisions) {
      positives += d.wanted ? 1U : 0U;
    }
    const std::string precision = fixed(host::average_precision(points));
    const std::string recall = fixed(host::recall_at_precision(points, 0.99));
    const std::string goal_precision = goal != nullptr ? fixed(goal->average_precision) : "";
    const std::string goal_recall = goal != nullptr ? fixed(goal->recall_99) : "";
    std::vector<std::string> row = name;
    row.insert(row.end(), {to_string(judged), std::to_string(decisions.size()), std::to_string(positives), precision,
                           recall, fixed(host::recall_at_precision(points, 0.95)), fixed(host::best_f1(points)),
                           goal_precision, goal_recall});
    summary_.add(row);
    printed.insert(printed.end(), {precision, recall});
    if (judged == Judged::overlap || judged == Judged::united) {
      printed.push_back(goal != nullptr ? "(" + goal_precision + " " + goal_recall + ")" : "");
    }
    for (const PrecisionRecall& p : points) {
      row = name;
      row.insert(row.end(), {to_string(judged), fixed(p.threshold, 5), fixed(p.precision, 5), fixed(p.recall, 5)});
      curves_.add(row);
    }
  }

  void draw(const std::string& building, const std::string& frames, const EvalFigure& figure,
            const std::map<std::string, Found>& done) const {
    for (const char* score : {"peak", "agreement", "rank"}) {
      std::vector<host::PlotPanel> panels;
      for (const EvalPanel& panel : figure.panels) {
        host::PlotPanel plot{panel.title, {"Recall", 0.5, 1.0}, {"Precision", 0.5, 1.0}, {}, {}};
        for (const auto& [label, curve] : panel.curves) {
          std::vector<host::PlotPoint> points;
          for (const PrecisionRecall& p : done.at(curve.key()).at(score)) {
            points.push_back({p.recall, p.precision});
          }
          plot.series.push_back({label, thinned(points), plot.series.size(), false});
        }
        panels.push_back(plot);
      }
      write_figure(options_.common.directory, figure.name + "-" + building + "-" + frames + "-" + score,
                   figure.title + ": " + building + ", " + frames + " frames, by " + score, panels);
    }
  }

  const ScreeningOptions& options_;
  host::Table summary_;
  host::Table printed_;  ///< the same with a row for all that pairs are judged by
  host::Table curves_;
};

}  // namespace

void add_eval_screening(CLI::App& eval) {
  auto options = std::make_shared<ScreeningOptions>();
  CLI::App* command = eval.add_subcommand(
      "screening", "Precision and recall of match detection (Figs. 3 to 5), or of the combinations asked for");
  add_eval_options(*command, options->common);
  command->add_option("--figures", options->figures, "3, 4, 5")
      ->delimiter(',')
      ->check(CLI::Range(3, 5))
      ->default_str("3,4,5");
  add_choice_options(*command, options->choice);
  command->callback([options] { ScreeningEvaluation(*options).run(); });
}

}  // namespace mellin::program
