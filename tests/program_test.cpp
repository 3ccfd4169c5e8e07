// The program as a person calls it: what it writes, what it says, and what it returns.
#include <doctest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "host/carmen_log.hpp"
#include "host/scorer.hpp"
#include "host/simulator.hpp"
#include "host/tum.hpp"
#include "tests/host_support.hpp"
#include "tests/support/mellin_program.hpp"
#include "tests/support/simulated_log.hpp"

using namespace mellin;
using mellin::test::kSanitized;
using mellin::test::lines_of;
using mellin::test::mellin_program;
using mellin::test::Outcome;
using mellin::test::read_bytes;
using mellin::test::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

std::size_t columns(const std::string& line) {
  return static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
}

/// The first scans of a simulated drive; returns the stamps, as the log writes them.
std::vector<std::string> write_log(const TemporaryFolder& folder, const std::string& name, std::size_t scans) {
  host::SimOptions options;
  options.loops = 1;
  const std::string whole = host::write_simulation(options, folder.path()).front();
  std::vector<std::string> stamps;
  std::string kept;
  for (const std::string& line : lines_of(read_bytes(whole))) {
    if (line.rfind("FLASER", 0) == 0) {
      if (stamps.size() == scans) {
        break;
      }
      std::istringstream words(line);
      std::vector<std::string> all;
      for (std::string word; words >> word;) {
        all.push_back(word);
      }
      stamps.push_back(all[all.size() - 3]);
    }
    kept += line + "\n";
  }
  (void)folder.write(name, kept);
  return stamps;
}

constexpr std::size_t kScans = kSanitized ? 120 : 400;

}  // namespace

