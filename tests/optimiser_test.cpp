#include "mellin/graph/optimiser.hpp"

#include <doctest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <vector>

#include "graph/edge_terms.hpp"
#include "graph_rig.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;
using mellin::test::fill_random;
using mellin::test::GraphRig;

namespace {

PoseGraphConfig config_for(std::uint32_t nodes, std::uint32_t edges, std::uint32_t fill) {
  PoseGraphConfig config;
  config.max_nodes = nodes;
  config.max_edges = edges;
  config.max_fill = fill;
  return config;
}

Eigen::Matrix3d matrix(const Sym3& m) {
  Eigen::Matrix3d out;
  out << m.xx, m.xy, m.xt, m.xy, m.yy, m.yt, m.xt, m.yt, m.tt;
  return out;
}

Pose2 moved(Pose2 p, int coordinate, double by) {
  (coordinate == 0 ? p.x : coordinate == 1 ? p.y : p.theta) += by;
  return p;
}

Eigen::Vector3d error(const Edge& e, const Pose2& a, const Pose2& b) {
  const Pose2 d = edge_error(e.a_T_b, a, b);
  return {d.x, d.y, d.theta};
}

/// Derivative of an edge's error by (a, b), by central differences: independent of the library's analytic one.
Eigen::Matrix<double, 3, 6> numeric_jacobian(const Edge& e, const Pose2& a, const Pose2& b) {
  constexpr double h = 1e-6;
  Eigen::Matrix<double, 3, 6> j;
  for (int c = 0; c < 3; ++c) {
    j.col(c) = (error(e, moved(a, c, h), b) - error(e, moved(a, c, -h), b)) / (2 * h);
    j.col(3 + c) = (error(e, a, moved(b, c, h)) - error(e, a, moved(b, c, -h))) / (2 * h);
  }
  return j;
}

/// The normal equations of a graph with node 0 held, dense.
void dense_equations(const PoseGraph& graph, const std::vector<Pose2>& poses, Eigen::MatrixXd& h, Eigen::VectorXd& g) {
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(poses.size());
  h = Eigen::MatrixXd::Zero(size, size);
  g = Eigen::VectorXd::Zero(size);
  for (EdgeId id = 0; id < graph.edge_count(); ++id) {
    const Edge& e = graph.edge(id);
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(3, size);
    const auto numeric = numeric_jacobian(e, poses[e.a], poses[e.b]);
    j.middleCols<3>(3 * e.a) = numeric.leftCols<3>();
    j.middleCols<3>(3 * e.b) = numeric.rightCols<3>();
    h += j.transpose() * matrix(e.information) * j;
    g += j.transpose() * matrix(e.information) * error(e, poses[e.a], poses[e.b]);
  }
  h = h.bottomRightCorner(size - 3, size - 3).eval();
  g = g.tail(size - 3).eval();
}

std::vector<Pose2> poses_of(const PoseGraph& graph) {
  std::vector<Pose2> poses;
  for (NodeId i = 0; i < graph.node_count(); ++i) {
    poses.push_back(graph.pose(i));
  }
  return poses;
}

/// Gauss-Newton with dense matrices and numeric derivatives.
std::vector<Pose2> dense_optimum(const PoseGraph& graph) {
  std::vector<Pose2> poses = poses_of(graph);
  for (int iteration = 0; iteration < 30; ++iteration) {
    Eigen::MatrixXd h;
    Eigen::VectorXd g;
    dense_equations(graph, poses, h, g);
    const Eigen::VectorXd step = -h.llt().solve(g);
    for (std::size_t i = 1; i < poses.size(); ++i) {
      const Eigen::Index at = 3 * static_cast<Eigen::Index>(i) - 3;
      poses[i] = {poses[i].x + step(at), poses[i].y + step(at + 1), wrap_angle(poses[i].theta + step(at + 2))};
    }
  }
  return poses;
}

double worst_difference(const std::vector<Pose2>& a, const std::vector<Pose2>& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    worst = std::max(
        {worst, std::abs(a[i].x - b[i].x), std::abs(a[i].y - b[i].y), std::abs(wrap_angle(a[i].theta - b[i].theta))});
  }
  return worst;
}

