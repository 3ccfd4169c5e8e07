// mellin eval registration: how exactly overlapping submaps are registered, and what is taken for something else
// (paper, Section V-B, Figs. 6 and 7).
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>

#include "host/eval_curves.hpp"
#include "host/file.hpp"
#include "host/table.hpp"
#include "mellin/config.hpp"
#include "program/commands.hpp"
#include "program/eval_data.hpp"

namespace mellin::program {
namespace {

using host::fixed;
using host::FoundPose;
using host::PairScore;
using host::PoseDecision;
using host::PoseErrors;

constexpr std::size_t kWorstListed = 20;
constexpr std::size_t kRanks[] = {1, 2, 4, 6};

struct RegistrationOptions {
  EvalOptions common;
  EvalChoice choice;
  std::vector<std::string> figures{"6", "7", "pipeline"};
  host::PoseLimits limits;
};

/// A curve by one way to come to a pose and its score.
struct Way {
  std::string name;
  PairScore score;
  bool pipeline;  ///< the whole registration instead of the matcher alone
};
const Way kByPeak{"peak", PairScore::peak, false};
const Way kByAgreement{"agreement", PairScore::agreement, false};
const Way kPipeline{"pipeline", PairScore::confidence, true};

struct Figure {
  EvalFigure figure;
  std::vector<Way> ways;  ///< a picture each
};

EvalFigure figure_6(const std::string& method) {
  EvalFigure figure{"fig6-" + method, "Registration, unprocessed, peak position (" + method + " matcher)", {}};
  for (const std::uint16_t scans : kContexts) {
    EvalPanel panel{std::to_string(scans) + " scans", {}};
    for (const int com : {0, 1, 2}) {
      panel.curves.push_back({"CoM" + std::to_string(com), {scans, 100.0, com, "none", method}});
    }
    figure.panels.push_back(panel);
  }
  return figure;
}

EvalFigure figure_7(const std::string& method) {
  EvalFigure figure{"fig7-" + method, "Registration, preprocessing (" + method + " matcher)", {{"40 scans", {}}}};
  for (const char* preprocessing : {"none", "erosion", "blur"}) {
    figure.panels[0].curves.push_back({preprocessing, {40, 100.0, 1, preprocessing, method}});
  }
  return figure;
}

/// The whole registration as the library's configurations have it: at a quarter of the scale, and at half.
EvalFigure figure_pipeline() {
  EvalFigure figure{"pipeline", "The whole registration: matched, verified, aligned", {}};
  for (const std::uint16_t scans : kContexts) {
    EvalPanel panel{std::to_string(scans) + " scans", {}};
    for (const double scale : {50.0, 25.0, 12.5}) {
      panel.curves.push_back({fixed(scale, 2) + " %", {scans, scale, EvalCurve::kOwnFit, "erosion", "best"}});
    }
    figure.panels.push_back(panel);
  }
  return figure;
}

std::vector<Figure> figures_of(const RegistrationOptions& o) {
  if (o.choice.any()) {
    return {{figure_of(o.choice, "Registration"), {kByPeak, kByAgreement, kPipeline}}};
  }
  std::vector<Figure> figures;
  for (const std::string& name : o.figures) {
    if (name == "pipeline") {
      figures.push_back({figure_pipeline(), {kPipeline}});
      continue;
    }
    for (const std::string& method : o.choice.methods) {
      figures.push_back({name == "6" ? figure_6(method) : figure_7(method), {kByPeak, kByAgreement}});
    }
  }
  return figures;
}

/// Whether the true pose is among the first `rank` hypotheses, in the order of their score.
bool right_among(std::vector<FoundPose> found, const host::EvalPair& pair, PairScore score, std::size_t rank,
                 const host::PoseLimits& limits) {
  std::stable_sort(found.begin(), found.end(), [score](const FoundPose& p, const FoundPose& q) {
    return host::score_of(p, score) > host::score_of(q, score);
  });
  for (std::size_t i = 0; i < std::min(rank, found.size()); ++i) {
    const host::PoseError error = host::pose_error(pair, found[i]);
    if (limits.hold({0.0, true, error.metres, error.degrees, 1.0})) {
      return true;
    }
  }
  return false;
}

/// The paper asks for the positive pairs alone; in a map every pair may come.
enum class Population { positives, all };
const char* to_string(Population population) { return population == Population::positives ? "positives" : "all"; }

std::vector<PoseDecision> population_of(const std::vector<PoseDecision>& decisions, Population population) {
  std::vector<PoseDecision> out;
  std::copy_if(decisions.begin(), decisions.end(), std::back_inserter(out),
               [population](const PoseDecision& d) { return d.wanted || population == Population::all; });
  return out;
}

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// What it is measured against, for submaps in random orientation.
std::string goal_of(const std::string& building, const std::string& frames, const EvalCurve& curve, const Way& way) {
  if (frames != "random" || curve.scans != 40 || !way.pipeline) {
    return "";
  }
  return building == "intel"   ? "recall 0.95"
         : building == "fr079" ? "recall 0.80"
         : building == "aces"  ? "first_6 0.95"
                               : "";
}

class RegistrationEvaluation {
 public:
  explicit RegistrationEvaluation(const RegistrationOptions& options)
      : options_(options),
        summary_(joined(joined({"log", "frames"}, curve_columns()),
                        {"score", "population", "pairs", "positives", "recall_before_error", "threshold", "median_m",
                         "max_m", "median_deg", "max_deg", "first_1", "first_2", "first_4", "first_6", "goal"})),
        curves_(joined(joined({"log", "frames"}, curve_columns()),
                       {"score", "population", "threshold", "recall", "median_m", "max_m", "median_deg", "max_deg"})),
        held_(joined(joined({"log", "frames"}, curve_columns()), {"score", "population", "threshold_of", "threshold",
                                                                  "accepted", "wrong", "recall", "max_m", "max_deg"})),
        confusions_(joined(joined({"log", "frames"}, curve_columns()),
                           {"score", "kind", "a", "b", "overlap", "value", "true_x", "true_y", "true_theta", "found_x",
                            "found_y", "found_theta", "metres", "degrees"})),
        kinds_(joined(joined({"log", "frames"}, curve_columns()),
                      {"score", "positives", "wrong", "near", "turned 180", "turned 90", "slid", "shifted", "other"})) {
  }

