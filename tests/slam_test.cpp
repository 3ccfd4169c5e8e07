// The facade: memory, configuration, sessions, and what hostile or broken input does to it (nothing).
#include "mellin/slam.hpp"

#include <doctest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "ramflash/heap_flash.hpp"
#include "tests/store_fixture.hpp"
#include "tests/support/machine.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
}  // namespace

TEST_CASE("the small profiles keep to the sizes that they are made for, and hold a large building") {
  constexpr auto bytes_of = [](Config config) {
    config.lasers[0].beams = 180;
    return required_bytes(config);
  };
  // Where transforms run side by side their buffers take more: no board of these sizes does that.
  static_assert(kFftLanes > 1 || bytes_of(nano_profile()) <= 384 * 1024);
  static_assert(bytes_of(micro_profile()) <= 2048 * 1024);
  static_assert(nano_profile().max_submaps >= 144);
  static_assert(micro_profile().max_submaps >= 160);
  // At least one loop edge for every second submap, beside the odometry edges.
  constexpr PoseGraphConfig graph = nano_profile().collection.graph;
  static_assert(graph.max_edges >= nano_profile().max_submaps * 3 / 2);
}

TEST_CASE("digests that are not held need a flash to be read from") {
  const Config config = with_laser(nano_profile());
  REQUIRE_FALSE(config.screening.hold_digests);
  std::vector<std::string> lines;
  mellin_port port = {};
  port.log = sink_to(lines);
  GuardedMemory memory(required_bytes(config));
  CHECK(Slam::create(config, memory.span(), port).status() == Status::invalid_config);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("hold_digests") != std::string::npos);
}

