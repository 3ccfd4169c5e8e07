#include <doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/scorer.hpp"
#include "tests/host_support.hpp"

using namespace mellin;
using namespace mellin::host;
using mellin::test::real_data;
using mellin::test::TemporaryFolder;

namespace {

std::vector<StampedPose> trajectory(const std::vector<Pose2>& poses, double first_s = 0.0) {
  std::vector<StampedPose> stamped;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    stamped.push_back({"", first_s + static_cast<double>(i), poses[i]});
  }
  return stamped;
}

const std::vector<Pose2> kCross{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};

/// The cross with its arms longer by d: the best alignment is none, by symmetry.
std::vector<Pose2> stretched(double d) { return {{1 + d, 0, 0}, {-1 - d, 0, 0}, {0, 1 + d, 0}, {0, -1 - d, 0}}; }

/// A long way out, then back to the first pose at index `last`.
std::vector<Pose2> excursion(std::size_t last) {
  std::vector<Pose2> poses;
  for (std::size_t i = 0; i < last; ++i) {
    poses.push_back({100.0 * static_cast<double>(i), 0, 0});
  }
  poses.push_back({0, 0, 0});
  return poses;
}

}  // namespace

TEST_CASE("the frame of the estimate does not matter") {
  const Pose2 frame{12.0, -3.0, 2.5};
  std::vector<Pose2> truth{{0, 0, 0.1}, {2, 0, 0.9}, {3, 4, -3.0}, {-1, 2, 3.0}};
  std::vector<Pose2> moved;
  for (const Pose2& pose : truth) {
    moved.push_back(compose(frame, pose));
  }
  const TrajectoryScore score = score_trajectory(trajectory(moved), trajectory(truth));
  REQUIRE(score.scored);
  CHECK(score.paired == 4);
  CHECK(score.ate_rmse_m < 1e-12);
  CHECK(score.ate_rotation_rmse_deg < 1e-9);
  CHECK(score.step.max_m < 1e-12);
}

TEST_CASE("errors of a stretched cross, by hand") {
  constexpr double d = 0.5;
  const TrajectoryScore score = score_trajectory(trajectory(stretched(d)), trajectory(kCross));
  CHECK(score.ate_rmse_m == doctest::Approx(d));
  CHECK(score.ate_max_m == doctest::Approx(d));
  CHECK(score.ate_rotation_rmse_deg == doctest::Approx(0.0));
  // Steps are in error by 2 d, sqrt(2) d and 2 d.
  const double mean = (4.0 + std::sqrt(2.0)) / 3.0 * d;
  const double square = (4.0 + 2.0 + 4.0) / 3.0 * d * d;
  CHECK(score.step.count == 3);
  CHECK(score.step.mean_m == doctest::Approx(mean));
  CHECK(score.step.deviation_m == doctest::Approx(std::sqrt(square - mean * mean)));
  CHECK(score.step.median_m == doctest::Approx(2.0 * d));
  CHECK(score.revisit.count == 0);
}

TEST_CASE("errors of heading, by hand") {
  std::vector<Pose2> turned = kCross;
  turned[0].theta = 0.2;
  turned[1].theta = -0.2;
  const TrajectoryScore score = score_trajectory(trajectory(turned), trajectory(kCross));
  CHECK(score.ate_rmse_m < 1e-12);
  CHECK(score.ate_rotation_rmse_deg == doctest::Approx(std::sqrt(2.0 * 0.04 / 4.0) * 180.0 / kPi));
  CHECK(score.step.mean_deg == doctest::Approx((0.4 + 0.2 + 0.0) / 3.0 * 180.0 / kPi));
}

TEST_CASE("poses pair within a millisecond and a half, in any order of time") {
  std::vector<StampedPose> estimate = trajectory(stretched(0.25), 0.0014);
  std::swap(estimate[0], estimate[3]);
  CHECK(score_trajectory(estimate, trajectory(kCross)).paired == 4);
  CHECK(score_trajectory(estimate, trajectory(kCross)).ate_rmse_m == doctest::Approx(0.25));
  CHECK(score_trajectory(trajectory(kCross, 0.0016), trajectory(kCross)).paired == 0);
  const TrajectoryScore part = score_trajectory(trajectory({kCross[0], kCross[1]}), trajectory(kCross));
  CHECK(part.paired == 2);
  CHECK(part.paired_share == 0.5);
  CHECK(!part.scored);
  CHECK(!score_trajectory({}, trajectory(kCross)).scored);
  CHECK(!score_trajectory(trajectory(kCross), {}).scored);
}

