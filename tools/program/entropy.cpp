// mellin entropy: how sharp a map the scans of a log make at the poses of a trajectory.
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "host/file.hpp"
#include "host/map_entropy.hpp"
#include "host/pairing.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

struct EntropyOptions {
  std::string log;
  std::string trajectory;
  std::string against;
  std::string picture;
  double resolution_m = 0.05;
  double max_range_m = 0.0;
  bool json = false;
};

std::vector<host::ScanPose> read_poses(const host::Log& log, const std::string& path) {
  std::vector<host::ScanPose> poses = host::poses_of_scans(log, host::read_tum(path));
  if (poses.empty()) {
    throw std::runtime_error(path + ": expected poses at stamps of " + log.path + ", found none");
  }
  return poses;
}

void print(const char* name, const host::MapEntropy& entropy) {
  std::printf("%-11s %zu cells observed, entropy %.0f bits, %.4f bits a cell\n", name, entropy.cells, entropy.bits,
              entropy.bits_per_cell());
}

nlohmann::ordered_json json_of(const host::MapEntropy& entropy) {
  return {{"cells", entropy.cells}, {"entropy_bits", entropy.bits}, {"bits_per_cell", entropy.bits_per_cell()}};
}

void run(const EntropyOptions& options) {
  host::LogOptions log_options;
  if (options.max_range_m > 0.0) {
    log_options.max_range_m = options.max_range_m;
  }
  const host::Log log = host::read_carmen_log(options.log, log_options);
  std::vector<host::ScanPose> poses = read_poses(log, options.trajectory);
  std::vector<host::ScanPose> truth;
  if (!options.against.empty()) {
    truth = read_poses(log, options.against);
    host::make_comparable(poses, truth);
    if (poses.empty()) {
      throw std::runtime_error(options.against + ": expected poses of scans that " + options.trajectory +
                               " has, too; found none");
    }
  }
  const host::DrawnMap map = host::draw_map(log, poses, options.resolution_m);
  const host::MapEntropy entropy = host::entropy_of(map.counts);
  if (!options.picture.empty()) {
    host::write_file(options.picture, host::encode_png(host::picture_of(map).grey));
  }
  nlohmann::ordered_json json = {
      {"scans", poses.size()}, {"resolution_m", options.resolution_m}, {"map", json_of(entropy)}};
  if (!options.json) {
    std::printf("%zu scans drawn, cells of %g m\n", poses.size(), options.resolution_m);
    print("map:", entropy);
  }
  if (!truth.empty()) {
    const host::MapEntropy other = host::entropy_of(host::draw_map(log, truth, options.resolution_m).counts);
    const double total = entropy.bits / other.bits;
    const double each = entropy.bits_per_cell() / other.bits_per_cell();
    json["against"] = json_of(other);
    json["entropy_ratio"] = total;
    json["bits_per_cell_ratio"] = each;
    if (!options.json) {
      print("against:", other);
      std::printf("ratio:      entropy %.4f, a cell %.4f\n", total, each);
    }
  }
  if (options.json) {
    std::printf("%s\n", json.dump().c_str());
  }
}

}  // namespace

void add_entropy(CLI::App& app) {
  auto options = std::make_shared<EntropyOptions>();
  CLI::App* command = app.add_subcommand(
      "entropy",
      "How sharp a map the scans of a log make at the poses of a trajectory, paired by stamp (1.5 ms). Every beam that "
      "hit something is cast: its cells are observed, the last is hit. p = (hits + 0.5) / (observations + 1), the "
      "posterior mean under Jeffreys' prior, so that a cell seen once is not yet certain; entropy is the sum over the "
      "observed cells of -p log2 p - (1-p) log2 (1-p), bits. With --against only the scans that both trajectories have "
      "are drawn, and the first is laid on the second by the best rigid motion");
  command->add_option("LOG", options->log, "CARMEN log, plain or .gz")->required();
  command->add_option("TRAJECTORY", options->trajectory, "poses of its scans (TUM)")->required();
  command->add_option("--against", options->against, "poses to compare with (TUM)");
  command->add_option("--resolution", options->resolution_m, "edge of a cell, m")
      ->check(CLI::Range(0.01, 1.0))
      ->capture_default_str();
  command->add_option("--max-range", options->max_range_m, "Ranges of so many metres and more hit nothing")
      ->check(CLI::PositiveNumber);
  command->add_option("-o,--output", options->picture, "the map as a picture (PNG)");
  command->add_flag("--json", options->json, "print JSON");
  command->callback([options] { run(*options); });
}

}  // namespace mellin::program
