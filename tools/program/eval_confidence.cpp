// mellin eval confidence: fits the probability that a registered pose is right on some logs, and shows on others
// whether such probabilities hold (spectral/confidence.hpp).
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "host/eval_curves.hpp"
#include "host/file.hpp"
#include "host/logistic.hpp"
#include "host/table.hpp"
#include "program/commands.hpp"
#include "program/eval_data.hpp"

namespace mellin::program {
namespace {

using host::fixed;
using host::Judged;

constexpr std::size_t kBins = 10;
constexpr std::size_t kOverlapTerm = 4;  // of confidence_terms()

struct ConfidenceOptions {
  EvalOptions common;
  std::size_t fitted = 1;
  std::vector<std::uint16_t> scans{20, 40, 80};
  double scale = 25.0;
  double least_overlap = 4.0;
  host::PoseLimits limits;
};

/// What the registration said of the pairs of one building, and what was true.
struct Evidence {
  std::string name;
  bool fitted = false;
  std::vector<Judged> judged;              ///< a sample a hypothesis
  std::vector<host::EvalPair> pairs;       ///< of all numbers of scans
  std::vector<Pose2> poses;                ///< of each sample
  std::vector<std::size_t> first_of_pair;  ///< index into judged; the next pair's begins where it ends

  std::size_t end_of_pair(std::size_t p) const {
    return p + 1 < first_of_pair.size() ? first_of_pair[p + 1] : judged.size();
  }
};

double probability(const std::vector<double>& terms, const std::vector<double>& weights) {
  double sum = 0.0;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    sum += terms[i] * weights[i];
  }
  return 1.0 / (1.0 + std::exp(-sum));
}

/// What registration would say of each hypothesis with these weights: rivals share their probability.
std::vector<host::Stated> stated(const Evidence& e, const std::vector<double>& weights) {
  std::vector<host::Stated> out;
  for (std::size_t p = 0; p < e.pairs.size(); ++p) {
    const std::size_t first = e.first_of_pair[p];
    const std::size_t end = e.end_of_pair(p);
    for (std::size_t i = first; i < end; ++i) {
      float rival_odds = 0.0F;
      for (std::size_t k = first; k < end; ++k) {
        if (exclude_each_other(e.poses[i], e.poses[k])) {
          rival_odds += odds(static_cast<float>(probability(e.judged[k].terms, weights)));
        }
      }
      const auto alone = static_cast<float>(probability(e.judged[i].terms, weights));
      out.push_back({static_cast<double>(beside_rivals(alone, rival_odds)), e.judged[i].right});
    }
  }
  return out;
}

class ConfidenceEvaluation {
 public:
  explicit ConfidenceEvaluation(const ConfidenceOptions& options) : options_(options) {}

  void run() {
    std::vector<Evidence> all;
    const std::vector<EvalBuilding> buildings = load_buildings(options_.common);
    if (options_.fitted > buildings.size()) {
      throw CLI::ValidationError("--fit", "expected at most the number of logs, " + std::to_string(buildings.size()) +
                                              ", found " + std::to_string(options_.fitted));
    }
    for (std::size_t i = 0; i < buildings.size(); ++i) {
      all.push_back(evidence_about(buildings[i]));
      all.back().fitted = i < options_.fitted;
    }
    const ConfidenceModel model;
    const std::vector<double> built_in(std::begin(model.weights), std::end(model.weights));
    report("the library's weights", "library", built_in, all);
    if (options_.fitted > 0) {
      std::vector<Judged> samples;
      for (const Evidence& e : all) {
        if (e.fitted) {
          samples.insert(samples.end(), e.judged.begin(), e.judged.end());
        }
      }
      std::vector<double> least(ConfidenceModel::kWeights, 0.0);
      least[0] = -1e9;
      least[kOverlapTerm] = options_.least_overlap;
      report("fitted weights", "fitted", host::fit_logistic(samples, least), all);
    }
    host::write_file(options_.common.directory + "/confidence.csv", summary_.csv());
    host::write_file(options_.common.directory + "/reliability.csv", bins_.csv());
    std::fputs(summary_.text().c_str(), stdout);
  }

 private:
  Evidence evidence_about(const EvalBuilding& building) const {
    Evidence out;
    out.name = building.name;
    for (const std::string& frames : options_.common.frames) {
      EvalSets sets(building, options_.common, frames_named(frames));
      for (const std::uint16_t scans : options_.scans) {
        const EvalSets::Set& set = sets.of(scans);
        const std::vector<host::EvalPair> pairs =
            host::sample_pairs(set.pairs, options_.common.full ? 0 : options_.common.pairs, options_.common.seed);
        show_progress(options_.common, building.name + ", " + std::to_string(scans) +
                                           " scans: " + std::to_string(pairs.size()) + " of " +
                                           std::to_string(set.pairs.size()) + " pairs");
        EvalCurve curve;
        curve.scans = scans;
        curve.scale = options_.scale;
        curve.com = EvalCurve::kOwnFit;
        add(pairs, host::register_pairs(set.submaps, pairs, registration_of(curve), options_.common.threads), out);
      }
    }
    return out;
  }