OptimiserOptions tight() {
  OptimiserOptions options;
  options.tolerance = 1e-12;
  return options;
}

}  // namespace

TEST_CASE("an edge's terms agree with finite differences of its cost") {
  Random random(3, 0);
  for (int i = 0; i < 50; ++i) {
    Edge e;
    e.a_T_b = {random.normal(), random.normal(), 2.0 * random.normal()};
    e.information = {5.0, 1.0, -0.5, 4.0, 0.7, 9.0};
    const Pose2 a = {3.0 * random.normal(), random.normal(), 3.0 * random.normal()};
    const Pose2 b = compose(compose(a, e.a_T_b), test::noise(random, 0.5, 0.3));
    const graph_detail::EdgeTerms t = graph_detail::pose_terms(e, 0.5, a, b);
    const auto j = numeric_jacobian(e, a, b);
    const Eigen::Matrix<double, 6, 6> h = 0.5 * j.transpose() * matrix(e.information) * j;
    const Eigen::Matrix<double, 6, 1> g = 0.5 * j.transpose() * matrix(e.information) * error(e, a, b);
    for (int r = 0; r < 3; ++r) {
      CHECK(t.g_a[r] == doctest::Approx(g(r)).epsilon(1e-6));
      CHECK(t.g_b[r] == doctest::Approx(g(3 + r)).epsilon(1e-6));
      for (int c = 0; c < 3; ++c) {
        CHECK(t.ab.m[3 * r + c] == doctest::Approx(h(r, 3 + c)).epsilon(1e-6));
        if (c <= r) {
          CHECK(t.aa.m[r * (r + 1) / 2 + c] == doctest::Approx(h(r, c)).epsilon(1e-6));
          CHECK(t.bb.m[r * (r + 1) / 2 + c] == doctest::Approx(h(3 + r, 3 + c)).epsilon(1e-6));
        }
      }
    }
  }
}

TEST_CASE("a straight chain with a loop edge 0.3 m too long shares the error equally") {
  for (const Start start : {Start::current, Start::chordal}) {
    GraphRig rig(config_for(4, 4, 8));
    for (int i = 0; i < 4; ++i) {
      REQUIRE(rig.graph.add_node({1.0 * i, 0.0, 0.0}).ok());
    }
    for (NodeId i = 0; i < 3; ++i) {
      REQUIRE(rig.graph.add_edge(i, i + 1, EdgeKind::odometry, {1.0, 0.0, 0.0}, diagonal(1.0, 1.0, 1.0)).ok());
    }
    REQUIRE(rig.graph.add_edge(0, 3, EdgeKind::loop, {3.3, 0.0, 0.0}, diagonal(1.0, 1.0, 1.0)).ok());
    OptimiserOptions options = tight();
    options.start = start;
    const OptimiserReport report = rig.optimise(options);
    CHECK(report.converged);
    CHECK(report.chi2_initial == doctest::Approx(0.09));
    CHECK(report.chi2_final == doctest::Approx(4 * 0.075 * 0.075));
    CHECK(rig.graph.pose(0).x == 0.0);
    CHECK(rig.graph.pose(1).x == doctest::Approx(1.075));
    CHECK(rig.graph.pose(3).x == doctest::Approx(3.225));
  }
}