TEST_CASE("validate() refuses each field out of its range and names it") {
  struct Bad {
    const char* field;
    std::function<void(Config&)> spoil;
  };
  const Bad all[] = {
      {"lasers", [](Config& c) { c.lasers[0].beams = 0; }},
      {"beams", [](Config& c) { c.lasers[0].beams = 4097; }},
      {"min_range_m", [](Config& c) { c.lasers[0].min_range_m = -0.1F; }},
      {"min_range_m", [](Config& c) { c.lasers[0].min_range_m = kNaN; }},
      {"max_range_m", [](Config& c) { c.lasers[0].max_range_m = 0.01F; }},
      {"max_range_m", [](Config& c) { c.lasers[0].max_range_m = 132.0F; }},
      {"max_range_m", [](Config& c) { c.lasers[0].max_range_m = kNaN; }},
      {"angle_increment_rad", [](Config& c) { c.lasers[0].angle_increment_rad = 0.1F; }},
      {"angle_increment_rad", [](Config& c) { c.lasers[0].angle_increment_rad = kNaN; }},
      {"angle_min_rad", [](Config& c) { c.lasers[0].angle_min_rad = INFINITY; }},
      {"base_T_laser", [](Config& c) { c.lasers[0].base_T_laser.x = NAN; }},
      {"base_T_laser", [](Config& c) { c.lasers[0].base_T_laser.y = -1e9; }},
      {"cell_m", [](Config& c) { c.cell_m = 0.0F; }},
      {"cell_m", [](Config& c) { c.cell_m = kNaN; }},
      {"side", [](Config& c) { c.side = 32; }},
      {"side", [](Config& c) { c.side = 200; }},
      {"side", [](Config& c) { c.side = 4096; }},
      {"remembered_scans", [](Config& c) { c.remembered_scans = 1; }},
      {"remembered_scans x beams", [](Config& c) { c.remembered_scans = 400; }},
      {"remembered_scans",
       [](Config& c) {
         c.mapper.count_once_a_scan = true;
         c.remembered_scans = 256;
       }},
      {"particles", [](Config& c) { c.mapper.particles = 0; }},
      {"spare_scans", [](Config& c) { c.mapper.spare_scans = 0; }},
      {"spare_scans", [](Config& c) { c.mapper.spare_scans = 65530; }},
      {"take_distance_m", [](Config& c) { c.mapper.take_distance_m = 0.0F; }},
      {"take_angle_rad", [](Config& c) { c.mapper.take_angle_rad = kNaN; }},
      {"resample_share", [](Config& c) { c.mapper.resample_share = kNaN; }},
      {"proposal_spread", [](Config& c) { c.mapper.proposal_spread = -1.0F; }},
      {"point_sigma_m", [](Config& c) { c.mapper.matcher.point_sigma_m = 0.0F; }},
      {"independent_share", [](Config& c) { c.mapper.matcher.independent_share = kNaN; }},
      {"distance_base_m", [](Config& c) { c.mapper.noise.distance_base_m = 0.0F; }},
      {"distance_per_m", [](Config& c) { c.mapper.noise.distance_per_m = kNaN; }},
      {"distance_per_rad", [](Config& c) { c.mapper.noise.distance_per_rad = -0.1F; }},
      {"angle_base_rad", [](Config& c) { c.mapper.noise.angle_base_rad = 0.0F; }},
      {"angle_per_m", [](Config& c) { c.mapper.noise.angle_per_m = INFINITY; }},
      {"angle_per_rad", [](Config& c) { c.mapper.noise.angle_per_rad = kNaN; }},
      {"search_points", [](Config& c) { c.mapper.matcher.search_points = 0; }},
      {"search_distance_m", [](Config& c) { c.mapper.matcher.search_distance_m = kNaN; }},
      {"search_distance_m", [](Config& c) { c.mapper.matcher.search_distance_m = 1e9F; }},
      {"search_angle_rad", [](Config& c) { c.mapper.matcher.search_angle_rad = 7.0F; }},
      {"search_angle_step_rad", [](Config& c) { c.mapper.matcher.search_angle_step_rad = 0.0F; }},
      {"scan_weight", [](Config& c) { c.mapper.matcher.scan_weight = kNaN; }},
      {"min_inlier_share", [](Config& c) { c.mapper.matcher.min_inlier_share = kNaN; }},
      {"recovery_distance_m", [](Config& c) { c.mapper.matcher.recovery_distance_m = 1e9F; }},
      {"recovery_angle_rad", [](Config& c) { c.mapper.matcher.recovery_angle_rad = kNaN; }},
      {"recovery_angle_step_rad", [](Config& c) { c.mapper.matcher.recovery_angle_step_rad = 0.0F; }},
      {"recovery_inlier_share", [](Config& c) { c.mapper.matcher.recovery_inlier_share = 1.1F; }},
      {"recovery_gain", [](Config& c) { c.mapper.matcher.recovery_gain = -0.1F; }},
      {"conflict_share", [](Config& c) { c.mapper.monitor.conflict_share = 0.0F; }},
      {"sure_share", [](Config& c) { c.mapper.monitor.sure_share = 2.0F; }},
      {"suspect_share", [](Config& c) { c.mapper.monitor.suspect_share = -1.0F; }},
      {"least_share", [](Config& c) { c.mapper.monitor.least_share = kNaN; }},
      {"every_scans", [](Config& c) { c.submaps.every_scans = 0; }},
      {"band_rows", [](Config& c) { c.submaps.band_rows = 0; }},
      {"max_path_m", [](Config& c) { c.submaps.max_path_m = kNaN; }},
      {"every_path_m", [](Config& c) { c.submaps.every_path_m = 0.0F; }},
      {"max_drift_m", [](Config& c) { c.submaps.max_drift_m = kNaN; }},
      {"max_drift_rad", [](Config& c) { c.submaps.max_drift_rad = -1.0F; }},
      {"drift_share", [](Config& c) { c.submaps.drift_share = kNaN; }},
      {"nearby_m", [](Config& c) { c.collection.nearby_m = kNaN; }},
      {"smoother.reach_m", [](Config& c) { c.submaps.smoother.reach_m = 0.0F; }},
      {"smoother.point_sigma_m", [](Config& c) { c.submaps.smoother.point_sigma_m = 0.0F; }},
      {"smoother.independent_share", [](Config& c) { c.submaps.smoother.independent_share = kNaN; }},
      {"smoother.step_sigma_m", [](Config& c) { c.submaps.smoother.step_sigma_m = 0.0F; }},
      {"smoother.step_sigma_rad", [](Config& c) { c.submaps.smoother.step_sigma_rad = -1.0F; }},
      {"smoother.points", [](Config& c) { c.submaps.smoother.points = 0; }},
      {"smoother.partners", [](Config& c) { c.submaps.smoother.partners = 11; }},
      {"screening_side", [](Config& c) { c.screening_side = 50; }},
      {"registration_side", [](Config& c) { c.registration_side = 0; }},
      {"peak_share", [](Config& c) { c.screening.matcher.peak_share = kNaN; }},
      {"max_peaks", [](Config& c) { c.screening.matcher.max_peaks = 0; }},
      {"com_radius", [](Config& c) { c.registration.matcher.com_radius = 4; }},
      {"min_peak", [](Config& c) { c.registration.matcher.min_peak = 1.5F; }},
      {"lowpass_sigma", [](Config& c) { c.screening.matcher.lowpass_sigma = kNaN; }},
      {"whitening_floor", [](Config& c) { c.registration.matcher.whitening_floor = 0.0F; }},
      {"turns_per_bin", [](Config& c) { c.screening.matcher.turns_per_bin = 9; }},
      {"kept_turns", [](Config& c) { c.registration.matcher.kept_turns = 1; }},
      {"edge_margin", [](Config& c) { c.screening.matcher.edge_margin = 0.2F; }},
      {"min_overlap", [](Config& c) { c.screening.matcher.min_overlap = 0.0F; }},
      {"preprocessing", [](Config& c) { c.screening.matcher.preprocessing = static_cast<Preprocessing>(3); }},
      {"rotation", [](Config& c) { c.registration.matcher.rotation = static_cast<RotationMode>(4); }},
      {"high_pass", [](Config& c) { c.screening.matcher.high_pass = static_cast<HighPass>(3); }},
      {"peak_fit", [](Config& c) { c.registration.matcher.peak_fit = static_cast<PeakFit>(2); }},
      {"coarse_peaks", [](Config& c) { c.screening.coarse_peaks = 7; }},
      {"coarse_peaks", [](Config& c) { c.screening.coarse_peaks = 1; }},  // features are not cached
      {"coarse_peaks",
       [](Config& c) {
         c.screening.cache_features = true;
         c.screening.coarse_peaks = 1;  // 20 pixels are too few
       }},
      {"coarse_peak", [](Config& c) { c.screening.coarse_peak = kNaN; }},
      {"coarse_agreement", [](Config& c) { c.screening.coarse_agreement = -0.1F; }},
      {"min_rotation_peak", [](Config& c) { c.screening.min_rotation_peak = 1.5F; }},
      {"first_peaks", [](Config& c) { c.screening.first_peaks = 0; }},
      {"further_agreement", [](Config& c) { c.screening.further_agreement = kNaN; }},
      {"verified", [](Config& c) { c.screening.verified = 0; }},
      {"verified_share", [](Config& c) { c.screening.verified_share = 2.0F; }},
      {"class_side", [](Config& c) { c.class_side = 100; }},
      {"class_side", [](Config& c) { c.class_side = 0; }},
      {"grid_slots", [](Config& c) { c.grid_slots = 1; }},
      {"max_submaps", [](Config& c) { c.max_submaps = 1; }},
      {"max_submaps", [](Config& c) { c.max_submaps = 70000; }},
      {"particles x side^2",
       [](Config& c) {
         c.side = 2048;
         c.screening_side = 64;
         c.registration_side = 64;
         c.class_side = 64;
         c.mapper.particles = 513;
       }},
      {"grid_slots x side^2",
       [](Config& c) {
         c.side = 2048;
         c.screening_side = 64;
         c.registration_side = 64;
         c.class_side = 64;
         c.grid_slots = 513;
       }},
      {"screening_side^2",
       [](Config& c) {
         c.max_submaps = 65535;
         c.collection.graph.max_edges = 65535;
         c.collection.graph.max_fill = 65535;
         c.screening.hold_digests = true;
         c.screening_side = static_cast<std::uint16_t>(c.side / 2);
       }},
      {"screening_side", [](Config& c) { c.screening_side = 20; }},
      {"registration_side", [](Config& c) { c.registration_side = 10; }},
      {"max_fill", [](Config& c) { c.collection.graph.max_fill = c.max_submaps - 1; }},
      {"work_per_step", [](Config& c) { c.collection.graph.work_per_step = 0; }},
      {"max_sessions", [](Config& c) { c.max_sessions = 0; }},
      {"pending", [](Config& c) { c.collection.linker.pending = 65; }},
      {"cache_features",
       [](Config& c) {
         c.screening.cache_features = true;
         c.screening.hold_digests = false;
       }},
      {"min_gain_bits", [](Config& c) { c.collection.linker.min_gain_bits = kNaN; }},
      {"base_m", [](Config& c) { c.collection.odometry.base_m = 0.0F; }},
      {"base_rad", [](Config& c) { c.collection.odometry.base_rad = kNaN; }},
  };
  std::vector<std::string> lines;
  const mellin_log sink = sink_to(lines);
  CHECK(validate(with_laser(micro_profile()), Log(sink)) == Status::ok);
  CHECK(validate(with_laser(nano_profile()), Log(sink)) == Status::ok);
  CHECK(validate(with_laser(desktop_profile()), Log(sink)) == Status::ok);
  CHECK(lines.empty());
  for (const Bad& bad : all) {
    CAPTURE(bad.field);
    lines.clear();
    Config config = with_laser(micro_profile());
    bad.spoil(config);
    CHECK(validate(config, Log(sink)) == Status::invalid_config);
    REQUIRE(lines.size() == 1);
    CHECK(lines[0].find(std::string(bad.field) + " is") != std::string::npos);
    std::vector<std::uint64_t> one(1);
    CHECK(Slam::create(config, {reinterpret_cast<std::byte*>(one.data()), 8}, {}).status() == Status::invalid_config);
  }
}

