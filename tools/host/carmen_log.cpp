#include "host/carmen_log.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "host/line_reader.hpp"

namespace mellin::host {
namespace {

using Words = std::vector<std::string_view>;

constexpr double kDegree = kPi / 180.0;

/// Longest part of a foreign word that a report repeats.
constexpr std::size_t kQuotedBytes = 40;
/// Kinds of passed-over lines that are told apart: a binary file has no end of first words.
constexpr std::size_t kMaxPassedOverKinds = 100;

std::string quoted(std::string_view word) {
  std::string text = "'";
  for (const char c : word.substr(0, kQuotedBytes)) {
    text += (c >= ' ' && c <= '~') ? c : '?';
  }
  return text + (word.size() > kQuotedBytes ? "…'" : "'");
}

/// A malformed line; its reason goes into the report and the line is passed over.
struct Malformed {
  std::string reason;
};

void expect_words(const Words& words, std::size_t count, bool or_more = false) {
  if (words.size() < count || (!or_more && words.size() > count)) {
    throw Malformed{"expected " + std::to_string(count) + " words, found " + std::to_string(words.size())};
  }
}

double number_at(const Words& words, std::size_t i) {
  double value = 0.0;
  if (i >= words.size()) {
    throw Malformed{"expected a number as word " + std::to_string(i + 1) + ", found the end of the line"};
  }
  if (!parse_number(words[i], value)) {
    throw Malformed{"expected a finite number as word " + std::to_string(i + 1) + ", found " + quoted(words[i])};
  }
  return value;
}

std::size_t count_at(const Words& words, std::size_t i, std::size_t least) {
  const double value = number_at(words, i);
  if (value != std::floor(value) || value < static_cast<double>(least) || value > static_cast<double>(kMaxBeams)) {
    throw Malformed{"expected a count of " + std::to_string(least) + " to " + std::to_string(kMaxBeams) + " as word " +
                    std::to_string(i + 1) + ", found " + quoted(words[i])};
  }
  return static_cast<std::size_t>(value);
}

Pose2 pose_at(const Words& words, std::size_t i) {
  const Pose2 pose{number_at(words, i), number_at(words, i + 1), number_at(words, i + 2)};
  // Beyond these, poses are no longer exact to a millimetre and angles cannot be reduced.
  if (std::fabs(pose.x) > 1e9 || std::fabs(pose.y) > 1e9 || std::fabs(pose.theta) > 1e5) {
    throw Malformed{"expected a pose, found " + quoted(words[i]) + " " + quoted(words[i + 1]) + " " +
                    quoted(words[i + 2])};
  }
  return pose;
}

std::vector<float> ranges_at(const Words& words, std::size_t first, std::size_t count) {
  std::vector<float> ranges(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double range = number_at(words, first + i);
    if (std::fabs(range) > static_cast<double>(std::numeric_limits<float>::max())) {
      throw Malformed{"expected a range, found " + quoted(words[first + i])};
    }
    ranges[i] = static_cast<float>(range);
  }
  return ranges;
}

/// What a ROBOTLASER1 line says of its sensor.
struct LaserHeader {
  double angle_min_rad = 0.0;
  double fov_rad = 0.0;
  double increment_rad = 0.0;
  double max_range_m = 0.0;
};

/// What tells a laser from the others while lines are read; its spec is worked out at the end, when all PARAM lines
/// are known.
struct LaserSource {
  bool rear = false;
  std::size_t beams = 0;
  std::optional<LaserHeader> header;
  Pose2 base_T_laser;
  // ROBOTLASER1 logs of some converters fill in the laser's pose alone.
  std::vector<Pose2> laser_poses;
  bool robot_pose_seen = false;
};

bool same_header(const LaserHeader& a, const LaserHeader& b) {
  return a.angle_min_rad == b.angle_min_rad && a.fov_rad == b.fov_rad && a.increment_rad == b.increment_rad &&
         a.max_range_m == b.max_range_m;
}

class Reader {
 public:
  Reader(const std::string& path, const LogOptions& options) : options_(options) { log_.path = path; }

  Log read();

 private:
  void read_line(const Words& words);
  void read_old_laser(const Words& words, bool rear);
  void read_robot_laser(const Words& words);
  void read_parameter(const Words& words);
  void pass_over(std::string_view kind);
  void add_scan(std::size_t laser, const Pose2& odometry, std::vector<float> ranges, std::string_view stamp,
                double seconds);
  std::size_t old_laser(bool rear, std::size_t beams);
  std::size_t robot_laser(std::size_t beams, const LaserHeader& header);
  void mark_bad(std::string reason);

  void finish();
  void settle_robot_laser_poses(std::size_t laser);
  LaserSpec spec_of(std::size_t laser) const;
  void set_angles(LaserSpec& spec, const LaserSource& source) const;
  void set_max_range(LaserSpec& spec, std::size_t laser) const;
  std::optional<double> parameter(const std::string& name) const;