TEST_CASE("mellin map writes every file of the contract, and they parse") {
  const TemporaryFolder folder;
  const std::vector<std::string> stamps = write_log(folder, "a.log", kScans);
  REQUIRE(stamps.size() == kScans);
  const std::string dir = folder.path() + "/out";
  const Outcome run = mellin_program(folder, "map " + folder.path() + "/a.log -o " + dir + " --profile micro");
  REQUIRE(run.status == 0);
  CHECK(run.out.find(dir + "/map.png") != std::string::npos);
  CHECK(run.err.find('\r') == std::string::npos);  // no progress where there is no terminal

  for (const char* name : {"trajectory-0.tum", "live-0.tum"}) {
    CAPTURE(name);
    const std::vector<std::string> lines = lines_of(read_bytes(dir + "/" + name));
    REQUIRE(lines.size() == stamps.size());
    std::size_t equal = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      equal += lines[i].substr(0, lines[i].find(' ')) == stamps[i] ? 1U : 0U;
    }
    CHECK(equal == stamps.size());
    CHECK(host::read_tum(dir + "/" + name).size() == stamps.size());
  }
  const std::vector<host::StampedPose> truth = host::read_tum(folder.path() + "/sim-0.tum");
  const host::TrajectoryScore score = host::score_trajectory(host::read_tum(dir + "/trajectory-0.tum"), truth);
  CHECK(score.paired == kScans);

  const std::vector<std::string> submaps = lines_of(read_bytes(dir + "/submaps.csv"));
  REQUIRE(submaps.size() >= 2);
  CHECK(submaps[0] == "id,session,component,scans,timestamp,x,y,theta");
  const std::vector<std::string> matches = lines_of(read_bytes(dir + "/matches.csv"));
  REQUIRE(!matches.empty());
  CHECK(matches[0] == "a,b,kind,stage,score,agreement,x,y,theta,accepted,why");
  for (const std::string& line : submaps) {
    CHECK(columns(line) == 8);
  }
  for (const std::string& line : matches) {
    CHECK(columns(line) == 11);
  }

  const nlohmann::json summary = nlohmann::json::parse(read_bytes(dir + "/summary.json"));
  CHECK(summary.at("version").is_string());
  CHECK(summary.at("config").is_object());
  REQUIRE(summary.at("sessions").size() == 1);
  const nlohmann::json& session = summary["sessions"][0];
  CHECK(session.at("log") == folder.path() + "/a.log");
  CHECK(session.at("id").get<std::string>().size() == 36);
  CHECK(session.at("scans") == kScans);
  CHECK(session.at("submaps") == submaps.size() - 1);
  CHECK(session.at("component") == 0);
  CHECK(summary.at("components") == 1);
  for (const char* key : {"odometry", "loop", "merge", "rejected"}) {
    CHECK(summary.at("edges").at(key).is_number_unsigned());
  }
  CHECK(summary["edges"]["odometry"] == submaps.size() - 2);
  for (const char* key : {"possible", "screened", "registered", "accepted"}) {
    CHECK(summary.at("pairs").at(key).is_number_unsigned());
  }
  for (const char* key : {"total", "local_mapping", "screening", "registration", "optimisation", "store"}) {
    CHECK(summary.at("seconds").at(key).get<double>() >= 0.0);
  }
  CHECK(summary.at("memory").at("arena_bytes") == summary.at("memory").at("arena_used_bytes"));
  CHECK(summary["memory"].at("heap_allocations_after_init") == 0);
  CHECK(summary["memory"].at("peak_rss_bytes").get<std::uint64_t>() > 1000000);
  for (const char* key : {"logical_bytes", "programmed_bytes", "erases", "max_block_erases"}) {
    CHECK(summary.at("store").at(key).is_number_unsigned());
  }
  CHECK(summary["store"].at("submaps") == submaps.size() - 1);

  const std::string graph = read_bytes(dir + "/graph.g2o");
  std::size_t vertices = 0, edges = 0;
  for (const std::string& line : lines_of(graph)) {
    vertices += line.rfind("VERTEX_SE2 ", 0) == 0 ? 1U : 0U;
    edges += line.rfind("EDGE_SE2 ", 0) == 0 ? 1U : 0U;
  }
  CHECK(vertices == submaps.size() - 1);
  CHECK(edges >= vertices - 1);

  const std::string pgm = read_bytes(dir + "/map.pgm");
  std::istringstream header(pgm.substr(0, 64));
  std::string magic;
  std::size_t width = 0, height = 0, most = 0;
  header >> magic >> width >> height >> most;
  CHECK(magic == "P5");
  CHECK(most == 255);
  CHECK(pgm.size() == static_cast<std::size_t>(header.tellg()) + 1 + width * height);
  std::size_t dark = 0, light = 0;
  for (std::size_t i = pgm.size() - width * height; i < pgm.size(); ++i) {
    const auto value = static_cast<unsigned char>(pgm[i]);
    dark += value < 50 ? 1U : 0U;
    light += value > 250 ? 1U : 0U;
  }
  CHECK(dark > 200);
  CHECK(light > 2000);
  const std::string yaml = read_bytes(dir + "/map.yaml");
  for (const char* key :
       {"image: map.pgm", "resolution: 0.1", "origin: [", "negate: 0", "occupied_thresh: ", "free_thresh: "}) {
    CHECK(yaml.find(key) != std::string::npos);
  }
  CHECK(read_bytes(dir + "/map.png").substr(0, 8) == "\x89PNG\r\n\x1a\n");
  const std::string report = read_bytes(dir + "/report.html");
  CHECK(report.find("<html") != std::string::npos);
  CHECK(report.find("</html>") != std::string::npos);
  CHECK(report.find("src=\"http") == std::string::npos);  // self-contained
  CHECK_FALSE(fs::exists(dir + "/stored.log"));           // only with --store
}

TEST_CASE("bad input: one line on standard error, status 1, and 2 for a wrong call") {
  const TemporaryFolder folder;
  const std::string dir = folder.path() + "/out";
  (void)folder.write("empty.log", "");
  (void)folder.write("text.log", "these are\nno scans\n");
  (void)folder.write("cut.log.gz", std::string("\x1f\x8b\x08\x00garbage", 11));
  for (const std::string name : {"missing.log", "empty.log", "text.log", "cut.log.gz"}) {
    CAPTURE(name);
    const Outcome run = mellin_program(folder, "map " + folder.path() + "/" + name + " -o " + dir);
    CHECK(run.status == 1);
    CHECK(lines_of(run.err).size() == 1);
    CHECK(run.err.find(name) != std::string::npos);
  }
  (void)write_log(folder, "a.log", 5);
  const std::string log = folder.path() + "/a.log";
  for (const std::string& arguments : std::vector<std::string>{
           "map " + log + " -o " + dir + " --nonsense", "map " + log, "map -o " + dir, "", "nonsense",
           "map " + log + " -o " + dir + " --profile huge", "map " + log + " -o " + dir + " --threads 0"}) {
    CAPTURE(arguments);
    CHECK(mellin_program(folder, arguments).status == 2);
  }
  // So is a wrong setting, with words.
  const Outcome setting = mellin_program(folder, "map " + log + " -o " + dir + " --set particels=3");
  CHECK(setting.status == 2);
  CHECK(setting.err.find("particels") != std::string::npos);
  // A folder that cannot be made.
  CHECK(mellin_program(folder, "map " + log + " -o " + log + "/sub").status == 1);
  // An image that is none is left alone.
  (void)folder.write("image", "not an image");
  const Outcome image = mellin_program(folder, "map " + log + " -o " + dir + " --store " + folder.path() + "/image");
  CHECK(image.status == 1);
  CHECK(read_bytes(folder.path() + "/image") == "not an image");
}