  void run() {
    for (const EvalBuilding& building : load_buildings(options_.common)) {
      for (const std::string& frames : options_.common.frames) {
        run(building, frames);
      }
    }
    const std::string& directory = options_.common.directory;
    host::write_file(directory + "/registration.csv", summary_.csv());
    host::write_file(directory + "/registration-curves.csv", curves_.csv());
    host::write_file(directory + "/confusions.csv", confusions_.csv());
    host::write_file(directory + "/confusion-kinds.csv", kinds_.csv());
    std::fputs(summary_.text().c_str(), stdout);
    std::printf("\nWrong poses of positive pairs, by kind\n%s", kinds_.text().c_str());
    if (held_.rows() > 0) {
      host::write_file(directory + "/thresholds.csv", held_.csv());
      std::printf("\nThe acceptance threshold of the first log on the others\n%s", held_.text().c_str());
    }
  }

 private:
  /// The positives' curves, by key and way.
  using Curves = std::map<std::string, std::vector<PoseErrors>>;

  void run(const EvalBuilding& building, const std::string& frames) {
    EvalSets sets(building, options_.common, frames_named(frames));
    Curves curves;
    for (const Figure& figure : figures_of(options_)) {
      for (const EvalPanel& panel : figure.figure.panels) {
        for (const auto& [label, curve] : panel.curves) {
          for (const Way& way : figure.ways) {
            if (curves.count(curve.key() + way.name) == 0) {
              evaluate(building.name, frames, curve, way, sets.of(curve.scans), curves);
            }
          }
        }
      }
      for (const Way& way : figure.ways) {
        draw(building.name, frames, figure.figure, way, curves);
      }
    }
  }

  std::vector<std::vector<FoundPose>> find(const EvalCurve& curve, bool pipeline, const EvalSets::Set& set,
                                           const std::vector<host::EvalPair>& pairs) const {
    if (!pipeline) {
      host::MatchVariant variant;
      variant.matcher = curve.matcher();
      variant.verified = kMaxMatchHypotheses;
      return host::match_pairs(set.submaps, pairs, variant, options_.common.threads);
    }
    return host::register_pairs(set.submaps, pairs, registration_of(curve), options_.common.threads);
  }