TEST_CASE("a square whose corners were measured too wide closes with the error on its headings alone") {
  // All four turns were measured as 90 degrees + 0.05: by symmetry the optimum is the exact unit square.
  GraphRig rig(config_for(4, 4, 8));
  Pose2 pose;
  const Pose2 step = {1.0, 0.0, kHalfPi + 0.05};
  for (int i = 0; i < 4; ++i) {
    REQUIRE(rig.graph.add_node(pose).ok());
    pose = compose(pose, step);
  }
  for (NodeId i = 0; i < 4; ++i) {
    const EdgeKind kind = i == 3 ? EdgeKind::loop : EdgeKind::odometry;
    REQUIRE(rig.graph.add_edge(i, (i + 1) % 4, kind, step, diagonal(10.0, 10.0, 40.0)).ok());
  }
  const OptimiserReport report = rig.optimise(tight());
  CHECK(report.converged);
  CHECK(report.chi2_final == doctest::Approx(4 * 40.0 * 0.05 * 0.05));
  CHECK(rig.graph.pose(2).x == doctest::Approx(1.0));
  CHECK(rig.graph.pose(2).y == doctest::Approx(1.0));
  CHECK(rig.graph.pose(3).y == doctest::Approx(1.0));
  CHECK(std::abs(rig.graph.pose(2).theta) == doctest::Approx(kPi));
}

TEST_CASE("random graphs reach the optimum of a dense solver, by either solver and from either start") {
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(test::trials(6)); ++seed) {
    GraphRig same(config_for(30, 60, 400));
    fill_random(same.graph, 30, 31, seed);
    const std::vector<Pose2> exact = dense_optimum(same.graph);
    for (const std::uint32_t fill : {400U, 30U}) {
      for (const Start start : {Start::current, Start::chordal}) {
        GraphRig rig(config_for(30, 60, fill));
        fill_random(rig.graph, 30, 31, seed);
        OptimiserOptions options = tight();
        options.start = start;
        const OptimiserReport report = rig.optimise(options);
        CHECK(report.converged);
        CHECK((report.fill_status == Status::full) == (fill == 30));
        CHECK(worst_difference(poses_of(rig.graph), exact) < 1e-6);
        CHECK(report.chi2_final == doctest::Approx(rig.graph.chi2()));
      }
    }
  }
}

TEST_CASE("relative covariances agree with a dense inverse, by either solver") {
  const std::uint32_t fills[] = {400U, 20U};
  for (int i = 0; i < test::trials(2); ++i) {
    const std::uint32_t fill = fills[i];
    GraphRig rig(config_for(20, 50, fill));
    fill_random(rig.graph, 20, 25, 7);
    OptimiserOptions options = tight();
    options.marginals = true;
    const OptimiserReport report = rig.optimise(options);
    REQUIRE((report.fill_status == Status::full) == (fill == 20));
    const std::vector<Pose2> poses = poses_of(rig.graph);
    Eigen::MatrixXd h;
    Eigen::VectorXd g;
    dense_equations(rig.graph, poses, h, g);
    CHECK(g.norm() < 1e-4);
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(60, 60);
    covariance.bottomRightCorner<57, 57>() = h.inverse();
    for (NodeId a = 0; a < static_cast<NodeId>(test::trials(20)); ++a) {
      for (NodeId b = 0; b < 20; ++b) {
        Eigen::MatrixXd j = Eigen::MatrixXd::Zero(3, 60);
        for (int c = 0; c < 3; ++c) {
          const auto column = [&](NodeId node, double by) {
            const Pose2 p =
                between(node == a ? moved(poses[a], c, by) : poses[a], node == b ? moved(poses[b], c, by) : poses[b]);
            return Eigen::Vector3d(p.x, p.y, p.theta);
          };
          if (a != b) {
            j.col(3 * static_cast<int>(a) + c) = (column(a, 1e-6) - column(a, -1e-6)) / 2e-6;
            j.col(3 * static_cast<int>(b) + c) = (column(b, 1e-6) - column(b, -1e-6)) / 2e-6;
          }
        }
        const Eigen::Matrix3d exact = j * covariance * j.transpose();
        const Result<Sym3> got = rig.optimiser.relative_covariance(a, b);
        REQUIRE(got.ok());
        REQUIRE((matrix(got.value()) - exact).norm() < 1e-5 * (exact.norm() + 1e-9));
      }
    }
  }
}

