#include "host/g2o.hpp"

#include <doctest.h>
#include <unistd.h>
#include <zlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "host/optimise_graph.hpp"

using namespace mellin;
using namespace mellin::host;

namespace {

/// A file in the temporary folder, gone with the object.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text = "")
      : path_(std::filesystem::temp_directory_path() /
              ("mellin_g2o_test_" + std::to_string(getpid()) + "_" + std::to_string(counter()++) + ".g2o")) {
    std::ofstream(path_) << text;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  std::string path() const { return path_.string(); }

 private:
  static int& counter() {
    static int value = 0;
    return value;
  }
  std::filesystem::path path_;
};

std::string failure(const std::string& text) {
  const TemporaryFile file(text);
  try {
    (void)read_g2o(file.path());
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    CHECK(message.rfind(file.path() + ":", 0) == 0);
    return message.substr(file.path().size());
  }
  return "no failure";
}

void check_equal(const Sym3& a, const Sym3& b) {
  CHECK(a.xx == b.xx);
  CHECK(a.xy == b.xy);
  CHECK(a.xt == b.xt);
  CHECK(a.yy == b.yy);
  CHECK(a.yt == b.yt);
  CHECK(a.tt == b.tt);
}

}  // namespace

TEST_CASE("g2o and TORO put the information in different orders") {
  const TemporaryFile g2o("VERTEX_SE2 4 1 2 3\nVERTEX_SE2 7 4 5 -1\r\nFIX 4\nEDGE_SE2 4 7 1 2 0.5 11 12 13 22 23 33\n");
  const TemporaryFile toro("# TORO\nVERTEX2 4 1 2 3\n\nVERTEX2 7 4 5 -1\nEDGE2 4 7 1 2 0.5 11 12 22 33 13 23");
  for (const G2oGraph& graph : {read_g2o(g2o.path()), read_g2o(toro.path())}) {
    REQUIRE(graph.ids == std::vector<std::int64_t>{4, 7});
    CHECK(graph.poses[1].y == 5.0);
    REQUIRE(graph.edges.size() == 1);
    CHECK(graph.edges[0].a == 0);
    CHECK(graph.edges[0].b == 1);
    CHECK(graph.edges[0].a_T_b.theta == 0.5);
    check_equal(graph.edges[0].information, {11, 12, 13, 22, 23, 33});
  }
}

TEST_CASE("what is written reads back to twelve digits") {
  G2oGraph graph;
  graph.ids = {0, 1, 1000000007};
  graph.poses = {{1.0 / 3.0, -2e5 / 7.0, 3.0}, {0.0, 1e-9 / 3.0, -1.0}, {1e6 / 9.0, 5.0, 0.1}};
  graph.edges = {{0, 1, {1.0 / 7.0, 2.0, -0.1}, {1e6 / 3.0, -1.0, 0.25, 2e6 / 3.0, 0.5, 1e9 / 7.0}},
                 {2, 0, {5.0, -5.0, 3.1}, {1.0, 0.0, 0.0, 1.0, 0.0, 1.0}}};
  const TemporaryFile file;
  write_g2o(file.path(), graph);
  const G2oGraph back = read_g2o(file.path());
  REQUIRE(back.ids == graph.ids);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(std::abs(back.poses[i].x - graph.poses[i].x) <= 1e-11 * std::abs(graph.poses[i].x));
    CHECK(std::abs(back.poses[i].y - graph.poses[i].y) <= 1e-11 * std::abs(graph.poses[i].y));
  }
  CHECK(back.edges[1].a == 2);
  CHECK(back.edges[0].information.tt == doctest::Approx(1e9 / 7.0).epsilon(1e-11));
  CHECK(back.edges[0].information.xt == 0.25);
  const TemporaryFile again;
  write_g2o(again.path(), back);
  const G2oGraph third = read_g2o(again.path());
  CHECK(third.poses[0].x == back.poses[0].x);
  check_equal(third.edges[0].information, back.edges[0].information);
}