  /// Fills the tables for one curve; what the matcher finds serves both of its scores.
  void evaluate(const std::string& building, const std::string& frames, const EvalCurve& curve, const Way& way,
                const EvalSets::Set& set, Curves& curves) {
    const std::vector<host::EvalPair> pairs = chosen_pairs(set.pairs, options_.common, curve.side());
    show_progress(options_.common, building + ", " + frames + " frames, " + curve.key() + ", " + way.name + ": " +
                                       std::to_string(pairs.size()) + " of " + std::to_string(set.pairs.size()) +
                                       " pairs");
    const std::vector<std::vector<FoundPose>> found = find(curve, way.pipeline, set, pairs);
    for (const Way& scored : {kByPeak, kByAgreement, kPipeline}) {
      if (scored.pipeline == way.pipeline) {
        const std::vector<std::string> name = joined(joined({building, frames}, curve.cells()), {scored.name});
        const std::vector<PoseDecision> decisions = host::pose_decisions(pairs, found, scored.score);
        for (const Population population : {Population::positives, Population::all}) {
          const std::string goal = goal_of(building, frames, curve, scored);
          record(name, population, population_of(decisions, population), ranks(pairs, found, scored.score), goal);
        }
        curves[curve.key() + scored.name] = host::pose_errors(population_of(decisions, Population::positives));
        record_confusions(name, pairs, found, set, decisions, scored);
      }
    }
  }

  /// Share of the positive pairs whose true pose is among the first few hypotheses.
  std::vector<std::string> ranks(const std::vector<host::EvalPair>& pairs,
                                 const std::vector<std::vector<FoundPose>>& found, PairScore score) const {
    std::vector<std::string> out;
    for (const std::size_t rank : kRanks) {
      double right = 0.0;
      double positives = 0.0;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (pairs[i].overlap >= host::kPositiveOverlap) {
          positives += pairs[i].weight;
          right += right_among(found[i], pairs[i], score, rank, options_.limits) ? pairs[i].weight : 0.0;
        }
      }
      out.push_back(fixed(positives > 0.0 ? right / positives : 0.0));
    }
    return out;
  }

  void record(const std::vector<std::string>& name, Population population, const std::vector<PoseDecision>& decisions,
              const std::vector<std::string>& first, const std::string& goal) {
    const std::vector<std::string> row = joined(name, {to_string(population)});
    const auto positives = std::count_if(decisions.begin(), decisions.end(), [](const auto& d) { return d.wanted; });
    const std::optional<double> threshold = host::acceptance_threshold(decisions, options_.limits);
    const host::Held held = threshold ? host::hold_threshold(decisions, *threshold, options_.limits) : host::Held{};
    const PoseErrors& e = held.errors;
    summary_.add(joined(joined(row, {std::to_string(decisions.size()), std::to_string(positives), fixed(e.recall),
                                     threshold ? fixed(*threshold, 4) : "none", fixed(e.median_m), fixed(e.max_m),
                                     fixed(e.median_deg, 2), fixed(e.max_deg, 2)}),
                        joined(first, {goal})));
    for (const PoseErrors& p : host::pose_errors(decisions)) {
      curves_.add(joined(row, {fixed(p.threshold, 5), fixed(p.recall, 5), fixed(p.median_m, 4), fixed(p.max_m, 4),
                               fixed(p.median_deg), fixed(p.max_deg)}));
    }
    hold(row, decisions, threshold);
  }

  /// The first log's threshold, on the others (Section V-B).
  void hold(const std::vector<std::string>& row, const std::vector<PoseDecision>& decisions,
            const std::optional<double>& threshold) {
    std::string key;
    for (std::size_t i = 1; i < row.size(); ++i) {  // all but the log's name
      key += row[i] + " ";
    }
    const auto [first, is_first] = first_thresholds_.insert({key, {row[0], threshold}});
    const auto& [log, chosen] = first->second;
    if (is_first || !chosen) {
      return;
    }
    const host::Held held = host::hold_threshold(decisions, *chosen, options_.limits);
    held_.add(joined(row, {log, fixed(*chosen, 4), std::to_string(held.accepted), std::to_string(held.wrong),
                           fixed(held.errors.recall), fixed(held.errors.max_m, 2), fixed(held.errors.max_deg, 1)}));
  }

