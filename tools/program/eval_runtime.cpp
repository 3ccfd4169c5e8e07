// mellin eval runtime: Table I, and what the transforms alone would take.
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/file.hpp"
#include "host/runtime.hpp"
#include "host/table.hpp"
#include "host/tum.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

using host::fixed;
using host::RuntimeRow;

struct RuntimeCommand {
  std::vector<std::string> logs;
  std::vector<std::string> truths;
  std::string directory;
  bool json = false;
  std::uint64_t seed = 1;
};

/// The paper's Table I, ms a pair with up to six peaks, by the side of the picture.
const std::map<int, double> kPaper_ms = {{768, 1096}, {384, 229}, {192, 70}, {96, 22}, {48, 11}};

std::vector<host::LiveDrive> drives_of(const RuntimeCommand& command) {
  if (command.logs.empty()) {
    return {host::simulated_drive()};
  }
  if (!command.truths.empty() && command.truths.size() != command.logs.size()) {
    throw CLI::ValidationError("--truth", "expected one file a log, found " + std::to_string(command.truths.size()) +
                                              " for " + std::to_string(command.logs.size()) + " logs");
  }
  std::vector<host::LiveDrive> drives;
  for (std::size_t i = 0; i < command.logs.size(); ++i) {
    const std::string& log = command.logs[i];
    const std::string beside = log.substr(0, log.rfind(".log")) + ".tum";
    const std::string& truth = command.truths.empty() ? beside : command.truths[i];
    drives.push_back(host::drive_live(host::read_carmen_log(log), host::read_tum(truth)));
  }
  return drives;
}

host::Table table_of(const std::vector<RuntimeRow>& rows) {
  host::Table table({"stage", "side_px", "peaks", "us", "fft_us", "ffts", "transforms_alone_us", "paper_us"});
  for (const RuntimeRow& row : rows) {
    const auto paper = kPaper_ms.find(row.side_px);
    const bool comparable = row.stage != "extract" && row.peaks == 6 && paper != kPaper_ms.end();
    table.add({row.stage, std::to_string(row.side_px), std::to_string(row.peaks), fixed(row.us, 1),
               fixed(row.fft_us, 1), fixed(row.us / row.fft_us, 1),
               fixed(static_cast<double>(row.transforms) * row.fft_us, 1),
               comparable ? fixed(1000.0 * paper->second, 0) : ""});
  }
  return table;
}

std::string json_of(const std::vector<RuntimeRow>& rows) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const RuntimeRow& row : rows) {
    all.push_back({{"stage", row.stage},
                   {"side_px", row.side_px},
                   {"peaks", row.peaks},
                   {"us", row.us},
                   {"fft_us", row.fft_us},
                   {"transforms", row.transforms}});
  }
  return nlohmann::ordered_json{{"rows", all}}.dump(1);
}

void run(const RuntimeCommand& command) {
  const std::vector<host::EvalSubmap> submaps = host::runtime_submaps(drives_of(command), command.seed);
  const std::vector<RuntimeRow> rows = host::measure_runtime(submaps);
  const host::Table table = table_of(rows);
  if (!command.directory.empty()) {
    std::filesystem::create_directories(command.directory);
    host::write_file(command.directory + "/runtime.csv", table.csv());
  }
  if (command.json) {
    std::printf("%s\n", json_of(rows).c_str());
    return;
  }
  std::printf(
      "Medians over %zu submaps, one thread. extract: submap to digest with spectra; screen: one stored digest, the\n"
      "query's own work spread over the %zu that it meets; register: the matcher alone. Every rotation peak is tried,\n"
      "at beta and beta + 180 degrees. fft_us: one real 2D FFT by FFTW; paper_us: Table I, up to six peaks.\n\n%s",
      submaps.size(), submaps.size() - 1, table.text().c_str());
}

}  // namespace

void add_eval_runtime(CLI::App& eval) {
  auto runtime = std::make_shared<RuntimeCommand>();
  CLI::App* command = eval.add_subcommand("runtime", "Time of each stage beside that of an FFT (Table I)");
  command->add_option("LOG", runtime->logs, "CARMEN logs, plain or .gz; none: a simulated building");
  command->add_option("--truth", runtime->truths,
                      "corrected poses (TUM), one file a log; else NAME.tum beside NAME.log");
  command->add_option("-o,--output", runtime->directory, "folder for runtime.csv; created");
  command->add_option("--seed", runtime->seed, "of the submaps' orientations")->capture_default_str();
  command->add_flag("--json", runtime->json, "prints JSON");
  command->callback([runtime] { run(*runtime); });
}

}  // namespace mellin::program