TEST_CASE("without flash the map still grows, and submaps that left RAM are missed, not invented") {
  Machine machine(small());
  REQUIRE(machine.status == Status::ok);
  circle(*machine, 0, 120);
  CHECK(machine->collection().size() > machine->store().slots().capacity());
  CHECK_FALSE(machine->store().keeps_data());
  CHECK(machine->store().begin_fetch(0) == Status::not_found);
  CHECK(translation(between(machine->pose(), between(on_circle(0), on_circle(119)))) < 0.1);
  CHECK(machine->begin_flush() == Status::ok);
  drain(*machine);
  CHECK_FALSE(machine->work());
}

TEST_CASE("sessions: each starts where it is told, in a component of its own, and their number is bounded") {
  Config config = small();
  config.max_sessions = 3;
  config.collection.close_loops = false;
  Machine machine(config);
  REQUIRE(machine.status == Status::ok);
  CHECK_FALSE(machine->map_pose().linked);
  circle(*machine, 0, 40);
  REQUIRE(machine->begin_flush() == Status::ok);
  CHECK(machine->new_session() == Status::busy);
  drain(*machine);
  const SubmapId first_size = machine->collection().size();
  REQUIRE(first_size > 0);
  CHECK(machine->map_pose().linked);
  CHECK(machine->map_pose().component == 0);
  REQUIRE(machine->set_pose({3.0, -2.0, 1.0}) == Status::ok);
  CHECK(machine->pose().x == 3.0);
  CHECK(machine->pose().theta == 1.0);
  CHECK_FALSE(machine->map_pose().linked);
  CHECK(machine->mapper().scans().end() == 0);
  circle(*machine, 0, 40);
  REQUIRE(machine->begin_flush() == Status::ok);
  drain(*machine);
  // A rigid motion of the room: the first scan lies where the session was told to start.
  const Pose2 moved = compose({3.0, -2.0, 1.0}, between(on_circle(0), on_circle(39)));
  CHECK(translation(between(machine->pose(), moved)) < 0.1);
  CHECK(machine->map_pose().component == first_size);
  CHECK(machine->collection().graph().component_count() == 2);
  REQUIRE(machine->new_session() == Status::ok);
  CHECK(machine->new_session() == Status::full);
  for (const double bad : {static_cast<double>(NAN), static_cast<double>(INFINITY), 1e300, -1e9}) {
    CHECK(machine->new_session({bad, 0.0, 0.0}) == Status::invalid_argument);
    CHECK(machine->new_session({0.0, 0.0, bad}) == Status::invalid_argument);
  }
}

