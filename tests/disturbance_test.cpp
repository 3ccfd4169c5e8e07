// What happens to robots: hands, slipping wheels, people, failing sensors, being carried off. The truth is known, since
// the disturbances are made by editing simulated scans.
#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "host/mapping_run.hpp"
#include "host/scorer.hpp"
#include "ramflash/heap_flash.hpp"
#include "tests/support/disturbed_drive.hpp"
#include "tests/support/machine.hpp"
#include "tests/support/simulated_log.hpp"

using namespace mellin;
using mellin::test::circle;
using mellin::test::DisturbedDrive;
using mellin::test::drain;
using mellin::test::kSanitized;
using mellin::test::Machine;
using mellin::test::measure;
using mellin::test::on_circle;
using mellin::test::room;
using mellin::test::small;
using mellin::test::span;

namespace {

/// Floors of the simulator, with an odometry that only jitters: what goes wrong is what the test does.
host::SimOptions floor_options(std::uint64_t seed, int loops = 1) {
  host::SimOptions options;
  options.seed = seed;
  options.loops = loops;
  options.scale_error = 0.0;
  options.turn_error_rad_per_m = 0.0;
  return options;
}

Config floor_config(Config config) {
  config.lasers[0].beams = 180;
  config.lasers[0].max_range_m = 12.0F;
  config.max_submaps = 60;
  return config;
}

struct Course {
  double worst_m = 0.0;  ///< error of the way since the scan `from`, over the scans [checked, end)
  std::size_t lost = 0;
  std::size_t doubted = 0;
  std::size_t unmatched = 0;
  std::size_t first_lost = 0;  ///< scan at which it was said first
  std::size_t due = 0;         ///< scans due to be taken after `from`, until then
};

/// The live poses of a drive's first `end` scans.
Course follow(const DisturbedDrive& drive, const Config& config, std::size_t from, std::size_t checked,
              std::size_t end) {
  Machine machine(config);
  REQUIRE(machine.status == Status::ok);
  Course course;
  Pose2 start;
  for (std::size_t i = 0; i < std::min(end, drive.size()); ++i) {
    const Result<ScanOutcome> outcome =
        machine->add({static_cast<std::int64_t>(i), span(drive[i].ranges), drive[i].odometry_T_base, 0});
    REQUIRE(outcome.ok());
    const ScanUse use = outcome.value().use;
    if (i == from) {
      start = machine->pose();
    }
    course.due += i > from && course.lost == 0 && (outcome.value().taken || use == ScanUse::doubted) ? 1U : 0U;
    if (use == ScanUse::lost) {
      course.first_lost = course.lost == 0 ? i : course.first_lost;
      ++course.lost;
    }
    course.doubted += use == ScanUse::doubted ? 1U : 0U;
    course.unmatched += use == ScanUse::odometry ? 1U : 0U;
    if (i >= checked) {
      const Pose2 error =
          between(between(drive[from].world_T_base, drive[i].world_T_base), between(start, machine->pose()));
      course.worst_m = std::max(course.worst_m, translation(error));
    }
  }
  return course;
}

/// The robot circles in the room made by hand; from step 60 on it is elsewhere than its odometry says: by `hand` in the
/// room's axes round itself, or by `wheel` on its own way. Returns the error of the live pose at its worst, from five
/// steps later on.
double shoved(const Pose2& hand, const Pose2& wheel, std::uint32_t& lost) {
  constexpr int kStep = 60;
  Machine machine(small());
  REQUIRE(machine.status == Status::ok);
  const Pose2 pivot = on_circle(kStep);
  const auto truth = [&](int step) {
    Pose2 pose = on_circle(step);
    if (step > kStep) {  // the whole circle, moved
      const Pose2 from_pivot = between(pivot, pose);
      pose = compose(Pose2{pivot.x + hand.x, pivot.y + hand.y, pivot.theta + hand.theta}, from_pivot);
    }
    return pose;
  };
  double worst = 0.0;
  for (int i = 0; i < kStep + 30; ++i) {
    const Pose2 odometry = i > kStep ? compose(compose(pivot, wheel), between(pivot, on_circle(i))) : on_circle(i);
    const std::vector<float> ranges = measure(room(), truth(i), machine->config().lasers[0]);
    REQUIRE(machine->add({i, span(ranges), odometry, 0}).ok());
    drain(*machine);
    if (i > kStep + 5) {
      worst = std::max(worst, translation(between(between(truth(0), truth(i)), machine->pose())));
    }
  }
  lost = machine->mapper().statistics().lost;
  return worst;
}

host::Log log_of(const DisturbedDrive& drive, std::size_t first, std::size_t end) {
  host::Log log;
  log.path = "disturbed";
  host::LaserSpec laser;
  laser.beams = 180;
  laser.angle_min_rad = -kHalfPi;
  laser.increment_rad = kPi / 180.0;
  laser.max_range_m = 12.0;
  log.lasers.push_back(laser);
  for (std::size_t i = first; i < std::min(end, drive.size()); ++i) {
    char stamp[32];
    std::snprintf(stamp, sizeof stamp, "%.6f", 0.1 * static_cast<double>(i));
    host::LogScan scan;
    scan.seconds = std::stod(stamp);
    scan.stamp = stamp;
    scan.odometry = drive[i].odometry_T_base;
    scan.ranges = drive[i].ranges;
    log.scans.push_back(scan);
  }
  return log;
}

std::vector<host::StampedPose> truth_of(const DisturbedDrive& drive, const host::Log& log) {
  std::vector<host::StampedPose> truth;
  for (std::size_t i = 0; i < log.scans.size(); ++i) {
    truth.push_back({log.scans[i].stamp, log.scans[i].seconds, drive[i].world_T_base});
  }
  return truth;
}

}  // namespace