  void record_confusions(const std::vector<std::string>& name, const std::vector<host::EvalPair>& pairs,
                         const std::vector<std::vector<FoundPose>>& found, const EvalSets::Set& set,
                         const std::vector<PoseDecision>& decisions, const Way& way) {
    std::vector<std::size_t> wrong;
    std::map<host::Confusion, std::size_t> counts;
    std::size_t positives = 0;
    std::size_t wrong_positives = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      positives += decisions[i].wanted ? 1U : 0U;
      if (options_.limits.hold(decisions[i]) || found[i].empty()) {
        continue;
      }
      wrong.push_back(i);
      if (decisions[i].wanted) {
        wrong_positives += 1;
        counts[host::confusion_of(pairs[i], set.submaps[pairs[i].a], *host::deciding(found[i], way.score))] += 1;
      }
    }
    using host::Confusion;
    std::vector<std::string> row = joined(name, {std::to_string(positives), std::to_string(wrong_positives)});
    for (const Confusion kind : {Confusion::near, Confusion::half_turn, Confusion::quarter_turn, Confusion::slid,
                                 Confusion::shifted, Confusion::other}) {
      row.push_back(std::to_string(counts[kind]));
    }
    kinds_.add(row);
    std::stable_sort(wrong.begin(), wrong.end(),
                     [&](std::size_t p, std::size_t q) { return decisions[p].score > decisions[q].score; });
    wrong.resize(std::min(wrong.size(), kWorstListed));
    for (const std::size_t i : wrong) {
      const FoundPose& pose = *host::deciding(found[i], way.score);
      const Pose2& truth = pairs[i].a_T_b;
      const char* const kind = host::to_string(host::confusion_of(pairs[i], set.submaps[pairs[i].a], pose));
      confusions_.add(
          joined(name, {kind, std::to_string(pairs[i].a), std::to_string(pairs[i].b), fixed(pairs[i].overlap),
                        fixed(decisions[i].score, 4), fixed(truth.x, 2), fixed(truth.y, 2), fixed(truth.theta),
                        fixed(pose.a_T_b.x, 2), fixed(pose.a_T_b.y, 2), fixed(pose.a_T_b.theta),
                        fixed(decisions[i].metres, 2), fixed(decisions[i].degrees, 1)}));
    }
  }

  /// Recall falls from left to right, so that the lower left corner is the best, as in the paper.
  void draw(const std::string& building, const std::string& frames, const EvalFigure& figure, const Way& way,
            const Curves& curves) const {
    std::vector<host::PlotPanel> panels;
    for (const EvalPanel& panel : figure.panels) {
      host::PlotPanel metres{panel.title, {"Recall", 1.0, 0.0}, {"Translation error [m]", 0.0, 1.0}, {}, {}};
      host::PlotPanel degrees{panel.title, {"Recall", 1.0, 0.0}, {"Rotation error [degrees]", 0.0, 15.0}, {}, {}};
      metres.guides = {options_.limits.metres};
      degrees.guides = {options_.limits.degrees};
      for (std::size_t i = 0; i < panel.curves.size(); ++i) {
        const auto& [label, curve] = panel.curves[i];
        const std::vector<PoseErrors>& points = curves.at(curve.key() + way.name);
        add_lines(metres, label, i, points, &PoseErrors::median_m, &PoseErrors::max_m);
        add_lines(degrees, label, i, points, &PoseErrors::median_deg, &PoseErrors::max_deg);
      }
      panels.push_back(metres);
      panels.push_back(degrees);
    }
    write_figure(options_.common.directory, figure.name + "-" + building + "-" + frames + "-" + way.name,
                 figure.title + ": " + building + ", " + frames + " frames, by " + way.name, panels);
  }

  static void add_lines(host::PlotPanel& panel, const std::string& label, std::size_t colour,
                        const std::vector<PoseErrors>& points, double PoseErrors::*median, double PoseErrors::*most) {
    host::PlotSeries solid{label + ", median", {}, colour, false};
    host::PlotSeries dashed{label + ", maximum", {}, colour, true};
    for (const PoseErrors& p : points) {
      solid.points.push_back({p.recall, p.*median});
      dashed.points.push_back({p.recall, p.*most});
    }
    solid.points = thinned(solid.points);
    dashed.points = thinned(dashed.points);
    panel.series.push_back(solid);
    panel.series.push_back(dashed);
  }

  const RegistrationOptions& options_;
  host::Table summary_;
  host::Table curves_;
  host::Table held_;
  host::Table confusions_;
  host::Table kinds_;
  std::map<std::string, std::pair<std::string, std::optional<double>>> first_thresholds_;
};

}  // namespace

void add_eval_registration(CLI::App& eval) {
  auto options = std::make_shared<RegistrationOptions>();
  CLI::App* command = eval.add_subcommand(
      "registration", "Errors of registered poses against recall (Figs. 6 and 7), and the confusions by name");
  add_eval_options(*command, options->common);
  command->add_option("--figures", options->figures, "6, 7, pipeline (the library's whole registration)")
      ->delimiter(',')
      ->check(CLI::IsMember({"6", "7", "pipeline"}))
      ->default_str("6,7,pipeline");
  add_choice_options(*command, options->choice);
  command->add_option("--limit-metres", options->limits.metres, "a pose within both limits is right")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--limit-degrees", options->limits.degrees, "the paper's rule for the threshold has 10")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([options] { RegistrationEvaluation(*options).run(); });
}

}  // namespace mellin::program