  const LogOptions& options_;
  Log log_;
  std::vector<LaserSource> sources_;
  std::size_t line_ = 0;
};

void Reader::mark_bad(std::string reason) {
  ++log_.bad_line_count;
  if (log_.bad_lines.size() < kKeptBadLines) {
    log_.bad_lines.push_back({line_, std::move(reason)});
  }
}

Log Reader::read() {
  LineReader lines(log_.path);
  std::string line;
  Words words;
  while (lines.next(line)) {
    line_ = lines.number();
    if (lines.overlong()) {
      mark_bad("expected a line of at most " + std::to_string(LineReader::kMaxLineBytes) +
               " bytes, found a longer one");
      continue;
    }
    split_words(line, words);
    if (words.empty() || words[0].front() == '#') {
      continue;
    }
    try {
      read_line(words);
    } catch (const Malformed& malformed) {
      mark_bad(std::string(words[0]) + ": " + malformed.reason);
    }
  }
  if (log_.scans.empty()) {
    std::string found = std::to_string(lines.number()) + " lines without one";
    if (log_.bad_line_count > 0) {
      found += ", " + std::to_string(log_.bad_line_count) + " of them malformed (line " +
               std::to_string(log_.bad_lines.front().line) + ": " + log_.bad_lines.front().reason + ")";
    }
    throw std::runtime_error(log_.path + ":" + std::to_string(lines.number()) +
                             ": expected a laser scan (FLASER, RLASER or ROBOTLASER1), found " + found);
  }
  finish();
  return std::move(log_);
}

void Reader::read_line(const Words& words) {
  const std::string_view kind = words[0];
  if (kind == "FLASER" || kind == "RLASER") {
    read_old_laser(words, kind == "RLASER");
  } else if (kind == "ROBOTLASER1") {
    read_robot_laser(words);
  } else if (kind == "ODOM") {
    ++log_.odometry_lines;
  } else if (kind == "PARAM") {
    read_parameter(words);
  } else {
    pass_over(kind);
  }
}

void Reader::pass_over(std::string_view kind) {
  std::string name(kind.substr(0, kQuotedBytes));
  if (log_.passed_over.size() >= kMaxPassedOverKinds && log_.passed_over.count(name) == 0) {
    name = "(others)";
  }
  ++log_.passed_over[name];
}

/// FLASER n r1 … rn x y theta ox oy otheta stamp host stamp; RLASER alike.
void Reader::read_old_laser(const Words& words, bool rear) {
  expect_words(words, 2, true);
  const std::size_t beams = count_at(words, 1, 1);
  expect_words(words, beams + 11);
  std::vector<float> ranges = ranges_at(words, 2, beams);
  pose_at(words, beams + 2);  // the laser's own pose: not used, but a line that has none is malformed
  const Pose2 odometry = pose_at(words, beams + 5);
  const double seconds = number_at(words, beams + 8);
  add_scan(old_laser(rear, beams), odometry, std::move(ranges), words[beams + 8], seconds);
}

/// ROBOTLASER1 type start fov resolution max_range accuracy remission_mode n r1 … rn m e1 … em
/// laser_pose(3) robot_pose(3) tv rv forward_safety side_safety turn_axis stamp host stamp.
void Reader::read_robot_laser(const Words& words) {
  expect_words(words, 9, true);
  const LaserHeader header{number_at(words, 2), number_at(words, 3), number_at(words, 4), number_at(words, 5)};
  const std::size_t beams = count_at(words, 8, 1);
  const std::size_t remissions = count_at(words, 9 + beams, 0);
  const std::size_t poses = 10 + beams + remissions;
  expect_words(words, poses + 14);
  if (std::fabs(header.angle_min_rad) > kTwoPi || header.fov_rad < 0.0 || header.fov_rad > 1.01 * kTwoPi ||
      header.increment_rad < 0.0 || header.increment_rad > kPi || header.max_range_m < 0.0) {
    throw Malformed{
        "expected start angle, field of view, resolution [rad] and maximum range [m] as words 3 to 6, "
        "found " +
        quoted(words[2]) + " " + quoted(words[3]) + " " + quoted(words[4]) + " " + quoted(words[5])};
  }
  std::vector<float> ranges = ranges_at(words, 9, beams);
  const Pose2 laser_pose = pose_at(words, poses);
  const Pose2 robot_pose = pose_at(words, poses + 3);
  const double seconds = number_at(words, poses + 11);
  const std::size_t laser = robot_laser(beams, header);
  LaserSource& source = sources_[laser];
  source.robot_pose_seen =
      source.robot_pose_seen || robot_pose.x != 0.0 || robot_pose.y != 0.0 || robot_pose.theta != 0.0;
  if (source.laser_poses.empty()) {
    source.base_T_laser = between(robot_pose, laser_pose);
  }
  source.laser_poses.push_back(laser_pose);
  add_scan(laser, robot_pose, std::move(ranges), words[poses + 11], seconds);
}

void Reader::read_parameter(const Words& words) {
  expect_words(words, 3, true);
  log_.parameters[std::string(words[1])] = std::string(words[2]);
}

void Reader::add_scan(std::size_t laser, const Pose2& odometry, std::vector<float> ranges, std::string_view stamp,
                      double seconds) {
  if (!log_.scans.empty() && seconds < log_.scans.back().seconds) {
    ++log_.backward_stamps;
  }
  LogScan scan;
  scan.laser = laser;
  scan.seconds = seconds;
  scan.stamp = stamp;
  scan.odometry = odometry;
  scan.ranges = std::move(ranges);
  scan.line = line_;
  log_.scans.push_back(std::move(scan));
}

std::size_t Reader::old_laser(bool rear, std::size_t beams) {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (!sources_[i].header && sources_[i].rear == rear && sources_[i].beams == beams) {
      return i;
    }
  }
  LaserSource source;
  source.rear = rear;
  source.beams = beams;
  sources_.push_back(std::move(source));
  return sources_.size() - 1;
}

std::size_t Reader::robot_laser(std::size_t beams, const LaserHeader& header) {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (sources_[i].header && sources_[i].beams == beams && same_header(*sources_[i].header, header)) {
      return i;
    }
  }
  LaserSource source;
  source.beams = beams;
  source.header = header;
  sources_.push_back(std::move(source));
  return sources_.size() - 1;
}