TEST_CASE("a hand pushes the robot half a metre, and turns it: the live pose is right again") {
  for (const Pose2& hand : {Pose2{0.5, 0.0, 0.0}, Pose2{-0.5, 0.0, 0.0}, Pose2{0.0, 0.5, 0.0}, Pose2{0.0, -0.5, 0.0},
                            Pose2{0.35, 0.35, 0.0}, Pose2{-0.3, 0.4, 0.3}, Pose2{0.3, -0.4, -0.5}}) {
    CAPTURE(hand.x);
    CAPTURE(hand.y);
    std::uint32_t lost = 0;
    CHECK(shoved(hand, {}, lost) < 0.1);
    CHECK(lost == 0);
  }
}

TEST_CASE("a wheel slips: the odometry is 0.7 m ahead, or turned, and the live pose is not") {
  for (const Pose2& wheel :
       {Pose2{0.7, 0.0, 0.0}, Pose2{-0.7, 0.0, 0.0}, Pose2{0.5, 0.0, 0.4}, Pose2{0.0, 0.0, -0.6}}) {
    CAPTURE(wheel.x);
    CAPTURE(wheel.theta);
    std::uint32_t lost = 0;
    CHECK(shoved({}, wheel, lost) < 0.1);
    CHECK(lost == 0);
  }
}

TEST_CASE("an ordinary drive, through corridors, doors and rooms, is never doubted") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const DisturbedDrive drive(floor_options(seed));
    for (const Config& profile : {desktop_profile(), micro_profile(), nano_profile()}) {
      Config config = floor_config(profile);
      config.screening.hold_digests = true;  // it runs without flash
      CAPTURE(seed);
      CAPTURE(config.cell_m);
      const Course course = follow(drive, config, 0, drive.size(), kSanitized ? 200 : drive.size());
      CHECK(course.lost == 0);
      CHECK(course.doubted == 0);
    }
  }
}

