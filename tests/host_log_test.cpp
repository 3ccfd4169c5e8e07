#include <doctest.h>
#include <zlib.h>

#include <cmath>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "mellin/core/random.hpp"
#include "tests/host_support.hpp"

using namespace mellin;
using namespace mellin::host;
using mellin::test::real_data;
using mellin::test::TemporaryFolder;

namespace {

constexpr double kDegree = kPi / 180.0;

std::string flaser(const std::vector<double>& ranges, const std::string& stamp = "1.5") {
  std::string line = "FLASER ";
  line += std::to_string(ranges.size());
  for (const double range : ranges) {
    line += ' ';
    line += std::to_string(range);
  }
  return line + " 9 9 9 1.25 -2.5 0.5 " + stamp + " host 7.0\n";
}

std::string flaser_of(std::size_t beams) { return flaser(std::vector<double>(beams, 2.0)); }

std::string robot_laser(const std::string& poses) {
  return "ROBOTLASER1 0 -1.0 2.0 0.5 30.0 0.01 0 5 1 2 3 4 5 2 100 200 " + poses +
         " 0.1 0.2 0.3 0.4 0.5 12.25 host 13.0\n";
}

Log read_text(const std::string& text, const LogOptions& options = {}) {
  const TemporaryFolder folder;
  return read_carmen_log(folder.write("a.log", text), options);
}

std::string error_of(const std::string& path) {
  try {
    (void)read_carmen_log(path);
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string gzip(const std::string& text) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/a.gz";
  gzFile out = gzopen(path.c_str(), "wb");
  gzwrite(out, text.data(), static_cast<unsigned>(text.size()));
  gzclose(out);
  return test::read_bytes(path);
}

std::optional<double> no_return_of(const std::vector<float>& ranges) { return find_no_return_value({&ranges}); }

/// Ranges that no sensor repeats: all different, up to `largest`.
std::vector<float> spread(std::size_t count, double largest) {
  std::vector<float> ranges(count);
  for (std::size_t i = 0; i < count; ++i) {
    ranges[i] = static_cast<float>(largest * (static_cast<double>(i) + 1.0) / static_cast<double>(count));
  }
  return ranges;
}

void append(std::vector<float>& ranges, std::size_t count, float value) { ranges.insert(ranges.end(), count, value); }

double path_length(const Log& log) {
  double length = 0.0;
  for (std::size_t i = 1; i < log.scans.size(); ++i) {
    length += translation(between(log.scans[i - 1].odometry, log.scans[i].odometry));
  }
  return length;
}

}  // namespace

TEST_CASE("a FLASER line gives ranges, the odometry after the laser's pose, and the first stamp as written") {
  const Log log = read_text("# comment\n\nODOM 0 0 0 0 0 0 1 h 1\n" + flaser({1.5, 2.25, 3.0}, "0012.500"));
  REQUIRE(log.scans.size() == 1);
  const LogScan& scan = log.scans[0];
  CHECK(scan.ranges == std::vector<float>{1.5F, 2.25F, 3.0F});
  CHECK(scan.odometry.x == 1.25);
  CHECK(scan.odometry.y == -2.5);
  CHECK(scan.odometry.theta == 0.5);
  CHECK(scan.stamp == "0012.500");
  CHECK(scan.seconds == 12.5);
  CHECK(scan.line == 4);
  CHECK(log.odometry_lines == 1);
  CHECK(log.bad_line_count == 0);
}

TEST_CASE("the number of beams tells the angles") {
  struct Case {
    std::size_t beams;
    double increment_deg;
  };
  for (const Case& c : {Case{180, 1.0}, Case{181, 1.0}, Case{360, 0.5}, Case{361, 0.5}, Case{91, 2.0}}) {
    const LaserSpec laser = read_text(flaser_of(c.beams)).lasers.at(0);
    CHECK(laser.beams == c.beams);
    CHECK(laser.angle_min_rad == doctest::Approx(-90.0 * kDegree));
    CHECK(laser.increment_rad == doctest::Approx(c.increment_deg * kDegree));
  }
}

TEST_CASE("a resolution in the log, and a field of view in the options, override the angles") {
  const std::string half = "PARAM laser_front_laser_resolution 0.5 1 h 1\n";
  const LaserSpec centred = read_text(half + flaser_of(181)).lasers.at(0);
  CHECK(centred.increment_rad == doctest::Approx(0.5 * kDegree));
  CHECK(centred.angle_min_rad == doctest::Approx(-45.0 * kDegree));
  const LaserSpec whole = read_text(flaser_of(360) + half).lasers.at(0);
  CHECK(whole.angle_min_rad == doctest::Approx(-90.0 * kDegree));
  LogOptions options;
  options.fov_rad = 270.0 * kDegree;
  const LaserSpec wide = read_text(half + flaser_of(541), options).lasers.at(0);
  CHECK(wide.increment_rad == doctest::Approx(0.5 * kDegree));
  CHECK(wide.angle_min_rad == doctest::Approx(-135.0 * kDegree));
}

TEST_CASE("the rear laser looks backwards and offsets place both lasers") {
  std::string rear = flaser({1, 2, 3});
  rear[0] = 'R';
  const Log log = read_text("PARAM robot_frontlaser_offset 0.1 h 1\nPARAM robot_rearlaser_offset -0.2 h 1\n" +
                            flaser({4, 5, 6}) + rear + flaser({7, 8, 9}));
  REQUIRE(log.lasers.size() == 2);
  CHECK(log.scans[0].laser == 0);
  CHECK(log.scans[1].laser == 1);
  CHECK(log.scans[2].laser == 0);
  CHECK(!log.lasers[0].rear);
  CHECK(log.lasers[1].rear);
  CHECK(log.lasers[0].base_T_laser.x == 0.1);
  CHECK(log.lasers[0].base_T_laser.theta == 0.0);
  CHECK(log.lasers[1].base_T_laser.x == -0.2);
  CHECK(std::fabs(log.lasers[1].base_T_laser.theta) == doctest::Approx(kPi));
}

TEST_CASE("ROBOTLASER1 carries its own geometry and the mounting in its two poses") {
  // The robot at (3, 4) looks along y; a laser half a metre ahead of it is at (3, 4.5).
  const Log log = read_text(robot_laser("3 4.5 1.570796326794897 3 4 1.570796326794897"));
  REQUIRE(log.scans.size() == 1);
  CHECK(log.scans[0].odometry.x == 3.0);
  CHECK(log.scans[0].odometry.y == 4.0);
  CHECK(log.scans[0].stamp == "12.25");
  CHECK(log.scans[0].ranges.size() == 5);
  const LaserSpec& laser = log.lasers.at(0);
  CHECK(laser.angle_min_rad == -1.0);
  CHECK(laser.increment_rad == 0.5);
  CHECK(laser.max_range_m == 30.0);
  CHECK(laser.max_range_source == MaxRangeSource::header);
  CHECK(laser.base_T_laser.x == doctest::Approx(0.5));
  CHECK(laser.base_T_laser.y == doctest::Approx(0.0));
  CHECK(laser.base_T_laser.theta == doctest::Approx(0.0));
}

TEST_CASE("ROBOTLASER1 without the robot's pose takes the laser's for odometry") {
  const Log log = read_text(robot_laser("3 4 0.5 0 0 0") + robot_laser("3.5 4 0.6 0 0 0"));
  REQUIRE(log.scans.size() == 2);
  CHECK(log.scans[1].odometry.x == 3.5);
  CHECK(log.scans[1].odometry.theta == 0.6);
  CHECK(log.lasers.at(0).base_T_laser.x == 0.0);
}

TEST_CASE("malformed lines are passed over, counted and reported with their line") {
  const std::string good = flaser({1, 2, 3});
  const Log log = read_text(good +                                                                //
                            "FLASER 3 1 2\n"                                                      //
                            "FLASER 3 1 nan 3 0 0 0 0 0 0 1 h 1\n"                                //
                            "FLASER 3 1 inf 3 0 0 0 0 0 0 1 h 1\n"                                //
                            "FLASER 3 1 two 3 0 0 0 0 0 0 1 h 1\n"                                //
                            "FLASER -3 1 2 3 0 0 0 0 0 0 1 h 1\n"                                 //
                            "FLASER 99999999999999999999 1 2 3 0 0 0 0 0 0 1 h 1\n"               //
                            "FLASER 3 1 2 3 0 0 0 1e300 0 0 1 h 1\n"                              //
                            "FLASER 3 1 2 3 0 0 0 0 0 0 1 h 1 surplus\n"                          //
                            "FLASER\n"                                                            //
                            "ROBOTLASER1 0 -1 2 0.5 30 0 0 5 1 2 3\n"                             //
                            "ROBOTLASER1 0 -1 2 0.5 30 0 0 1 2 -1 0 0 0 0 0 0 0 0 0 0 0 1 h 1\n"  //
                            "SYNC go\nSYNC again\nTRUEPOS 1 2 3\n" +
                            good);
  CHECK(log.scans.size() == 2);
  CHECK(log.bad_line_count == 11);
  REQUIRE(log.bad_lines.size() == 11);
  CHECK(log.bad_lines[0].line == 2);
  CHECK(contains(log.bad_lines[1].reason, "'nan'"));
  CHECK(log.bad_lines[10].line == 12);
  CHECK(log.passed_over.at("SYNC") == 2);
  CHECK(log.passed_over.at("TRUEPOS") == 1);
  CHECK(log.scans[1].line == 16);
}

TEST_CASE("stamps that run backwards are counted and kept") {
  const Log log = read_text(flaser({1, 2}, "5.0") + flaser({1, 2}, "4.0") + flaser({1, 2}, "6.0"));
  CHECK(log.scans.size() == 3);
  CHECK(log.backward_stamps == 1);
}

TEST_CASE("what cannot be read is an error that names the file and the line") {
  const TemporaryFolder folder;
  const std::string none = folder.path() + "/none.log";
  CHECK(contains(error_of(none), none));
  const std::string empty = folder.write("empty.log", "");
  CHECK(contains(error_of(empty), empty + ":0: expected a laser scan"));
  const std::string bad = folder.write("bad.log", "SYNC a\nFLASER 3 1 2\n");
  CHECK(contains(error_of(bad), bad + ":2: expected a laser scan"));
  CHECK(contains(error_of(bad), "line 2: FLASER"));
  CHECK(contains(error_of(folder.path()), folder.path()));
}

TEST_CASE("gzip is read as plain text is, and one that ends early is an error") {
  std::string text;
  Random random(1, 1);
  for (int i = 0; i < 300; ++i) {
    text += flaser({10.0 * random.uniform(), 10.0 * random.uniform()}, std::to_string(i));
  }
  const TemporaryFolder folder;
  const std::string bytes = gzip(text);
  const Log log = read_carmen_log(folder.write("whole.log.gz", bytes));
  CHECK(log.scans.size() == 300);
  CHECK(log.scans[299].seconds == 299.0);
  const std::string cut = folder.write("cut.log.gz", bytes.substr(0, bytes.size() / 2));
  CHECK(contains(error_of(cut), cut + ":"));
  CHECK(contains(error_of(cut), "expected text or gzip data"));
  std::string flipped = bytes;
  flipped[bytes.size() / 2] = static_cast<char>(flipped[bytes.size() / 2] ^ 0x55);
  CHECK(!error_of(folder.write("flipped.log.gz", flipped)).empty());
}

TEST_CASE("a line without end is not kept in memory") {
  std::string text = "FLASER ";
  text.append(std::size_t{3} << 20U, '1');
  text += '\n';
  text += flaser({1, 2});
  const Log log = read_text(text);
  CHECK(log.bad_line_count == 1);
  CHECK(log.scans.size() == 1);
  CHECK(log.scans[0].line == 2);
}

TEST_CASE("a log cut at any byte, or with any byte changed, gives scans or an error, nothing else") {
  const std::string whole = "PARAM robot_frontlaser_offset 0.1 h 1\n" + flaser({1.0, 2.0, 81.91}) +
                            robot_laser("1 2 0.1 1 2 0.1") + "ODOM 0 0 0 0 0 0 1 h 1\n";
  const TemporaryFolder folder;
  const auto survive = [&folder](const std::string& text) {
    try {
      const Log log = read_carmen_log(folder.write("a.log", text));
      for (const LogScan& scan : log.scans) {
        REQUIRE(scan.ranges.size() == log.lasers.at(scan.laser).beams);
        REQUIRE(is_finite(scan.odometry));
        REQUIRE(std::isfinite(scan.seconds));
      }
      for (const LaserSpec& laser : log.lasers) {
        REQUIRE(std::isfinite(laser.angle_min_rad));
        REQUIRE(laser.increment_rad >= 0.0);
        REQUIRE(laser.max_range_m > 0.0);
        REQUIRE(laser.max_range_m <= 80.0);
      }
    } catch (const std::runtime_error&) {
    }
  };
  for (std::size_t i = 0; i < whole.size(); ++i) {
    survive(whole.substr(0, i));
  }
  Random random(2, 1);
  for (int i = 0; i < 2000; ++i) {
    std::string changed = whole;
    changed[random.bits() % whole.size()] = static_cast<char>(random.bits() & 0xFFU);
    survive(changed);
  }
}

TEST_CASE("a value that the sensor repeats where it hit nothing is found") {
  std::vector<float> eight = spread(10000, 7.9);
  append(eight, 300, 8.19F);
  CHECK(no_return_of(eight).value() == doctest::Approx(8.19));

  std::vector<float> sick = spread(10000, 35.0);
  append(sick, 500, 81.91F);
  append(sick, 60, 81.87F);
  append(sick, 40, 81.83F);
  CHECK(no_return_of(sick).value() == doctest::Approx(81.83));

  std::vector<float> fifty = spread(90000, 49.95);  // real hits right below the value
  append(fifty, 9500, 50.0F);
  CHECK(no_return_of(fifty).value() == doctest::Approx(50.0));

  std::vector<float> glitch = spread(10000, 20.0);
  append(glitch, 400, 30.0F);
  append(glitch, 1, 327.67F);
  CHECK(no_return_of(glitch).value() == doctest::Approx(30.0));
}

TEST_CASE("no value is taken for no return without evidence") {
  CHECK(!no_return_of({}));
  CHECK(!no_return_of(spread(10000, 20.0)));
  std::vector<float> few = spread(10000, 10.0);
  append(few, 15, 20.0F);
  CHECK(!no_return_of(few));
  CHECK(read_text(flaser({1, 2, 3})).lasers[0].max_range_source == MaxRangeSource::limit);
  CHECK(read_text(flaser({1, 2, 3})).lasers[0].max_range_m == 80.0);
}

TEST_CASE("an option and a parameter set the maximum range; a reading at it counts as no return") {
  std::vector<double> ranges(100, 5.0);
  ranges.resize(140, 10.0);
  LogOptions options;
  options.max_range_m = 10.0;
  const Log log = read_text(flaser(ranges), options);
  CHECK(log.lasers[0].max_range_m == 10.0);
  CHECK(log.lasers[0].max_range_source == MaxRangeSource::option);
  CHECK(log.no_return_readings == 40);
  const Log stated = read_text("PARAM robot_front_laser_max 4.5 h 1\n" + flaser(ranges));
  CHECK(stated.lasers[0].max_range_m == 4.5);
  CHECK(stated.lasers[0].max_range_source == MaxRangeSource::parameter);
  CHECK(stated.no_return_readings == 140);
  options.max_range_m = -1.0;
  CHECK_THROWS_AS((void)read_text(flaser(ranges), options), std::invalid_argument);
}

// Counts: zcat LOG | awk '/^FLASER/{for (i = 3; i < 3 + $2; i++) if ($i >= LIMIT) n++} END {print n}'; numbers of
// scans: the data's README; way by odometry: zcat LOG | awk '/^FLASER/{x = $($2 + 6); y = $($2 + 7); if (k++) s +=
// sqrt((x - a) ^ 2 + (y - b) ^ 2); a = x; b = y} END {print s}'.
TEST_CASE("real logs") {
  struct Case {
    const char* name;
    std::size_t scans;
    std::size_t beams;
    double increment_deg;
    double length_m;
    double max_range_m;
    std::size_t no_returns;
  };
  for (const Case& c : {Case{"intel.log.gz", 4544, 180, 1.0, 549.208, 80.0, 21100},
                        Case{"fr079.log.gz", 4791, 360, 0.5, 392.909, 80.0, 36004},
                        Case{"aces.log.gz", 440, 180, 1.0, 322.114, 50.0, 620}}) {
    const std::string path = real_data(c.name);
    if (path.empty()) {
      continue;
    }
    CAPTURE(path);
    const Log log = read_carmen_log(path);
    CHECK(log.scans.size() == c.scans);
    CHECK(log.bad_line_count == 0);
    REQUIRE(log.lasers.size() == 1);
    CHECK(log.lasers[0].beams == c.beams);
    CHECK(log.lasers[0].increment_rad == doctest::Approx(c.increment_deg * kDegree));
    CHECK(log.lasers[0].max_range_source == MaxRangeSource::detected);
    CHECK(log.lasers[0].max_range_m == doctest::Approx(c.max_range_m).epsilon(1e-4));
    CHECK(log.no_return_readings == c.no_returns);
    CHECK(path_length(log) == doctest::Approx(c.length_m).epsilon(1e-4));
  }
}
