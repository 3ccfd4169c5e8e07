#include <doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "host/file.hpp"
#include "host/png_image.hpp"
#include "host/report.hpp"
#include "host/summary.hpp"

using namespace mellin;
using namespace mellin::host;

namespace {

Summary example() {
  Summary s;
  s.version = "1.2.3";
  s.config = {{"cell_m", 0.05}, {"particles", std::int64_t{10}}, {"profile", std::string("micro")}, {"blur", true}};
  s.sessions = {{"a.log", "0000", 11, 12, 0, 15}, {"b.log", "1111", 13, 14, 1, 0}};
  s.components = 2;
  s.edges = {21, 22, 23, 24};
  s.pairs = {31, 32, 35, 36, 37, 33, 34};
  s.seconds = {21.5, 2.5, 3.5, 4.5, 5.5, 0.5};
  s.memory = {51, 52, 0, 54};
  s.store = {61, 62, 63, 64, 65};
  return s;
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) {
    ++count;
  }
  return count;
}

ReportData small_report() {
  ReportData data;
  data.title = "intel";
  data.summary = example();
  data.nodes = {{0, 0, 0, {0, 0, 0}}, {1, 0, 0, {4, 0, 0}}, {2, 0, 0, {4, 2, 0}}};
  data.edges = {{0, 1, EdgeKind::odometry, 0.0}, {1, 2, EdgeKind::odometry, 0.0}, {0, 2, EdgeKind::loop, 0.9}};
  return data;
}

}  // namespace

TEST_CASE("summary.json has the fields that the contract names") {
  const nlohmann::json expected = nlohmann::json::parse(R"({
    "version": "1.2.3", "config": {"cell_m": 0.05, "particles": 10, "profile": "micro", "blur": true},
    "sessions": [{"log": "a.log", "id": "0000", "scans": 11, "submaps": 12, "component": 0, "lost": 15},
                 {"log": "b.log", "id": "1111", "scans": 13, "submaps": 14, "component": 1, "lost": 0}],
    "components": 2,
    "edges": {"odometry": 21, "loop": 22, "merge": 23, "rejected": 24},
    "pairs": {"possible": 31, "screened": 32, "dropped_coarse": 35, "dropped_rotation": 36, "cut_short": 37,
              "registered": 33, "accepted": 34},
    "seconds": {"total": 21.5, "local_mapping": 2.5, "screening": 3.5, "registration": 4.5, "optimisation": 5.5,
                "store": 0.5},
    "memory": {"arena_bytes": 51, "arena_used_bytes": 52, "heap_allocations_after_init": 0, "peak_rss_bytes": 54},
    "store": {"submaps": 61, "logical_bytes": 62, "programmed_bytes": 63, "erases": 64, "max_block_erases": 65}})");
  CHECK(nlohmann::json::parse(to_json(example())) == expected);
  CHECK(nlohmann::json::parse(to_json(Summary{}))["sessions"].is_array());
  CHECK(nlohmann::json::parse(to_json(Summary{}))["config"].is_object());
}

TEST_CASE("a number that JSON cannot hold is refused, a path that is not UTF-8 is not") {
  Summary s = example();
  s.seconds.screening = NAN;
  CHECK_THROWS_WITH_AS((void)to_json(s), doctest::Contains("seconds.screening"), std::invalid_argument);
  s = example();
  s.config.emplace_back("x", INFINITY);
  CHECK_THROWS_WITH_AS((void)to_json(s), doctest::Contains("config.x"), std::invalid_argument);
  s = example();
  s.sessions[0].log = "\xff\xfe.log";
  CHECK(nlohmann::json::parse(to_json(s))["sessions"].size() == 2);
}

TEST_CASE("the tables have the contract's columns") {
  SubmapRow submap;
  submap.id = 7;
  submap.session = "abc";
  submap.component = 1;
  submap.scans = 40;
  submap.timestamp_s = 12.5;
  submap.map_T_submap = {1.5, -2.0, 0.25};
  CHECK(submaps_csv({submap}) ==
        "id,session,component,scans,timestamp,x,y,theta\n"
        "7,abc,1,40,12.500000,1.500000,-2.000000,0.250000000\n");
  MatchRow match;
  match.a = 3;
  match.b = 9;
  match.kind = "loop";
  match.stage = "registered";
  match.score = 0.5;
  match.agreement = 0.75;
  match.a_T_b = {1, 2, 3};
  match.accepted = true;
  match.why = "two witnesses, \"consistent\"";
  CHECK(matches_csv({match}) ==
        "a,b,kind,stage,score,agreement,x,y,theta,accepted,why\n"
        "3,9,loop,registered,0.5,0.75,1.000000,2.000000,3.000000000,1,\"two witnesses, \"\"consistent\"\"\"\n");
}

TEST_CASE("a session's UUID in its text form") {
  SessionId id;
  for (std::uint8_t i = 0; i < 16; ++i) {
    id.bytes[i] = static_cast<std::uint8_t>(i * 17);
  }
  CHECK(to_text(id) == "00112233-4455-6677-8899-aabbccddeeff");
}

TEST_CASE("the report holds everything and needs nothing else") {
  ReportData data = small_report();
  const std::string png = encode_png(Picture(2, 2, 1, 100));
  data.pictures = {{"the map", png}};
  data.memory_parts = {{"scan memory", 4096}};
  const std::string html = report_html(data);
  CHECK(contains(html, "data:image/png;base64," + encode_base64(png)));
  CHECK(contains(html, "scan memory"));
  CHECK(contains(html, "a.log"));
  CHECK(contains(html, "21.50 s"));
  CHECK(count_of(html, "<circle") == 3);
  CHECK(count_of(html, "<line") == 3);
  for (const char* outside : {"http:", "https:", "<script", "<link", "url(", "@import"}) {
    CHECK(!contains(html, outside));
  }
  for (const char* element : {"<section", "<table", "<svg", "<div", "<figure", "<main", "<p"}) {
    const std::string name(element + 1);
    const std::string closed = "</" + name + ">";
    CHECK(count_of(html, element + std::string(">")) + count_of(html, element + std::string(" ")) ==
          count_of(html, closed));
  }
}

TEST_CASE("text in the report is escaped, edges and nodes that cannot be drawn are left out") {
  ReportData data = small_report();
  data.title = "<script>alert('x')</script>";
  data.remarks = {"a & b"};
  data.nodes[1].map_T_submap.x = NAN;
  data.edges.push_back({0, 99, EdgeKind::merge, 0.5});
  data.edges.push_back({0, 2, EdgeKind::loop, NAN});
  const std::string html = report_html(data);
  CHECK(!contains(html, "<script"));
  CHECK(contains(html, "&lt;script&gt;"));
  CHECK(contains(html, "a &amp; b"));
  CHECK(count_of(html, "<circle") == 2);
  CHECK(count_of(html, "<line") == 2);
  CHECK(contains(report_html(ReportData{}), "</html>"));
  CHECK(!contains(report_html(ReportData{}), "<svg"));
}

TEST_CASE("y points up in the graph") {
  const std::string html = report_html(small_report());
  // 4 m by 2 m into 1000 units with a margin of 20: node 2 is at the top right, node 0 at the bottom left.
  CHECK(contains(html, "<circle cx=\"20.0\" cy=\"500.0\""));
  CHECK(contains(html, "<circle cx=\"980.0\" cy=\"20.0\""));
}