std::optional<double> Reader::parameter(const std::string& name) const {
  const auto found = log_.parameters.find(name);
  double value = 0.0;
  if (found == log_.parameters.end() || !parse_number(found->second, value)) {
    return std::nullopt;
  }
  return value;
}

void Reader::finish() {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    settle_robot_laser_poses(i);
  }
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    log_.lasers.push_back(spec_of(i));
  }
  for (const LogScan& scan : log_.scans) {
    const double max_range_m = log_.lasers[scan.laser].max_range_m;
    for (const float range : scan.ranges) {
      log_.no_return_readings += static_cast<double>(range) >= max_range_m ? 1U : 0U;
    }
  }
}

/// Where no line of this laser fills in the robot's pose, the laser's pose is the odometry and the mounting unknown.
void Reader::settle_robot_laser_poses(std::size_t laser) {
  LaserSource& source = sources_[laser];
  const auto differs = [&source](const Pose2& pose) {
    const Pose2& first = source.laser_poses.front();
    return pose.x != first.x || pose.y != first.y || pose.theta != first.theta;
  };
  if (!source.header || source.robot_pose_seen ||
      std::none_of(source.laser_poses.begin(), source.laser_poses.end(), differs)) {
    return;
  }
  source.base_T_laser = {};
  std::size_t next = 0;
  for (LogScan& scan : log_.scans) {
    if (scan.laser == laser) {
      scan.odometry = source.laser_poses[next++];
    }
  }
}

LaserSpec Reader::spec_of(std::size_t laser) const {
  const LaserSource& source = sources_[laser];
  LaserSpec spec;
  spec.rear = source.rear;
  spec.beams = source.beams;
  if (source.header) {
    spec.base_T_laser = source.base_T_laser;
  } else {
    spec.base_T_laser.x = parameter(source.rear ? "robot_rearlaser_offset" : "robot_frontlaser_offset").value_or(0.0);
    spec.base_T_laser.theta = source.rear ? wrap_angle(kPi) : 0.0;
  }
  set_angles(spec, source);
  set_max_range(spec, laser);
  return spec;
}

void Reader::set_angles(LaserSpec& spec, const LaserSource& source) const {
  const auto gaps = static_cast<double>(std::max<std::size_t>(source.beams, 2) - 1);
  if (options_.fov_rad) {
    spec.increment_rad = *options_.fov_rad / gaps;
    spec.angle_min_rad = -*options_.fov_rad / 2.0;
    return;
  }
  if (source.header && (source.header->increment_rad > 0.0 || source.header->fov_rad > 0.0)) {
    spec.increment_rad =
        source.header->increment_rad > 0.0 ? source.header->increment_rad : source.header->fov_rad / gaps;
    spec.angle_min_rad = source.header->angle_min_rad;
    return;
  }
  // The scanners of these logs give half a turn with or without its last beam, so 180 beams are 1 degree apart as 181
  // are, and 360 half a degree as 361 are.
  const bool without_last = source.beams == 180 || source.beams == 360;
  spec.increment_rad = without_last ? kPi / static_cast<double>(source.beams) : kPi / gaps;
  spec.angle_min_rad = -kHalfPi;
  const auto resolution = parameter(source.rear ? "laser_rear_laser_resolution" : "laser_front_laser_resolution");
  if (resolution && *resolution > 0.0 && *resolution * kDegree * gaps <= kTwoPi) {
    spec.increment_rad = *resolution * kDegree;
    // A scanner of another field of view looks ahead with its middle beam.
    if (std::fabs(spec.increment_rad * gaps - kPi) > 1.5 * spec.increment_rad) {
      spec.angle_min_rad = -spec.increment_rad * gaps / 2.0;
    }
  }
}

