// mellin record: the scans of a log as the stream of bytes that firmware reads (port/images/scan_stream.hpp).
#include <cmath>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>

#include "host/carmen_log.hpp"
#include "images/scan_stream.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

class Writer {
 public:
  explicit Writer(const std::string& path) : path_(path), out_(path, std::ios::binary) {
    if (!out_) {
      throw std::runtime_error(path + ": cannot be written");
    }
  }
  template <class T>
  void put(T number) {
    out_.write(reinterpret_cast<const char*>(&number), sizeof number);
  }
  void put(const Pose2& pose) {
    put(pose.x);
    put(pose.y);
    put(pose.theta);
  }
  void put(const char* text) { out_ << text; }
  void close() {
    out_.close();
    if (!out_) {
      throw std::runtime_error(path_ + ": cannot be written");
    }
  }

 private:
  std::string path_;
  std::ofstream out_;
};

void record(const std::string& path, const std::string& to, std::size_t most) {
  const host::Log log = host::read_carmen_log(path);
  if (log.lasers.empty() || log.lasers.size() > kMaxLasers) {
    throw std::runtime_error(path + ": expected 1 to 4 lasers, found " + std::to_string(log.lasers.size()));
  }
  Writer out(to);
  out.put(image::kScanMagic);
  out.put(image::kScanVersion);
  out.put(static_cast<std::uint32_t>(log.lasers.size()));
  for (const host::LaserSpec& laser : log.lasers) {
    if (laser.beams > image::kMaxStreamBeams) {
      throw std::runtime_error(path + ": expected at most " + std::to_string(image::kMaxStreamBeams) +
                               " beams, found " + std::to_string(laser.beams));
    }
    out.put(static_cast<std::uint32_t>(laser.beams));
    out.put(static_cast<float>(laser.angle_min_rad));
    out.put(static_cast<float>(laser.increment_rad));
    out.put(static_cast<float>(laser.max_range_m));
    out.put(laser.base_T_laser);
  }
  for (std::size_t i = 0; i < log.scans.size() && i < most; ++i) {
    const host::LogScan& scan = log.scans[i];
    out.put(static_cast<std::int64_t>(std::llround(scan.seconds * 1e6)));
    out.put(static_cast<std::uint32_t>(scan.laser));
    out.put(scan.odometry);
    for (const float range : scan.ranges) {
      out.put(range);
    }
  }
  out.close();
}

}  // namespace

void add_record(CLI::App& app) {
  struct Options {
    std::string log;
    std::string out;
    std::size_t scans = static_cast<std::size_t>(-1);
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("record", "Writes a log's scans as a stream that firmware reads");
  command->add_option("LOG", options->log, "CARMEN log, plain or .gz")->required();
  command->add_option("-o,--out", options->out, "stream to write")->required();
  command->add_option("--scans", options->scans, "only the first so many");
  command->callback([options] { record(options->log, options->out, options->scans); });
}

}  // namespace mellin::program
