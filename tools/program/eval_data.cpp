#include "program/eval_data.hpp"

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "host/carmen_log.hpp"
#include "host/file.hpp"
#include "host/table.hpp"
#include "host/tum.hpp"
#include "mellin/config.hpp"

namespace mellin::program {
namespace {

std::string without_ending(std::string path, const std::string& ending) {
  if (path.size() > ending.size() && path.compare(path.size() - ending.size(), ending.size(), ending) == 0) {
    path.resize(path.size() - ending.size());
  }
  return path;
}

/// path/name of path/name.log.gz
std::string stem(const std::string& log) { return without_ending(without_ending(log, ".gz"), ".log"); }

}  // namespace

void add_eval_options(CLI::App& command, EvalOptions& o) {
  command.add_option("LOG", o.logs, "CARMEN logs, plain or .gz")->required();
  command.add_option("--truth", o.truths, "corrected poses (TUM), one file a log; else NAME.tum beside NAME.log");
  command.add_option("-o,--output", o.directory, "folder for tables and pictures; created")->required();
  command
      .add_option("--frames", o.frames, "orientation of the submaps' frames: random, aligned with the session, both")
      ->delimiter(',')
      ->check(CLI::IsMember({"random", "aligned"}))
      ->default_str("random");
  command.add_option("--pairs", o.pairs, "pairs sampled for pictures of 384 pixels and more; 0: all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_flag("--full", o.full, "all pairs everywhere");
  command.add_flag("--together", o.together, "the logs are sessions in one building, their truths in one frame");
  command.add_option("--seed", o.seed, "of orientations, samples and particles")->capture_default_str();
  command.add_option("--particles", o.particles, "of the mapping run")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_flag("--progress", o.progress, "shows progress though standard error is no terminal");
  command.add_option("--threads", o.threads, "threads; results do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
}

std::vector<EvalBuilding> load_buildings(const EvalOptions& options) {
  if (!options.truths.empty() && options.truths.size() != options.logs.size()) {
    throw CLI::ValidationError("--truth", "expected one file a log, found " + std::to_string(options.truths.size()) +
                                              " for " + std::to_string(options.logs.size()) + " logs");
  }
  std::vector<EvalBuilding> buildings;
  for (std::size_t i = 0; i < options.logs.size(); ++i) {
    const std::string& path = options.logs[i];
    const std::string truth = options.truths.empty() ? stem(path) + ".tum" : options.truths[i];
    host::LiveOptions live;
    live.particles = options.particles;
    live.seed = options.seed;
    host::LiveDrive drive = host::drive_live(host::read_carmen_log(path), host::read_tum(truth), live);
    const std::string name = std::filesystem::path(stem(path)).filename().string();
    if (buildings.empty() || !options.together) {
      buildings.push_back({name, {}});
    } else {
      buildings.back().name += "+" + name;
    }
    buildings.back().drives.push_back(std::move(drive));
  }
  std::filesystem::create_directories(options.directory);
  return buildings;
}

const EvalSets::Set& EvalSets::of(std::uint16_t scans) {
  const auto found = sets_.find(scans);
  if (found != sets_.end()) {
    return found->second;
  }
  host::SubmapOptions submap_options;
  submap_options.scans = scans;
  submap_options.frames = frames_;
  submap_options.seed = options_.seed;
  Set set;
  set.submaps = host::make_submaps(building_.drives, submap_options, options_.threads);
  set.pairs = host::make_pairs(set.submaps);
  if (set.pairs.empty()) {
    throw std::runtime_error(building_.name + ": expected two submaps of " + std::to_string(scans) +
                             " scans that share none, found " + std::to_string(set.submaps.size()) + " submaps in all");
  }
  return sets_.emplace(scans, std::move(set)).first->second;
}

std::vector<host::EvalPair> chosen_pairs(const std::vector<host::EvalPair>& pairs, const EvalOptions& options,
                                         std::uint16_t side) {
  const bool sampled = side >= kSampledFromSide && !options.full;
  return host::sample_pairs(pairs, sampled ? options.pairs : 0, options.seed);
}

host::SubmapFrames frames_named(const std::string& name) {
  return name == "aligned" ? host::SubmapFrames::aligned : host::SubmapFrames::random;
}

host::PairScore score_named(const std::string& name) {
  return name == "agreement" ? host::PairScore::agreement : host::PairScore::peak;
}

RegistrationConfig registration_of(const EvalCurve& curve) {
  Config config = desktop_profile();
  config.registration_side = curve.side();
  config.registration.matcher = curve.matcher();
  config.registration.matcher.translation_peaks = registration_matcher().translation_peaks;
  config.registration.aligned = kMaxPlaceHypotheses;
  return resolved(config).registration;
}

MatcherConfig EvalCurve::matcher() const {
  MatcherConfig config;
  if (method == "paper") {
    config = paper_matcher(side());
  }
  if (method == "unobserved-free") {
    config.free_weight = 0.0F;
  }
  config.masked = method == "masked";
  config.side = side();
  if (com != kOwnFit) {
    config.peak_fit = PeakFit::centre_of_mass;
    config.com_radius = static_cast<std::uint8_t>(com);
  }
  config.preprocessing = preprocessing == "none"   ? Preprocessing::none
                         : preprocessing == "blur" ? Preprocessing::blur
                                                   : Preprocessing::erosion;
  return config;
}

std::vector<std::string> EvalCurve::cells() const {
  return {std::to_string(scans), host::fixed(scale, 2), com == kOwnFit ? "own" : std::to_string(com), preprocessing,
          method};
}

std::vector<std::string> curve_columns() { return {"scans", "scale", "com", "preprocessing", "method"}; }

std::string EvalCurve::key() const {
  std::string out;
  for (const std::string& cell : cells()) {
    out += out.empty() ? "" : " ";
    out += cell;
  }
  return out;
}

std::vector<EvalCurve> EvalChoice::combinations() const {
  const auto or_else = [](auto given, auto usual) {
    if (given.empty()) {
      given.push_back(usual);
    }
    return given;
  };
  std::vector<EvalCurve> out;
  for (const std::uint16_t k : or_else(scans, std::uint16_t{40})) {
    for (const double scale : or_else(scales, 25.0)) {
      for (const std::string& method : methods) {
        for (const std::string& prepared : or_else(preprocessing, std::string("erosion"))) {
          for (const int radius : or_else(com, EvalCurve::kOwnFit)) {
            out.push_back({k, scale, radius, prepared, method});
          }
        }
      }
    }
  }
  return out;
}

void add_choice_options(CLI::App& command, EvalChoice& choice) {
  command
      .add_option(
          "--method", choice.methods,
          "matchers: best (the default configuration), paper (taken at its word), masked (Padfield's correlation of "
          "what both observed), unobserved-free (the best, but unobserved space is free, as in the paper)")
      ->delimiter(',')
      ->check(CLI::IsMember({"best", "paper", "masked", "unobserved-free"}))
      ->default_str("best,paper");
  const std::string combined = "every combination instead of the figures: ";
  command.add_option("--scales", choice.scales, combined + "per cent of 768 pixels")
      ->delimiter(',')
      ->check(CLI::IsMember({100.0, 50.0, 25.0, 12.5, 6.25}));
  command.add_option("--scans", choice.scans, combined + "scans a submap")->delimiter(',')->check(CLI::Range(4, 400));
  command.add_option("--com", choice.com, combined + "radius of the peak's centre of mass")
      ->delimiter(',')
      ->check(CLI::Range(0, 3));
  command.add_option("--preprocessing", choice.preprocessing, combined + "none, erosion, blur")
      ->delimiter(',')
      ->check(CLI::IsMember({"none", "erosion", "blur"}));
}

EvalFigure figure_of(const EvalChoice& choice, const std::string& title) {
  EvalFigure figure{"chosen", title, {}};
  for (const EvalCurve& curve : choice.combinations()) {
    const std::string panel = std::to_string(curve.scans) + " scans, " + host::fixed(curve.scale, 2) + " %";
    if (figure.panels.empty() || figure.panels.back().title != panel) {
      figure.panels.push_back({panel, {}});
    }
    figure.panels.back().curves.push_back(
        {curve.method + ", " + curve.preprocessing + ", CoM " + curve.cells()[2], curve});
  }
  return figure;
}

void show_progress(const EvalOptions& options, const std::string& line) {
  if (options.progress || isatty(STDERR_FILENO) != 0) {
    std::fprintf(stderr, "%s\n", line.c_str());
  }
}

std::vector<host::PlotPoint> thinned(const std::vector<host::PlotPoint>& points, std::size_t count) {
  if (points.size() <= count) {
    return points;
  }
  std::vector<host::PlotPoint> out;
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(points[i * (points.size() - 1) / (count - 1)]);
  }
  return out;
}

void write_figure(const std::string& directory, const std::string& name, const std::string& title,
                  const std::vector<host::PlotPanel>& panels) {
  host::write_file(directory + "/" + name + ".svg", host::to_svg(title, panels));
}

}  // namespace mellin::program
