// mellin eval cascade: what each stage of screening drops, and what it keeps of the pairs that became edges.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/cascade.hpp"
#include "host/file.hpp"
#include "host/mapping_run.hpp"
#include "host/settings.hpp"
#include "host/table.hpp"
#include "program/commands.hpp"
#include "ramflash/heap_flash.hpp"

namespace mellin::program {
namespace {

struct CascadeCommand {
  std::vector<std::string> logs;
  std::string profile = "desktop";
  std::vector<std::string> settings;
  std::vector<std::string> variants;
  std::string directory;
};

/// Numbers of rotation peaks, then each stage by itself, and the last two together. What is not named is off.
const std::vector<std::string> kVariants = {
    "screening.max_peaks=6",
    "screening.max_peaks=2",
    "screening.max_peaks=1",
    "screening.max_peaks=2,screening.coarse_peaks=2,screening.coarse_peak=0.2",
    "screening.max_peaks=2,screening.first_peaks=1,screening.further_agreement=0.2",
    "screening.max_peaks=2,screening.verified_share=0.8",
    "screening.max_peaks=2,screening.min_rotation_peak=0.35",
    "screening.max_peaks=2,screening.min_rotation_peak=0.35,screening.verified_share=0.8",
};

Config with_settings(Config config, const std::string& settings) {
  std::istringstream in(settings);
  for (std::string setting; std::getline(in, setting, ',');) {
    host::apply_setting(config, setting);
  }
  return config;
}

std::string per_cent(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? host::fixed(100.0 * static_cast<double>(part) / static_cast<double>(whole), 1) : "";
}

void add_log(const CascadeCommand& command, const std::string& path, host::Table& table) {
  Config config = host::profile_named(command.profile);
  for (const std::string& setting : command.settings) {
    host::apply_setting(config, setting);
  }
  config = host::without_cascade(config);
  const host::Log log = host::read_carmen_log(path);
  const std::vector<std::uint8_t> lasers = host::add_lasers(config, log);
  port::HeapFlash flash{port::FlashGeometry{}};
  host::MappingRun run(config, flash.flash(), {});
  run.map(log, lasers, {});
  const std::string name = std::filesystem::path(path).filename().string();
  const std::vector<std::string>& variants = command.variants.empty() ? kVariants : command.variants;
  for (const std::string& variant : variants) {
    const host::CascadeCounts c = host::screen_all(run, with_settings(config, variant));
    table.add({name.substr(0, name.find('.')), variant, std::to_string(c.pairs), per_cent(c.nearby, c.pairs),
               per_cent(c.dropped_coarse, c.pairs), per_cent(c.dropped_rotation, c.pairs),
               per_cent(c.cut_short, c.pairs), per_cent(c.candidates, c.pairs), std::to_string(c.edges),
               per_cent(c.edges_kept, c.edges), host::fixed(c.us_a_pair, 1)});
  }
}

void run(const CascadeCommand& command) {
  host::Table table({"log", "screening", "pairs", "nearby_%", "coarse_%", "rotation_%", "cut_short_%", "candidates_%",
                     "edges", "edges_kept_%", "us_a_pair"});
  for (const std::string& path : command.logs) {
    add_log(command, path, table);
  }
  if (!command.directory.empty()) {
    std::filesystem::create_directories(command.directory);
    host::write_file(command.directory + "/cascade.csv", table.csv());
  }
  std::printf(
      "Each log is mapped without the cascade; then all its pairs of submaps that share no scans are screened in each\n"
      "way. nearby: by the graph, never dropped; coarse, rotation: dropped by that stage; cut_short: further rotation "
      "peaks not tried; edges: pairs that\n"
      "became loop edges of the map; kept: of these still candidates for registration; us: processor time.\n\n%s",
      table.text().c_str());
}

}  // namespace

void add_eval_cascade(CLI::App& eval) {
  auto cascade = std::make_shared<CascadeCommand>();
  CLI::App* command = eval.add_subcommand("cascade", "What each stage of screening drops and keeps");
  command->add_option("LOG", cascade->logs, "CARMEN logs, plain or .gz")->required();
  command->add_option("--profile", cascade->profile, "desktop, micro or nano")
      ->capture_default_str()
      ->check(CLI::IsMember({"desktop", "micro", "nano"}));
  command->add_option("--set", cascade->settings, "key=value for the mapping and all screenings; may be repeated");
  command->add_option("--screening", cascade->variants,
                      "key=value,key=value,...: a way of screening; may be repeated; none: a choice of them");
  command->add_option("-o,--output", cascade->directory, "folder for cascade.csv; created");
  command->callback([cascade] { run(*cascade); });
}

}  // namespace mellin::program
