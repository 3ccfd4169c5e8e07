#include "mellin/graph/pose_graph.hpp"

#include <doctest.h>

#include <cmath>
#include <limits>

#include "graph_rig.hpp"

using namespace mellin;
using mellin::test::GraphRig;

namespace {

constexpr Sym3 kUnit = {1.0, 0.0, 0.0, 1.0, 0.0, 1.0};

PoseGraphConfig small_config(std::uint32_t nodes = 8, std::uint32_t edges = 8) {
  PoseGraphConfig config;
  config.max_nodes = nodes;
  config.max_edges = edges;
  config.max_fill = 64;
  return config;
}

void check_pose(const Pose2& pose, double x, double y, double theta) {
  CHECK(pose.x == doctest::Approx(x).epsilon(1e-12));
  CHECK(pose.y == doctest::Approx(y).epsilon(1e-12));
  CHECK(wrap_angle(pose.theta - theta) == doctest::Approx(0.0));
}

}  // namespace

TEST_CASE("graph and optimiser use the memory that they measure, to the byte") {
  for (const std::uint32_t nodes : {1U, 7U, 64U, 256U}) {
    const PoseGraphConfig config = {nodes, 3 * nodes + 1, 9 * nodes + 3, 100};
    const GraphRig rig(config);
    CHECK(rig.status == Status::ok);
    CHECK(rig.fitted);
    CHECK(rig.used == GraphRig::required(config));
    const GraphRig short_of_a_word(config, 8);
    CHECK_FALSE(short_of_a_word.fitted);
    CHECK(short_of_a_word.status == Status::insufficient_memory);
  }
  constexpr std::size_t bytes = [] {
    MeasureArena arena;
    (void)Optimiser::carve(arena, PoseGraphConfig{});
    return arena.use().total();
  }();
  static_assert(bytes > 0);
}

TEST_CASE("a configuration that contradicts itself is refused") {
  PoseGraphConfig config;
  CHECK(validate(config) == Status::ok);
  config.max_nodes = 0;
  CHECK(validate(config) == Status::invalid_config);
  config = {};
  config.max_fill = config.max_nodes - 1;
  CHECK(validate(config) == Status::invalid_config);
  config = {};
  config.work_per_step = 0;
  CHECK(validate(config) == Status::invalid_config);
  config = {};
  config.max_edges = std::numeric_limits<std::uint32_t>::max();
  CHECK(validate(config) == Status::invalid_config);
}

TEST_CASE("an edge's error is that of EDGE_SE2") {
  // From a, b lies two metres ahead; measured one metre ahead and turned left by 90 degrees: seen from the measured
  // frame the true one is a metre to the right and turned right.
  const Pose2 a = {1.0, 2.0, kHalfPi};
  const Pose2 b = {1.0, 4.0, kHalfPi};
  const Pose2 z = {1.0, 0.0, kHalfPi};
  check_pose(edge_error(z, a, b), 0.0, -1.0, -kHalfPi);
  Edge edge;
  edge.a_T_b = z;
  edge.information = diagonal(3.0, 5.0, 7.0);
  CHECK(edge_chi2(edge, a, b) == doctest::Approx(5.0 + 7.0 * kHalfPi * kHalfPi));
}

TEST_CASE("information and covariance of an edge turn into each other") {
  const Pose2 z = {2.0, 1.0, kHalfPi};
  Sym3 information;
  // One metre of deviation along x of frame a is along -y of the measured frame, which is turned left by 90 degrees.
  REQUIRE(information_from_covariance(z, diagonal(1.0, 0.25, 0.01), information));
  CHECK(information.xx == doctest::Approx(4.0));
  CHECK(information.yy == doctest::Approx(1.0));
  CHECK(information.tt == doctest::Approx(100.0));
  Sym3 covariance;
  REQUIRE(covariance_from_information(z, information, covariance));
  CHECK(covariance.xx == doctest::Approx(1.0));
  CHECK(covariance.yy == doctest::Approx(0.25));
  CHECK_FALSE(information_from_covariance(z, diagonal(1.0, 0.0, 1.0), information));
  CHECK_FALSE(covariance_from_information(z, diagonal(1.0, -1.0, 1.0), covariance));
}

TEST_CASE("linking moves the younger component onto the older one's frame") {
  GraphRig rig(small_config());
  PoseGraph& g = rig.graph;
  for (int i = 0; i < 4; ++i) {
    REQUIRE(g.add_node({10.0 * i, 0.0, 0.0}).ok());
  }
  CHECK(g.component_count() == 4);
  REQUIRE(g.add_edge(2, 3, EdgeKind::odometry, {1.0, 0.0, kHalfPi}, kUnit).ok());
  check_pose(g.pose(3), 21.0, 0.0, kHalfPi);
  REQUIRE(g.add_edge(0, 1, EdgeKind::odometry, {1.0, 0.0, 0.0}, kUnit).ok());
  CHECK(g.component_count() == 2);
  CHECK(g.component(3) == 2);
  // From the younger component's side: node 3 sees node 1 two metres ahead of it.
  REQUIRE(g.add_edge(3, 1, EdgeKind::merge, {2.0, 0.0, 0.0}, kUnit).ok());
  CHECK(g.component_count() == 1);
  CHECK(g.component(2) == 0);
  check_pose(g.pose(1), 1.0, 0.0, 0.0);
  check_pose(g.pose(3), -1.0, 0.0, 0.0);
  check_pose(g.pose(2), -1.0, 1.0, -kHalfPi);
  CHECK(g.chi2() == doctest::Approx(0.0));
}