TEST_CASE("gzipped files are read as plain ones") {
  const TemporaryFile file;
  gzFile out = gzopen(file.path().c_str(), "wb");
  REQUIRE(out != nullptr);
  gzputs(out, "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n");
  gzclose(out);
  CHECK(read_g2o(file.path()).edges.size() == 1);
  std::filesystem::resize_file(file.path(), std::filesystem::file_size(file.path()) - 12);
  CHECK_THROWS_AS((void)read_g2o(file.path()), std::runtime_error);
}

TEST_CASE("vertices that only edges name are placed along them, odometry first") {
  const std::string information = " 1 0 0 1 0 1\n";
  const TemporaryFile file("EDGE_SE2 10 12 50 50 0" + information + "EDGE_SE2 10 11 1 0 1.5707963267948966" +
                           information + "EDGE_SE2 12 11 -2 0 0" + information + "EDGE_SE2 11 30 0 3 0" + information +
                           "EDGE_SE2 40 41 7 0 0" + information);
  const G2oGraph graph = read_g2o(file.path());
  REQUIRE(graph.ids == std::vector<std::int64_t>{10, 11, 12, 30, 40, 41});
  CHECK(graph.poses[1].x == doctest::Approx(1.0));
  CHECK(graph.poses[2].x == doctest::Approx(1.0));
  CHECK(graph.poses[2].y == doctest::Approx(2.0));
  CHECK(graph.poses[3].x == doctest::Approx(-2.0));
  CHECK(graph.poses[4].x == 0.0);
  CHECK(graph.poses[5].x == doctest::Approx(7.0));
  const TemporaryFile partly("VERTEX_SE2 2 5 5 0\nEDGE_SE2 1 2 1 0 0" + information);
  CHECK(read_g2o(partly.path()).poses[0].x == doctest::Approx(4.0));
}

TEST_CASE("what cannot be read is named with its line, what was expected and what was found") {
  CHECK(failure("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0\n") ==
        ":2: expected a vertex's id and 3 finite numbers, found: VERTEX_SE2 1 0 0");
  CHECK(failure("VERTEX_SE2 0 0 nan 0\n").rfind(":1: expected a vertex's id", 0) == 0);
  CHECK(failure("VERTEX_SE2 0 0 1e999 0\n").rfind(":1: expected a vertex's id", 0) == 0);
  CHECK(failure("VERTEX_SE2 0 0 1x 0\n").rfind(":1: expected a vertex's id", 0) == 0);
  CHECK(failure("VERTEX_SE2 z 0 1 0\n").rfind(":1: expected a vertex's id", 0) == 0);
  CHECK(failure("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 0 0 0 0\n").rfind(":2: expected each vertex once", 0) == 0);
  CHECK(failure("EDGE_SE2 0 1 1 0 0 1 0 0 1 0\n").rfind(":1: expected an edge's two different ids", 0) == 0);
  CHECK(failure("EDGE_SE2 3 3 1 0 0 1 0 0 1 0 1\n").rfind(":1: expected an edge's two different ids", 0) == 0);
  CHECK(failure("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n").rfind(":1: expected VERTEX_SE2, EDGE_SE2", 0) == 0);
  CHECK(failure("# empty\n").rfind(":2: expected a vertex or an edge", 0) == 0);
  CHECK_THROWS_AS((void)read_g2o("/nonexistent/graph.g2o"), std::runtime_error);
  CHECK_THROWS_AS(write_g2o("/nonexistent/graph.g2o", {}), std::runtime_error);
}

TEST_CASE("the driver refuses an indefinite edge by name and optimises a small graph in place") {
  const TemporaryFile good(
      "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 5 5 1\nEDGE_SE2 0 1 1 0 0.5 1 0 0 1 0 1\nEDGE_SE2 0 1 2 0 0.5 1 0 0 1 0 1\n");
  G2oGraph graph = read_g2o(good.path());
  const GraphRun run = optimise_graph(graph, {});
  CHECK(run.report.converged);
  CHECK(run.report.chi2_final == doctest::Approx(0.5));
  CHECK(graph.poses[1].x == doctest::Approx(1.5));
  CHECK(run.arena_bytes > 0);
  graph.edges[1].information.xx = -1.0;
  try {
    (void)optimise_graph(graph, {});
    CHECK(false);
  } catch (const std::runtime_error& error) {
    CHECK(std::string(error.what()).rfind("edge 0 1: expected a positive semidefinite", 0) == 0);
  }
}