void Reader::set_max_range(LaserSpec& spec, std::size_t laser) const {
  if (options_.max_range_m) {
    spec.max_range_m = *options_.max_range_m;
    spec.max_range_source = MaxRangeSource::option;
    return;
  }
  spec.max_range_m = kLargestRange_m;
  const std::optional<double> stated = parameter(spec.rear ? "robot_rear_laser_max" : "robot_front_laser_max");
  if (sources_[laser].header && sources_[laser].header->max_range_m > 0.0) {
    spec.max_range_m = std::min(kLargestRange_m, sources_[laser].header->max_range_m);
    spec.max_range_source = MaxRangeSource::header;
  } else if (stated && *stated > 0.0) {
    spec.max_range_m = std::min(kLargestRange_m, *stated);
    spec.max_range_source = MaxRangeSource::parameter;
  }
  std::vector<const std::vector<float>*> scans;
  for (const LogScan& scan : log_.scans) {
    if (scan.laser == laser) {
      scans.push_back(&scan.ranges);
    }
  }
  // Half a millimetre below, under the millimetre or centimetre that logs resolve, above what rounding to float moves.
  const std::optional<double> no_return = find_no_return_value(scans);
  if (no_return && *no_return - 5e-4 < spec.max_range_m) {
    spec.max_range_m = *no_return - 5e-4;
    spec.max_range_source = MaxRangeSource::detected;
  } else if (no_return && spec.max_range_source == MaxRangeSource::limit) {
    spec.max_range_source = MaxRangeSource::detected;
  }
}

}  // namespace

const char* to_string(MaxRangeSource source) {
  switch (source) {
    case MaxRangeSource::option:
      return "option";
    case MaxRangeSource::parameter:
      return "parameter";
    case MaxRangeSource::header:
      return "header";
    case MaxRangeSource::detected:
      return "detected";
    case MaxRangeSource::limit:
      break;
  }
  return "limit";
}

std::optional<double> find_no_return_value(const std::vector<const std::vector<float>*>& scans) {
  constexpr double kBand = 0.99;
  constexpr double kLeastShare = 0.0002;
  constexpr std::size_t kLeastCount = 20;
  constexpr std::size_t kMostValues = 4;  // SICK scanners: one code each for dazzle, no echo and the like
  constexpr double kRepeatedShare = 0.9;

  std::map<float, std::size_t> counts;
  std::size_t total = 0;
  for (const std::vector<float>* ranges : scans) {
    for (const float range : *ranges) {
      if (range > 0.0F) {
        ++counts[range];
      }
    }
    total += ranges->size();
  }
  const double least = std::max(static_cast<double>(kLeastCount), kLeastShare * static_cast<double>(total));
  double above = 0.0;
  for (auto top = counts.rbegin(); top != counts.rend() && above < kLeastShare * static_cast<double>(total); ++top) {
    std::vector<std::pair<std::size_t, float>> band;
    double in_band = 0.0;
    for (auto value = top;
         value != counts.rend() && static_cast<double>(value->first) >= kBand * static_cast<double>(top->first);
         ++value) {
      band.emplace_back(value->second, value->first);
      in_band += static_cast<double>(value->second);
    }
    std::sort(band.rbegin(), band.rend());
    double repeated = 0.0;
    float lowest = top->first;
    for (std::size_t i = 0; i < std::min(kMostValues, band.size()); ++i) {
      if (static_cast<double>(band[i].first) < 0.01 * in_band || band[i].first < 2) {
        break;
      }
      repeated += static_cast<double>(band[i].first);
      lowest = std::min(lowest, band[i].second);
    }
    if (in_band >= least && repeated >= kRepeatedShare * in_band) {
      return static_cast<double>(lowest);
    }
    above += static_cast<double>(top->second);
  }
  return std::nullopt;
}

Log read_carmen_log(const std::string& path, const LogOptions& options) {
  for (const std::optional<double>& value : {options.fov_rad, options.max_range_m}) {
    if (value && !(std::isfinite(*value) && *value > 0.0)) {
      throw std::invalid_argument("field of view and maximum range must be positive and finite");
    }
  }
  return Reader(path, options).read();
}

}  // namespace mellin::host