TEST_CASE("bad scans are refused or ridden out, and the map keeps going") {
  Machine machine(small());
  REQUIRE(machine.status == Status::ok);
  Slam& slam = *machine;
  circle(slam, 0, 20);
  const Pose2 before = slam.pose();
  const std::vector<float> good = measure(room(), on_circle(20), slam.config().lasers[0]);
  const auto refused = [&](const Scan& scan) {
    CHECK(slam.add(scan).status() == Status::bad_data);
    CHECK(slam.pose().x == before.x);
    CHECK(slam.pose().theta == before.theta);
  };
  refused({0, span(good).first(89), on_circle(20), 0});
  refused({0, Span<const float>(), on_circle(20), 0});
  refused({0, span(good), on_circle(20), 1});
  refused({0, span(good), on_circle(20), 200});
  for (const double bad : {static_cast<double>(NAN), static_cast<double>(INFINITY), 1e300}) {
    refused({0, span(good), {bad, 0.0, 0.0}, 0});
    refused({0, span(good), {0.0, bad, 0.0}, 0});
    refused({0, span(good), {0.0, 0.0, bad}, 0});
  }
  CHECK(slam.mapper().statistics().refused == 13);

  const auto truth = [&](int step) { return between(on_circle(0), on_circle(step)); };
  // Blind for a few steps: it rides on odometry, which is exact here.
  const std::vector<float> blind(90, kNaN);
  for (int i = 20; i < 26; ++i) {
    const Result<ScanOutcome> outcome = slam.add({0, span(blind), on_circle(i), 0});
    REQUIRE(outcome.ok());
    CHECK(outcome.value().use == ScanUse::odometry);
  }
  const Pose2 ridden = compose(before, between(on_circle(19), on_circle(25)));
  CHECK(translation(between(slam.pose(), ridden)) < 1e-9);
  // Ranges of all kinds of nonsense are beams that measured nothing; the clock may jump.
  std::vector<float> nonsense = good;
  for (std::size_t i = 0; i < nonsense.size(); i += 4) {
    const float values[] = {kNaN, INFINITY, -INFINITY, -3.0F, 1e30F, 0.0F};
    nonsense[i] = values[i / 4 % 6];
  }
  CHECK(slam.add({INT64_MIN, span(nonsense), on_circle(20), 0}).ok());
  CHECK(slam.add({INT64_MAX, span(good), on_circle(20), 0}).ok());
  drain(slam);
  circle(slam, 21, 60);
  CHECK(translation(between(slam.pose(), truth(59))) < 0.1);

  // Odometry that jumps far away, and on and on: accepted or refused, never beyond what the grid can count.
  for (int i = 0; i < 4000; ++i) {
    const double side = i % 2 == 0 ? 9e5 : -9e5;
    (void)slam.add({0, span(good), {side, side, i % 2 == 0 ? 0.0 : kPi}, 0}).ok();
    CHECK(std::fabs(slam.pose().x) < 1e7);
    CHECK(std::fabs(slam.pose().y) < 1e7);
  }
  drain(slam);
  REQUIRE(slam.begin_flush() == Status::ok);
  drain(slam);
  REQUIRE(slam.new_session() == Status::ok);
  circle(slam, 0, 30);
  CHECK(translation(between(slam.pose(), truth(29))) < 0.1);
  CHECK(machine.memory.intact());
}