TEST_CASE("disabling the only link splits a component, enabling it joins the parts again") {
  GraphRig rig(small_config());
  PoseGraph& g = rig.graph;
  for (int i = 0; i < 5; ++i) {
    REQUIRE(g.add_node({}).ok());
  }
  // Linked so that paths to the root must be compressed: 4-3, 3-2, 1-0, 2-1.
  REQUIRE(g.add_edge(4, 3, EdgeKind::odometry, {1.0, 0.0, 0.0}, kUnit).ok());
  REQUIRE(g.add_edge(3, 2, EdgeKind::odometry, {1.0, 0.0, 0.0}, kUnit).ok());
  REQUIRE(g.add_edge(1, 0, EdgeKind::odometry, {1.0, 0.0, 0.0}, kUnit).ok());
  const EdgeId link = g.add_edge(2, 1, EdgeKind::merge, {1.0, 0.0, 0.0}, kUnit).value();
  CHECK(g.component_count() == 1);
  const double x = g.pose(4).x;
  REQUIRE(g.disable_edge(link) == Status::ok);
  CHECK(g.component_count() == 2);
  CHECK(g.component(1) == 0);
  CHECK(g.component(4) == 2);
  CHECK(g.pose(4).x == x);
  const std::uint32_t revision = g.revision();
  REQUIRE(g.disable_edge(link) == Status::ok);
  CHECK(g.revision() == revision);
  REQUIRE(g.set_pose(3, {50.0, 0.0, 0.0}) == Status::ok);
  REQUIRE(g.enable_edge(link) == Status::ok);
  CHECK(g.component_count() == 1);
  CHECK(g.disable_edge(99) == Status::not_found);
  CHECK(g.enable_edge(99) == Status::not_found);
}

TEST_CASE("numbers that cannot be are refused") {
  GraphRig rig(small_config());
  PoseGraph& g = rig.graph;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  CHECK(g.add_node({nan, 0.0, 0.0}).status() == Status::bad_data);
  CHECK(g.add_node({0.0, infinite, 0.0}).status() == Status::bad_data);
  CHECK(g.add_node({0.0, 0.0, 1e6}).status() == Status::bad_data);
  CHECK(g.node_count() == 0);
  REQUIRE(g.add_node({}).ok());
  REQUIRE(g.add_node({}).ok());
  const auto status = [&](const Pose2& z, const Sym3& m) { return g.add_edge(0, 1, EdgeKind::loop, z, m).status(); };
  CHECK(status({0.0, 0.0, nan}, kUnit) == Status::bad_data);
  CHECK(status({}, diagonal(1.0, nan, 1.0)) == Status::bad_data);
  CHECK(status({}, diagonal(1.0, 1.0, infinite)) == Status::bad_data);
  CHECK(status({}, diagonal(1.0, 1.0, 0.0)) == Status::bad_data);
  CHECK(status({}, diagonal(-1.0, 1.0, 1.0)) == Status::bad_data);
  CHECK(status({}, {1.0, 1.1, 0.0, 1.0, 0.0, 1.0}) == Status::bad_data);
  CHECK(status({}, {1.0, -0.9, 0.9, 1.0, 0.9, 1.0}) == Status::bad_data);  // all 2 x 2 minors positive, not the third
  CHECK(g.add_edge(0, 0, EdgeKind::loop, {}, kUnit).status() == Status::invalid_argument);
  CHECK(g.add_edge(0, 2, EdgeKind::loop, {}, kUnit).status() == Status::invalid_argument);
  CHECK(g.edge_count() == 0);
  CHECK(g.component_count() == 2);
  CHECK(g.set_pose(0, {nan, 0.0, 0.0}) == Status::bad_data);
  CHECK(g.set_pose(7, {}) == Status::not_found);
  REQUIRE(g.add_edge(0, 1, EdgeKind::loop, {}, kUnit).ok());
  CHECK(g.set_weight(0, 1.5) == Status::bad_data);
  CHECK(g.set_weight(0, nan) == Status::bad_data);
  CHECK(g.set_weight(1, 0.5) == Status::not_found);
}

TEST_CASE("a full graph says so and stays as it was") {
  GraphRig rig(small_config(2, 1));
  PoseGraph& g = rig.graph;
  REQUIRE(g.add_node({}).ok());
  REQUIRE(g.add_node({}).ok());
  CHECK(g.add_node({}).status() == Status::full);
  REQUIRE(g.add_edge(0, 1, EdgeKind::odometry, {1.0, 0.0, 0.0}, kUnit).ok());
  CHECK(g.add_edge(0, 1, EdgeKind::loop, {1.0, 0.0, 0.0}, kUnit).status() == Status::full);
  CHECK(g.node_count() == 2);
  CHECK(g.edge_count() == 1);
}