TEST_CASE("a third of the beams is missing, at random or a sector: no worse than with all of them, and never lost") {
  constexpr std::size_t kAt = 450;
  const DisturbedDrive whole(floor_options(3));
  const Config config = floor_config(desktop_profile());
  const Course undisturbed = follow(whole, config, kAt, kAt, kAt + 60);
  for (const bool sector : {false, true}) {
    CAPTURE(sector);
    DisturbedDrive drive = whole;
    drive.lose_a_third(0, drive.size(), sector, 1);
    const Course course = follow(drive, config, kAt, kAt, kAt + 60);
    CHECK(course.worst_m < undisturbed.worst_m + 0.05);
    CHECK(course.worst_m < 0.1);
    CHECK(course.lost == 0);
    CHECK(course.doubted == 0);
  }
}

TEST_CASE("a minute's stop with four people before the laser: the robot stays where it is, and nothing is lost") {
  for (const std::size_t at : {150U, 450U}) {
    CAPTURE(at);
    DisturbedDrive drive(floor_options(1));
    drive.stand(at, 600);
    drive.people(at + 1, at + 601, 4, 1);
    const Course course = follow(drive, floor_config(desktop_profile()), at, at + 1, at + 640);
    CHECK(course.worst_m < 0.1);
    CHECK(course.lost == 0);
    CHECK(course.doubted == 0);
  }
}

TEST_CASE("blind for twenty scans: it rides on odometry, forgets nothing, and is matched again at once") {
  constexpr std::size_t kAt = 450;
  DisturbedDrive drive(floor_options(3));
  drive.blind(kAt + 1, kAt + 21);
  const Course course = follow(drive, floor_config(desktop_profile()), kAt, kAt + 22, kAt + 60);
  CHECK(course.unmatched == 20);
  CHECK(course.lost == 0);
  CHECK(course.worst_m < 0.1);
}

TEST_CASE("blind scans push no others out of the live map") {
  Config config = small();
  config.remembered_scans = 12;
  Machine machine(config);
  REQUIRE(machine.status == Status::ok);
  circle(*machine, 0, 30);
  const std::uint32_t remembered = machine->mapper().scans().end();
  const std::vector<float> blind(90, 25.0F);
  for (int i = 30; i < 60; ++i) {
    REQUIRE(machine->add({i, span(blind), on_circle(i), 0}).ok());
  }
  CHECK(machine->mapper().scans().end() == remembered);
  circle(*machine, 60, 61);
  CHECK(translation(between(machine->pose(), between(on_circle(0), on_circle(60)))) < 0.1);
}

TEST_CASE("carried 15 m to where it looks otherwise: lost is said within four scans that are due") {
  for (const std::size_t at : {450U, 600U}) {
    CAPTURE(at);
    DisturbedDrive drive(floor_options(1));
    drive.carry(at, drive.away(at, 15.0));
    const Course course = follow(drive, floor_config(desktop_profile()), at, drive.size(), drive.size());
    CHECK(course.lost == 1);
    CHECK(course.due == 4);
    CHECK(course.first_lost <= at + 4 * 4);
    CHECK(course.doubted == 3);
  }
}