TEST_CASE("a revisit is near in the truth and more than sixty poses later") {
  const std::vector<Pose2> truth = excursion(61);
  std::vector<Pose2> estimate = truth;
  estimate.back() = {0.3, 0.4, 0.1};
  const TrajectoryScore score = score_trajectory(trajectory(estimate), trajectory(truth));
  CHECK(score.revisit.count == 1);
  CHECK(score.revisit.mean_m == doctest::Approx(0.5));
  CHECK(score.revisit.max_m == doctest::Approx(0.5));
  CHECK(score.revisit.mean_deg == doctest::Approx(0.1 * 180.0 / kPi));
  CHECK(score_trajectory(trajectory(excursion(60)), trajectory(excursion(60))).revisit.count == 0);
}

TEST_CASE("relations are compared with the interpolated estimate") {
  const std::vector<StampedPose> estimate{{"", 2.0, {2, 0, -3.0}}, {"", 0.0, {0, 0, 0}}, {"", 1.0, {1, 0, 3.0}}};
  const std::vector<Relation> relations{{0.0, 0.5, {0.5, 0.1, 1.5}},  // wrong by 0.1 m
                                        {0.0, 1.5, {1.5, 0, kPi}},    // right: headings pass through pi
                                        {0.0, 1.0, {1.0, 0, 3.5}},    // wrong by 0.5 rad
                                        {0.0, 9.0, {1.0, 0, 0}}};     // beyond the end
  const RelativeError error = score_relations(estimate, relations);
  CHECK(error.count == 3);
  CHECK(error.mean_m == doctest::Approx(0.1 / 3.0));
  CHECK(error.max_m == doctest::Approx(0.1));
  CHECK(error.median_m == doctest::Approx(0.0));
  CHECK(error.mean_deg == doctest::Approx(0.5 / 3.0 * 180.0 / kPi));
  CHECK(score_relations(estimate, relations, 7.5).count == 4);
  CHECK(score_relations({}, relations).count == 0);
  CHECK(score_relations({estimate[0]}, relations, 0.0).count == 0);
}

TEST_CASE("files of relations") {
  const TemporaryFolder folder;
  const std::vector<Relation> relations = read_relations(folder.write("a", "# t\n\n1 2 3 4 0 0 0 0.5\n"));
  REQUIRE(relations.size() == 1);
  CHECK(relations[0].from_s == 1.0);
  CHECK(relations[0].to_s == 2.0);
  CHECK(relations[0].from_T_to.x == 3.0);
  CHECK(relations[0].from_T_to.y == 4.0);
  CHECK(relations[0].from_T_to.theta == 0.5);
  for (const char* bad : {"1 2 3 4 0 0 0\n", "1 2 3 4 0 0 0 nan\n", "1 2 3 4 0 0 0 0 0\n", "a 2 3 4 0 0 0 0\n"}) {
    const std::string path = folder.write("bad", std::string("1 2 3 4 0 0 0 0\n") + bad);
    CHECK_THROWS_WITH_AS((void)read_relations(path), doctest::Contains((path + ":2: expected").c_str()),
                         std::runtime_error);
  }
}

TEST_CASE("the JSON carries the reference scripts' names") {
  const TrajectoryScore score = score_trajectory(trajectory(stretched(0.5)), trajectory(kCross));
  RelativeError relations;
  relations.count = 2;
  relations.mean_m = 0.25;
  const nlohmann::json json = nlohmann::json::parse(to_json(score, relations, 3));
  CHECK(json["n"] == 4);
  CHECK(json["paired"] == 1.0);
  CHECK(json["ate_rmse_m"].get<double>() == doctest::Approx(0.5));
  CHECK(json.contains("rel_step_deg"));
  CHECK(!json.contains("revisits"));
  CHECK(json["relations"]["relations"] == 2);
  CHECK(json["relations"]["of"] == 3);
  CHECK(json["relations"]["trans_m"] == 0.25);
  CHECK(!nlohmann::json::parse(to_json(TrajectoryScore{}, std::nullopt, 0)).contains("relations"));
}

// The data's documentation: the .tum file itself is .050 +- .032 m off fr079's relations.
TEST_CASE("real relations") {
  const std::string tum = real_data("fr079.tum");
  if (tum.empty()) {
    return;
  }
  const RelativeError error = score_relations(read_tum(tum), read_relations(real_data("fr079.relations")));
  CHECK(error.count == 1685);
  CHECK(error.mean_m == doctest::Approx(0.050).epsilon(0.01));
  CHECK(error.deviation_m == doctest::Approx(0.032).epsilon(0.015));
}
