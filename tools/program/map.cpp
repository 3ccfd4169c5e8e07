// mellin map: runs the whole system over logs and writes the map, the trajectories and the figures.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/heap_counter.hpp"
#include "host/map_output.hpp"
#include "host/mapping_run.hpp"
#include "host/settings.hpp"
#include "posix/flash_image.hpp"
#include "program/commands.hpp"
#include "ramflash/heap_flash.hpp"

namespace mellin::program {
namespace {

struct MapOptions {
  std::vector<std::string> logs;
  std::string directory;
  std::string store;
  std::string profile = "desktop";
  std::string config_file;
  std::vector<std::string> settings;
  std::uint64_t seed = 1;
  unsigned threads = 1;
  bool progress = false;
  double fov_deg = 0.0;
  double max_range_m = 0.0;
  bool no_loops = false;
};

Config make_config(const MapOptions& options) {
  Config config = host::profile_named(options.profile);
  if (!options.config_file.empty()) {
    host::apply_settings_file(config, options.config_file);
  }
  for (const std::string& setting : options.settings) {
    host::apply_setting(config, setting);
  }
  config.seed = options.seed;
  if (options.no_loops) {
    config.collection.close_loops = false;
  }
  return config;
}

/// Lines `id crc32`, appended and on the disk before the call returns: what a power cut may never take back.
class StoredLog {
 public:
  explicit StoredLog(const std::string& path) : path_(path), file_(std::fopen(path.c_str(), "a")) {
    if (file_ == nullptr) {
      throw std::runtime_error(path + ": cannot be opened for appending");
    }
  }
  ~StoredLog() { std::fclose(file_); }
  StoredLog(const StoredLog&) = delete;
  StoredLog& operator=(const StoredLog&) = delete;

  void append(SubmapId id, std::uint32_t crc) {
    std::fprintf(file_, "%u %08x\n", id, crc);
    if (std::fflush(file_) != 0 || fsync(fileno(file_)) != 0) {
      throw std::runtime_error(path_ + ": cannot be written");
    }
  }

 private:
  std::string path_;
  std::FILE* file_;
};

void remark_on(const host::Log& log, std::vector<std::string>& remarks) {
  for (const host::LaserSpec& laser : log.lasers) {
    char text[200];
    std::snprintf(text, sizeof text, ": %zu beams, maximum range %.2f m (%s)", laser.beams, laser.max_range_m,
                  host::to_string(laser.max_range_source));
    remarks.push_back(log.path + text);
  }
  for (const host::BadLine& bad : log.bad_lines) {
    remarks.push_back(log.path + ":" + std::to_string(bad.line) + ": " + bad.reason);
  }
  if (log.bad_line_count > log.bad_lines.size()) {
    remarks.push_back(log.path + ": " + std::to_string(log.bad_line_count) + " malformed lines in all");
  }
  for (const auto& [name, count] : log.passed_over) {
    remarks.push_back(log.path + ": " + std::to_string(count) + " lines of kind " + name + " passed over");
  }
}

/// What is wrong with a `key=value` of the command line; empty where nothing is.
std::string setting_error(const std::string& assignment) {
  try {
    Config config;
    host::apply_setting(config, assignment);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

void run_map(const MapOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  Config config = make_config(options);
  host::LogOptions log_options;
  if (options.fov_deg > 0.0) {
    log_options.fov_rad = options.fov_deg * kPi / 180.0;
  }
  if (options.max_range_m > 0.0) {
    log_options.max_range_m = options.max_range_m;
  }
  host::OutputFigures figures;
  std::vector<host::Log> logs;
  std::vector<std::vector<std::uint8_t>> lasers;
  for (const std::string& path : options.logs) {
    logs.push_back(host::read_carmen_log(path, log_options));
    lasers.push_back(host::add_lasers(config, logs.back()));
    remark_on(logs.back(), figures.remarks);
  }
  std::filesystem::create_directories(options.directory);

  std::unique_ptr<posix::FlashImage> image;
  std::unique_ptr<port::HeapFlash> ram;
  std::unique_ptr<StoredLog> stored;
  mellin_flash flash = {};
  if (options.store.empty()) {
    ram = std::make_unique<port::HeapFlash>(port::FlashGeometry{});
    flash = ram->flash();
  } else {
    image = std::make_unique<posix::FlashImage>(options.store, posix::FlashGeometry{});
    flash = image->flash();
    stored = std::make_unique<StoredLog>(options.directory + "/stored.log");
  }
  const bool show = options.progress || isatty(STDERR_FILENO) != 0;
  host::MappingRun run(config, flash, [&](const std::string& line) {
    figures.remarks.push_back(line);
    std::fprintf(stderr, "%s\n", line.c_str());
  });
  if (stored) {
    run.on_stored = [&](SubmapId id) {
      const Result<std::uint32_t> crc = run.slam().store().grid_crc32(id);
      if (crc.ok()) {
        stored->append(id, crc.value());
      }
    };
  }
  for (std::size_t k = 0; k < logs.size(); ++k) {
    run.map(logs[k], lasers[k], [&](std::size_t done) {
      if (show) {
        std::fprintf(stderr, "\r%s: scan %zu of %zu, %u submaps, %llu loops ", logs[k].path.c_str(), done,
                     logs[k].scans.size(), run.slam().collection().size(),
                     static_cast<unsigned long long>(run.slam().collection().statistics().pairs_accepted));
      }
    });
  }
  if (show) {
    std::fprintf(stderr, "\n");
  }
  figures.total_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  figures.heap_allocations = host::heap_counts().allocations;
  const host::Summary summary = host::write_outputs(run, options.directory, figures);
  std::printf("%llu submaps in %llu component(s), %llu loop and %llu merge edges, %.1f s; map: %s/map.png\n",
              static_cast<unsigned long long>(run.slam().collection().size()),
              static_cast<unsigned long long>(summary.components), static_cast<unsigned long long>(summary.edges.loop),
              static_cast<unsigned long long>(summary.edges.merge), summary.seconds.total, options.directory.c_str());
}

}  // namespace

void add_map(CLI::App& app) {
  auto options = std::make_shared<MapOptions>();
  CLI::App* map = app.add_subcommand("map", "Maps logs, one session each, into one map collection");
  map->add_option("LOG", options->logs, "CARMEN logs, plain or .gz")->required();
  map->add_option("-o,--output", options->directory, "Folder for all results; created")->required();
  map->add_option("--store", options->store, "Flash image that outlives the call; its map is continued");
  map->add_option("--profile", options->profile, "desktop, micro or nano")
      ->capture_default_str()
      ->check(CLI::IsMember({"desktop", "micro", "nano"}));
  map->add_option("--config", options->config_file, "File of key = value lines")->check(CLI::ExistingFile);
  map->add_option("--set", options->settings, "key=value; may be repeated")->check(setting_error);
  map->add_option("--seed", options->seed, "Seed of all random numbers")->capture_default_str();
  map->add_option("--threads", options->threads, "Threads; results do not depend on it, and one is used at present")
      ->check(CLI::PositiveNumber);
  map->add_option("--fov", options->fov_deg, "Degrees from the first beam to the last, overrides the log")
      ->check(CLI::PositiveNumber);
  map->add_option("--max-range", options->max_range_m, "Ranges of so many metres and more hit nothing")
      ->check(CLI::PositiveNumber);
  map->add_flag("--no-loops", options->no_loops, "Stores submaps, but closes no loops");
  map->add_flag("--progress", options->progress, "Shows progress though standard error is no terminal");
  map->callback([options] { run_map(*options); });
}

}  // namespace mellin::program