TEST_CASE("covariance of a chain adds up, and is refused where there is none") {
  GraphRig rig(config_for(6, 6, 12));
  for (int i = 0; i < 5; ++i) {
    REQUIRE(rig.graph.add_node({}).ok());
  }
  for (const NodeId i : {0U, 1U, 3U}) {
    REQUIRE(rig.graph.add_edge(i, i + 1, EdgeKind::odometry, {1.0, 0.0, 0.0}, diagonal(4.0, 4.0, 100.0)).ok());
  }
  CHECK(rig.optimiser.relative_covariance(0, 1).status() == Status::invalid_argument);
  OptimiserOptions options;
  options.max_iterations = 0;
  options.marginals = true;
  CHECK(rig.optimise(options).iterations == 0);
  // Along x the two variances add; the heading of the first edge swings the second one's metre.
  const Sym3 c = rig.optimiser.relative_covariance(0, 2).value();
  CHECK(c.xx == doctest::Approx(0.5));
  CHECK(c.yy == doctest::Approx(0.51));
  CHECK(c.tt == doctest::Approx(0.02));
  CHECK(c.yt == doctest::Approx(0.01));
  CHECK(rig.optimiser.relative_covariance(1, 4).status() == Status::degenerate);
  CHECK(rig.optimiser.relative_covariance(1, 9).status() == Status::not_found);
  CHECK(rig.optimiser.relative_covariance(3, 4).value().xx == doctest::Approx(0.25));
  REQUIRE(rig.graph.set_pose(1, {}) == Status::ok);
  CHECK(rig.optimiser.relative_covariance(0, 2).status() == Status::invalid_argument);
}

TEST_CASE("components are optimised side by side, each about its own first node") {
  GraphRig both(config_for(40, 80, 600));
  GraphRig first(config_for(20, 40, 300));
  fill_random(both.graph, 20, 15, 1);
  fill_random(first.graph, 20, 15, 1);
  for (int i = 0; i < 3; ++i) {
    REQUIRE(both.graph.add_node({5.0 + i, 5.0, 0.0}).ok());
  }
  REQUIRE(both.graph.add_edge(20, 21, EdgeKind::odometry, {2.0, 0.0, 0.0}, diagonal(1.0, 1.0, 1.0)).ok());
  REQUIRE(both.graph.set_pose(21, {9.0, 9.0, 1.0}) == Status::ok);
  const OptimiserReport report = both.optimise(tight());
  const OptimiserReport alone = first.optimise(tight());
  CHECK(report.chi2_final == doctest::Approx(alone.chi2_final));
  CHECK(both.graph.pose(20).x == 5.0);
  CHECK(both.graph.pose(21).x == doctest::Approx(7.0));
  CHECK(both.graph.pose(21).theta == doctest::Approx(0.0));
  CHECK(both.graph.pose(22).x == 7.0);  // unlinked
}

TEST_CASE("slices of any size give the same bits, and small ones are many") {
  GraphRig coarse(config_for(60, 160, 900));
  PoseGraphConfig fine_config = coarse.config;
  fine_config.work_per_step = 1;
  GraphRig fine(fine_config);
  fill_random(coarse.graph, 60, 80, 4);
  fill_random(fine.graph, 60, 80, 4);
  OptimiserOptions options = tight();
  options.start = Start::chordal;
  CHECK(coarse.optimise(options).converged);
  REQUIRE(fine.optimiser.begin(fine.graph, options) == Status::ok);
  int slices = 1;
  const Pose2 before = fine.graph.pose(30);
  bool written_early = false;
  while (fine.optimiser.step()) {
    ++slices;
    written_early = written_early || fine.graph.pose(30).x != before.x;
  }
  CHECK(fine.graph.pose(30).x != before.x);
  CHECK_FALSE(written_early);
  CHECK(slices > 500);
  for (NodeId i = 0; i < 60; ++i) {
    CHECK(fine.graph.pose(i).x == coarse.graph.pose(i).x);
    CHECK(fine.graph.pose(i).theta == coarse.graph.pose(i).theta);
  }
}

