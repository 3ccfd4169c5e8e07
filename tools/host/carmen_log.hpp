// Reads CARMEN logs (CARMEN robot navigation toolkit, Montemerlo et al. 2003), plain or gzip: FLASER, RLASER,
// ROBOTLASER1, ODOM and PARAM lines. Any other line is passed over and counted by its name.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mellin/core/se2.hpp"

namespace mellin::host {

/// How the maximum range of a laser was found.
enum class MaxRangeSource {
  option,     ///< LogOptions::max_range_m
  parameter,  ///< a PARAM line of the log
  header,     ///< the header of ROBOTLASER1
  detected,   ///< just below the value that the log repeats where a beam hit nothing
  limit,      ///< the log repeats no such value: kLargestRange_m
};
const char* to_string(MaxRangeSource source);

/// No reading over this is taken for an obstacle, m: the largest range of the laser scanners of these logs.
inline constexpr double kLargestRange_m = 80.0;

/// A laser of the log: what is the same for all its scans.
struct LaserSpec {
  bool rear = false;  ///< RLASER
  std::size_t beams = 0;
  double angle_min_rad = 0.0;  ///< of the first beam, in the laser's frame
  double increment_rad = 0.0;  ///< from a beam to the next, counterclockwise
  double max_range_m = 0.0;    ///< a range at or over this is a beam that hit nothing
  MaxRangeSource max_range_source = MaxRangeSource::limit;
  Pose2 base_T_laser;  ///< mounting pose on the robot's base
};

struct LogScan {
  std::size_t laser = 0;      ///< index into Log::lasers
  double seconds = 0.0;       ///< the first stamp of the line
  std::string stamp;          ///< the same as the log writes it
  Pose2 odometry;             ///< odometry_T_base: raw odometry of the robot's base
  std::vector<float> ranges;  ///< m, as in the log (finite; no-returns included); LaserSpec::beams of them
  std::size_t line = 0;       ///< line number in the log, from 1
};

struct LogOptions {
  std::optional<double> fov_rad;      ///< angle from the first beam to the last, centred on the laser's x axis
  std::optional<double> max_range_m;  ///< overrides what the log says
};

/// A line that claims to be of a known kind but is malformed, and was passed over.
struct BadLine {
  std::size_t line = 0;
  std::string reason;  ///< what was expected and what was found
};

struct Log {
  std::string path;
  std::vector<LaserSpec> lasers;
  std::vector<LogScan> scans;                      ///< in the order of the file
  std::size_t odometry_lines = 0;                  ///< ODOM
  std::map<std::string, std::string> parameters;   ///< PARAM, the last value of each name
  std::map<std::string, std::size_t> passed_over;  ///< lines of other kinds, counted by their first word
  std::size_t bad_line_count = 0;
  std::vector<BadLine> bad_lines;      ///< the first kKeptBadLines of them
  std::size_t backward_stamps = 0;     ///< scans whose stamp is earlier than that of the scan before
  std::size_t no_return_readings = 0;  ///< readings at or over their laser's maximum range
};
inline constexpr std::size_t kKeptBadLines = 20;
/// FLASER and ROBOTLASER1 lines that claim more beams are malformed.
inline constexpr std::size_t kMaxBeams = 8192;

/// Reads a log. Malformed and truncated lines are counted in the result and passed over.
///
/// Geometry: 180 or 181 beams are 1 degree apart, 360 or 361 half a degree, the first beam at -90 degrees; any other
/// number spans 180 degrees. PARAM laser_front_laser_resolution [degrees], then options, override; ROBOTLASER1 carries
/// its own. RLASER looks backwards, robot_rearlaser_offset ahead of the base.
///
/// Throws std::runtime_error "file:line: expected …, found …" where the file cannot be read to its end as text or
/// gzip, or holds no laser scan; std::invalid_argument where an option is not positive and finite.
Log read_carmen_log(const std::string& path, const LogOptions& options = {});

/// The least of the values that stand for "no return" in these readings: sensors report it as one large value, or a
/// few, that repeat exactly. The largest readings are such values where those within 1 % of the largest are at least
/// 20 and at least 0.02 % of all, and nearly all of them are exact repetitions of a few values. Larger readings that
/// are fewer than 0.02 % do not hide them (glitches). None where no value is of that kind.
std::optional<double> find_no_return_value(const std::vector<const std::vector<float>*>& scans);

}  // namespace mellin::host