TEST_CASE("mellin entropy: the truth is as sharp as itself, and sharper than the odometry") {
  const TemporaryFolder folder;
  (void)write_log(folder, "short.log", kScans);
  const std::string log = folder.path() + "/short.log", truth = folder.path() + "/sim-0.tum";
  std::vector<host::StampedPose> odometry;
  for (const host::LogScan& scan : host::read_carmen_log(log).scans) {
    odometry.push_back({scan.stamp, scan.seconds, scan.odometry});
  }
  host::write_tum(folder.path() + "/odometry.tum", odometry);
  const auto ratio = [&](const std::string& estimate) {
    const std::string picture = folder.path() + "/map.png";
    const Outcome done = mellin_program(
        folder, "entropy " + log + " " + estimate + " --against " + truth + " --resolution 0.1 --json -o " + picture);
    REQUIRE(done.status == 0);
    CHECK(fs::file_size(picture) > 100);
    const nlohmann::json json = nlohmann::json::parse(done.out);
    CHECK(json["scans"] == kScans);
    CHECK(json["map"]["cells"] > 1000);
    return json["entropy_ratio"].get<double>();
  };
  CHECK(ratio(truth) == doctest::Approx(1.0));
  CHECK(ratio(folder.path() + "/odometry.tum") > 1.02);
  const Outcome text = mellin_program(folder, "entropy " + log + " " + truth);
  CHECK(text.status == 0);
  CHECK(text.out.find("bits a cell") != std::string::npos);
  const Outcome strange =
      mellin_program(folder, "entropy " + log + " " + folder.write("other.tum", "1e9 0 0 0 0 0 0 1\n"));
  CHECK(strange.status == 1);
  CHECK(lines_of(strange.err).size() == 1);
}

TEST_CASE("--store: a second call continues the map, and what stored.log promises is in the image") {
  const TemporaryFolder folder;
  (void)write_log(folder, "a.log", kScans);
  const std::string image = folder.path() + "/map.img";
  const auto call = [&](const std::string& out) {
    return mellin_program(folder, "map " + folder.path() + "/a.log --profile micro --store " + image + " -o " +
                                      folder.path() + "/" + out);
  };
  const auto summary = [&](const std::string& out) {
    return nlohmann::json::parse(read_bytes(folder.path() + "/" + out + "/summary.json"));
  };
  const auto verified = [&](const std::string& out) {
    return mellin_program(folder, "store verify " + image + " --against " + folder.path() + "/" + out + "/stored.log")
        .status;
  };
  REQUIRE(call("one").status == 0);
  const std::size_t first = lines_of(read_bytes(folder.path() + "/one/stored.log")).size();
  CHECK(first == summary("one").at("store").at("submaps"));
  CHECK(first > 0);
  CHECK(verified("one") == 0);
  REQUIRE(call("two").status == 0);
  const std::size_t second = lines_of(read_bytes(folder.path() + "/two/stored.log")).size();
  CHECK(second > 0);
  CHECK(summary("two").at("store").at("submaps") == first + second);
  CHECK(lines_of(read_bytes(folder.path() + "/two/submaps.csv")).size() == 1 + first + second);
  CHECK(verified("one") == 0);
  CHECK(verified("two") == 0);
  // Another configuration is refused, and the image keeps what it has.
  const Outcome other = mellin_program(
      folder, "map " + folder.path() + "/a.log --profile nano --store " + image + " -o " + folder.path() + "/three");
  CHECK(other.status == 1);
  CHECK(verified("two") == 0);
}