TEST_CASE("a graph changed under way ends the run without a trace") {
  GraphRig rig(config_for(31, 60, 400));
  fill_random(rig.graph, 30, 20, 2);
  const std::vector<Pose2> before = poses_of(rig.graph);
  REQUIRE(rig.optimiser.begin(rig.graph, {}) == Status::ok);
  REQUIRE(rig.optimiser.step());
  CHECK(rig.optimiser.relative_covariance(0, 1).status() == Status::busy);
  REQUIRE(rig.graph.add_node({}).ok());
  CHECK_FALSE(rig.optimiser.step());
  CHECK(rig.optimiser.report().status == Status::busy);
  std::vector<Pose2> after = poses_of(rig.graph);
  after.pop_back();
  CHECK(worst_difference(before, after) == 0.0);
}

TEST_CASE("an underdetermined graph is degenerate, and keeps finite poses") {
  GraphRig rig(config_for(2, 2, 2));
  REQUIRE(rig.graph.add_node({}).ok());
  REQUIRE(rig.graph.add_node({}).ok());
  REQUIRE(rig.graph.add_edge(0, 1, EdgeKind::odometry, {1.0, 0.0, 0.0}, diagonal(1.0, 0.0, 1.0)).ok());
  REQUIRE(rig.graph.set_pose(1, {3.0, 1.0, 0.5}) == Status::ok);
  OptimiserOptions options;
  options.start = Start::chordal;
  options.marginals = true;
  CHECK(rig.optimise(options).status == Status::degenerate);
  CHECK(is_finite(rig.graph.pose(1)));
  CHECK_FALSE(rig.optimiser.relative_covariance(0, 1).ok());
}

TEST_CASE("graphs beyond the optimiser's size and options out of range are refused") {
  GraphRig large(config_for(12, 40, 100));
  GraphRig small(config_for(4, 40, 100));
  fill_random(large.graph, 12, 4, 0);
  CHECK(small.optimiser.begin(large.graph, {}) == Status::invalid_argument);
  CHECK_FALSE(small.optimiser.step());
  OptimiserOptions options;
  options.tolerance = std::numeric_limits<double>::quiet_NaN();
  CHECK(large.optimiser.begin(large.graph, options) == Status::invalid_argument);
  options = {};
  options.robust_chi2 = 0.0;
  CHECK(large.optimiser.begin(large.graph, options) == Status::invalid_argument);
  PoseGraph empty;
  CHECK(large.optimiser.begin(empty, {}) == Status::ok);
  while (large.optimiser.step()) {
  }
  CHECK(large.optimiser.report().chi2_final == 0.0);
}

TEST_CASE("wild numbers within the limits end without a crash and with finite poses") {
  for (std::uint64_t seed = 0; seed < static_cast<std::uint64_t>(test::trials(30)); ++seed) {
    GraphRig rig(config_for(20, 60, 200));
    Random random(seed, 8);
    const auto wild = [&] { return random.normal() * std::pow(10.0, 12.0 * random.uniform() - 4.0); };
    const auto clamped = [&](double limit) { return std::max(-limit, std::min(limit, wild())); };
    for (int i = 0; i < 20; ++i) {
      REQUIRE(rig.graph.add_node({clamped(1e9), clamped(1e9), clamped(1e5)}).ok());
    }
    for (NodeId i = 0; i < 60; ++i) {
      const NodeId a = static_cast<NodeId>(random.uniform() * 20);
      const Sym3 information = diagonal(std::abs(wild()), std::abs(wild()), std::abs(wild()));
      (void)rig.graph.add_edge(a, (a + 1 + i) % 20, i % 3 == 0 ? EdgeKind::odometry : EdgeKind::loop,
                               {clamped(1e9), clamped(1e9), clamped(1e5)}, information);
    }
    OptimiserOptions options;
    options.start = seed % 2 == 0 ? Start::chordal : Start::current;
    options.robust = seed % 3 == 0;
    options.marginals = true;
    const double before = rig.graph.chi2();
    const OptimiserReport report = rig.optimise(options);
    for (NodeId i = 0; i < 20; ++i) {
      CHECK(is_finite(rig.graph.pose(i)));
    }
    if (!options.robust && options.start == Start::current) {
      CHECK(report.chi2_final <= before * (1.0 + 1e-6));
    }
  }
}