TEST_CASE("carried off in a session: a component of its own, also after a restart, until a known place links it") {
  if (kSanitized) {
    return;  // two rounds of the ring
  }
  constexpr std::size_t kAt = 300;
  DisturbedDrive drive(floor_options(1, 2));
  drive.carry(kAt, drive.away(kAt, 15.0));
  const Config config = floor_config(micro_profile());
  port::HeapFlash flash({});
  {
    // Until well after it was lost, and before it comes to where it has been.
    const host::Log log = log_of(drive, 0, kAt + 100);
    host::MappingRun run(config, flash.flash(), {});
    run.map(log, {0}, {});
    const MapCollection& map = run.slam().collection();
    CHECK(run.sessions()[0].lost == 1);
    CHECK(run.slam().mapper().stretch() == 1);
    REQUIRE(map.graph().component_count() == 2);
    CHECK(run.slam().map_pose().linked);
    CHECK(run.slam().map_pose().component == map.component(map.size() - 1));
    CHECK(run.slam().map_pose().component > 0);
    CHECK(map.session_count() == 1);
    CHECK(run.slam().statistics().submaps_lost == 0);
    // All scans of the old stretch are in submaps, and those of the new one in others.
    const host::MappedSession& session = run.sessions()[0];
    const std::size_t begin = run.slam().mapper().stretch_begin();
    for (std::size_t i = 0; i < session.placements.size(); ++i) {
      const auto& places = session.placements[i];
      CHECK((i + 10 < begin || !places.empty()));  // up to the last scan of the old one
      for (const host::MappedSession::Placement& place : places) {
        CHECK(map.stretch_of(place.submap) == (i < begin ? 0 : 1));
      }
    }
    CHECK(session.placements.size() == run.slam().mapper().scans().end());
    CHECK(run.final_trajectory(session).size() == log.scans.size());
    // Those in doubt hang on the new stretch.
    for (const host::MappedSession::MappedScan& scan : session.scans) {
      CHECK((scan.use != ScanUse::doubted || map.stretch_of(session.placements[scan.anchor_scan].front().submap) == 1));
    }
  }
  {
    const host::MappingRun again(config, flash.flash(), {});
    CHECK(again.slam().collection().graph().component_count() == 2);
    CHECK(again.slam().collection().stretch_of(again.slam().collection().size() - 1) == 1);
  }
  port::HeapFlash empty({});
  const host::Log log = log_of(drive, 0, drive.size());
  host::MappingRun run(config, empty.flash(), {});
  run.map(log, {0}, {});
  CHECK(run.sessions()[0].lost == 1);
  CHECK(run.slam().collection().graph().component_count() == 1);
  const std::vector<host::StampedPose> truth = truth_of(drive, log);
  const host::TrajectoryScore last = host::score_trajectory(run.final_trajectory(run.sessions()[0]), truth);
  const host::TrajectoryScore live = host::score_trajectory(run.live_trajectory(run.sessions()[0]), truth);
  CHECK(last.paired == log.scans.size());
  CHECK(live.ate_rmse_m > 1.0);
  CHECK(last.ate_rmse_m < 0.3);
}

TEST_CASE("between being lost and the first submap after it the pose is not in the map") {
  Config config = small();
  config.mapper.monitor.lost_scans = 2;
  Machine machine(config);
  REQUIRE(machine.status == Status::ok);
  circle(*machine, 0, 80);
  REQUIRE(machine->map_pose().linked);
  const std::uint32_t before = machine->collection().size();
  // Another room, and the wheels go on as they did.
  const test::Walls hall{
      {{-9.0, -1.0}, {9.0, -1.4}}, {{9.0, -1.4}, {9.3, 2.6}}, {{9.3, 2.6}, {-9.2, 1.8}}, {{-9.2, 1.8}, {-9.0, -1.0}}};
  std::vector<ScanUse> due;
  Pose2 last = machine->pose();
  for (int i = 80; due.size() < 2; ++i) {
    const Pose2 pose{0.25 * (i - 80), 0.2, 0.05 * (i - 80)};
    const std::vector<float> ranges = measure(hall, pose, config.lasers[0]);
    const Pose2 odometry = compose(on_circle(79), pose);
    const Result<ScanOutcome> outcome = machine->add({i * 100000, span(ranges), odometry, 0});
    REQUIRE(outcome.ok());
    CHECK(translation(between(last, machine->pose())) < 1.6);  // continuous, a wider search at most
    last = machine->pose();
    if (outcome.value().taken || outcome.value().use == ScanUse::doubted) {
      due.push_back(outcome.value().use);
    }
    REQUIRE(i < 100);
  }
  CHECK(due == std::vector<ScanUse>{ScanUse::doubted, ScanUse::lost});
  CHECK_FALSE(machine->map_pose().linked);
  CHECK(machine->map_pose().map_T_base.x == machine->pose().x);
  drain(*machine);
  CHECK_FALSE(machine->map_pose().linked);  // the old stretch's last submap does not link it
  CHECK(machine->collection().size() <= before + 1);
  REQUIRE(machine->begin_flush() == Status::ok);
  drain(*machine);
  CHECK(machine->map_pose().linked);
  CHECK(machine->collection().graph().component_count() == 2);
  REQUIRE(machine->new_session() == Status::ok);
  CHECK(machine->mapper().stretch() == 0);
}