  void add(const std::vector<host::EvalPair>& pairs, const std::vector<std::vector<host::FoundPose>>& found,
           Evidence& out) const {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      out.first_of_pair.push_back(out.judged.size());
      out.pairs.push_back(pairs[i]);
      for (const host::FoundPose& pose : found[i]) {
        const host::PoseError error = host::pose_error(pairs[i], pose);
        out.poses.push_back(pose.a_T_b);
        float terms[ConfidenceModel::kWeights];
        confidence_terms(pose.evidence, terms);
        out.judged.push_back({{std::begin(terms), std::end(terms)},
                              options_.limits.hold({0.0, true, error.metres, error.degrees, 1.0})});
      }
    }
  }

  void report(const std::string& title, const std::string& file, const std::vector<double>& weights,
              const std::vector<Evidence>& all) {
    std::printf("%s:", title.c_str());
    for (const double weight : weights) {
      std::printf(" %.3f", weight);
    }
    std::printf("\n");
    host::PlotPanel panel{title, {"Stated probability", 0.0, 1.0}, {"Share right", 0.0, 1.0}, {}, {}};
    panel.series.push_back({"", {{0.0, 0.0}, {1.0, 1.0}}, 7, true});
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::vector<host::Stated> said = stated(all[i], weights);
      const std::vector<host::ReliabilityBin> bins = host::reliability(said, kBins);
      host::PlotSeries series{all[i].name + (all[i].fitted ? " (fitted)" : ""), {}, i, all[i].fitted};
      for (const host::ReliabilityBin& bin : bins) {
        bins_.add({file, all[i].name, all[i].fitted ? "yes" : "no", fixed(bin.from, 1), fixed(bin.to, 1),
                   std::to_string(bin.count), fixed(bin.stated), fixed(bin.observed)});
        if (bin.count > 0) {
          series.points.push_back({bin.stated, bin.observed});
        }
      }
      panel.series.push_back(series);
      summarise(file, said, all[i], host::calibration_error(bins), host::brier_score(said));
    }
    write_figure(options_.common.directory, "reliability-" + file, "Reliability of the confidence", {panel});
  }

  void summarise(const std::string& file, const std::vector<host::Stated>& said, const Evidence& e, double error,
                 double brier) {
    std::vector<host::Decision> detection;
    std::size_t accepted = 0;
    std::size_t wrong = 0;
    for (std::size_t p = 0; p < e.pairs.size(); ++p) {
      double best = 0.0;
      bool right = false;
      for (std::size_t i = e.first_of_pair[p]; i < e.end_of_pair(p); ++i) {
        if (said[i].probability > best) {
          best = said[i].probability;
          right = said[i].right;
        }
      }
      accepted += best >= 0.5 ? 1U : 0U;
      wrong += best >= 0.5 && !right ? 1U : 0U;
      const bool positive = e.pairs[p].overlap >= host::kPositiveOverlap;
      if (positive || e.pairs[p].overlap <= host::kNegativeOverlap) {
        detection.push_back({best, positive, positive, e.pairs[p].weight});
      }
    }
    const std::vector<host::PrecisionRecall> curve = host::precision_recall(detection);
    summary_.add({file, e.name, e.fitted ? "yes" : "no", std::to_string(e.pairs.size()),
                  std::to_string(e.judged.size()), fixed(error, 4), fixed(brier, 4), std::to_string(accepted),
                  std::to_string(wrong), fixed(host::average_precision(curve)),
                  fixed(host::recall_at_precision(curve, 0.99))});
  }

  const ConfidenceOptions& options_;
  host::Table summary_{{"weights", "log", "fitted", "pairs", "hypotheses", "calibration_error", "brier",
                        "accepted_at_half", "wrong", "detection_ap", "detection_recall_99"}};
  host::Table bins_{{"weights", "log", "fitted", "from", "to", "count", "stated", "observed"}};
};

}  // namespace

void add_eval_confidence(CLI::App& eval) {
  auto options = std::make_shared<ConfidenceOptions>();
  CLI::App* command = eval.add_subcommand(
      "confidence",
      "Fits the probability that a registered pose is right on some logs; how well it holds on the others");
  add_eval_options(*command, options->common);
  command->add_option("--fit", options->fitted, "so many of the first logs are fitted to, the others only judged")
      ->capture_default_str();
  command->add_option("--scans", options->scans, "scans a submap")->delimiter(',')->default_str("20,40,80");
  command->add_option("--scale", options->scale, "of registration, per cent")
      ->check(CLI::IsMember({50.0, 25.0, 12.5}))
      ->capture_default_str();
  command
      ->add_option("--least-overlap", options->least_overlap,
                   "least weight of the overlap's term: poses that rest on a sliver of shared ground rank lower, which "
                   "detection gains by and calibration hardly loses by")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->callback([options] { ConfidenceEvaluation(*options).run(); });
}

}  // namespace mellin::program