TEST_CASE("when nobody calls work() the live map goes on, and submaps are delayed, not broken") {
  Machine machine(small());
  REQUIRE(machine.status == Status::ok);
  for (int i = 0; i < 250; ++i) {
    REQUIRE(add_at(*machine, on_circle(i)).ok());
  }
  CHECK(machine->statistics().submaps_delayed > 0);
  CHECK(translation(between(machine->pose(), between(on_circle(0), on_circle(249)))) < 0.1);
  drain(*machine);  // the one that was frozen has lost its scans meanwhile
  CHECK(machine->statistics().submaps_lost == 1);
  CHECK(machine->collection().size() == 0);
  circle(*machine, 250, 300);
  CHECK(machine->collection().size() > 0);
}

TEST_CASE("a full collection loses submaps, counts them, and keeps the robot localised") {
  Config config = small();
  config.max_submaps = 3;
  Machine machine(config);
  REQUIRE(machine.status == Status::ok);
  circle(*machine, 0, 120);
  CHECK(machine->collection().size() == 3);
  CHECK(machine->statistics().submaps_lost > 0);
  CHECK(translation(between(machine->pose(), between(on_circle(0), on_circle(119)))) < 0.1);
}

TEST_CASE("the power may go at any moment of a run: what was reported as stored is there after the restart") {
  const Config config = small();
  std::uint32_t with_submaps = 0;
  for (std::uint64_t cut = 0; cut < 400; cut += cut < 12 ? 1 : 29) {
    CAPTURE(cut);
    test::TornFlash flash({4096, 64, 256});
    mellin_port port = {};
    port.flash = flash.flash();
    std::uint32_t stored = 0;
    {
      Machine before(config, port);
      REQUIRE(before.status == Status::ok);
      flash.cut_after(cut, static_cast<std::uint32_t>(cut), cut % 2 == 1);
      circle(*before, 0, 160);  // the map goes on without its flash
      REQUIRE(before->begin_flush() == Status::ok);
      drain(*before);
      stored = before->collection().statistics().stored;
    }
    flash.restore();
    Machine after(config, port);
    REQUIRE(after.status == Status::ok);
    CHECK(after->collection().size() >= stored);
    CHECK(after->collection().size() <= stored + 1);  // the commit itself may have been cut
    for (SubmapId id = 0; id < after->collection().size(); ++id) {
      CHECK(after->store().grid_crc32(id).ok());
    }
    with_submaps += stored > 0 ? 1U : 0U;
    const std::uint32_t found = after->collection().size();
    circle(*after, 0, 100);
    CHECK(after->collection().size() > found);
    CHECK(flash.violations() == 0);
  }
  CHECK(with_submaps > 3);
}
