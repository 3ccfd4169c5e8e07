// The particle filter that forgets, and the submaps rendered from what it remembers.
#include <doctest.h>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <utility>
#include <vector>

#include "mellin/core/random.hpp"
#include "mellin/mapping/particle_mapper.hpp"
#include "mellin/mapping/submap_builder.hpp"
#include "tests/support/carved.hpp"
#include "tests/support/cell_map.hpp"
#include "tests/support/room.hpp"

using namespace mellin;
using mellin::test::give;
using mellin::test::measure;
using mellin::test::room;
using mellin::test::span;

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Drive {
  struct Step {
    Pose2 truth;
    Pose2 odometry;
    std::vector<float> ranges;
  };
  LaserConfig lasers[kMaxLasers];
  std::vector<Step> steps;

  /// Laps round the room's pillar with odometry that is wrong in scale, drifts in heading and is noisy.
  explicit Drive(int count, std::uint64_t seed = 1) {
    lasers[0].beams = 180;
    lasers[0].max_range_m = 20.0F;
    Random random(seed, 1);
    Pose2 odometry{7.0, -3.0, 2.0};  // the odometry's frame is any
    for (int i = 0; i < count; ++i) {
      const double angle = 0.08 * i;
      const Pose2 truth{2.4 * std::cos(angle) - 0.6, 1.9 * std::sin(angle),
                        angle + kHalfPi + 0.2 * std::sin(5 * angle)};
      if (i > 0) {
        const Pose2 step = between(steps.back().truth, truth);
        odometry = compose(odometry, {1.05 * step.x + 0.003 * random.normal(), 1.05 * step.y + 0.003 * random.normal(),
                                      step.theta - 0.002 + 0.003 * random.normal()});
      }
      std::vector<float> ranges = measure(room(), truth, lasers[0]);
      for (float& range : ranges) {
        range += 0.01F * static_cast<float>(random.normal());
      }
      steps.push_back({truth, odometry, ranges});
    }
  }
  Pose2 truth(std::size_t i) const { return between(steps[0].truth, steps[i].truth); }
  Scan scan(std::size_t i) const { return {static_cast<std::int64_t>(i), span(steps[i].ranges), steps[i].odometry, 0}; }
};

struct Mapper {
  std::vector<std::uint64_t> words;
  ParticleMapper mapper;
  Mapper(const Drive& drive, ParticleMapperConfig config, std::uint64_t seed = 1)
      : mapper(config, give<ParticleMapper>(words, config), {drive.lasers, kMaxLasers}, seed) {}
};

ParticleMapperConfig mapper_config(std::uint16_t particles = 1) {
  ParticleMapperConfig config;
  config.particles = particles;
  config.remembered_scans = 24;
  config.spare_scans = 4;
  config.side = 512;
  config.max_beams = 180;
  return config;
}

constexpr CellRect kEverywhere{-100000, -100000, 100000, 100000};

/// Every beam of a scan walked cell by cell, without clipping.
void count(mellin::test::CellMap& counts, const ScanMemory& scans, std::uint32_t number, const Pose2& pose,
           float cell_m) {
  scans.visit_rays(number, grid_pose(pose, cell_m), cell_m, [&](const Ray& ray) {
    visit_ray(ray, kEverywhere, [&](std::int32_t c, std::int32_t r, bool hit) { counts.count(c, r, hit); });
  });
}

/// A local mapper whose poses and drifts the test decides: what the submap builder needs of one.
class FakeMapper final : public LocalMapper {
 public:
  explicit FakeMapper(std::uint16_t capacity, std::uint16_t remembered) : remembered_(remembered) {
    lasers_[0].beams = 90;
    lasers_[0].angle_min_rad = -2.0F;
    lasers_[0].angle_increment_rad = 0.05F;
    lasers_[0].max_range_m = 20.0F;
    const ScanMemoryConfig config{capacity, 90};
    scans_ = ScanMemory(config, give<ScanMemory>(words_, config), {lasers_, kMaxLasers});
  }
  void take(const Pose2& pose, const Sym3& drift = {}) { take(pose, pose, drift); }
  /// A scan from `truth` that the mapper believes to be from `pose`.
  void take(const Pose2& pose, const Pose2& truth, const Sym3& drift) {
    const std::vector<float> ranges = measure(room(), truth, lasers_[0]);
    scans_.stage({static_cast<std::int64_t>(poses_.size()) * 1000, span(ranges), {}, 0});
    (void)scans_.take_staged();
    poses_.push_back(pose);
    drifts_.push_back(drift);
  }
  void reset(const Pose2&) override {}
  Result<ScanOutcome> add(const Scan&) override { return Status::bad_data; }
  Pose2 pose() const override { return poses_.back(); }
  Sym3 covariance() const override { return {}; }
  const CountingGrid& live_map() const override { return grid_; }
  float cell_m() const override { return 0.05F; }
  const ScanMemory& scans() const override { return scans_; }
  std::uint32_t first_remembered() const override {
    return scans_.end() > remembered_ ? scans_.end() - remembered_ : 0;
  }
  std::uint16_t stretch() const override { return 0; }
  std::uint32_t stretch_begin() const override { return 0; }
  Pose2 scan_pose(std::uint32_t number) const override { return poses_[number]; }
  Sym3 scan_drift(std::uint32_t number) const override { return drifts_[number]; }
  const MapperStatistics& statistics() const override { return statistics_; }

 private:
  std::vector<std::uint64_t> words_;
  LaserConfig lasers_[kMaxLasers];
  std::uint16_t remembered_;
  ScanMemory scans_;
  CountingGrid grid_;
  MapperStatistics statistics_;
  std::vector<Pose2> poses_;
  std::vector<Sym3> drifts_;
};

SubmapBuilderConfig builder_config(std::uint16_t band_rows = 32) {
  SubmapBuilderConfig config;
  config.max_scans = 10;
  config.every_scans = 4;
  config.max_path_m = 1000.0F;
  config.every_path_m = 1000.0F;
  config.side = 256;
  config.band_rows = band_rows;
  config.drift_share = 0.5F;
  config.smoother.iterations = 0;
  return config;
}

struct Builder {
  std::vector<std::uint64_t> words;
  SubmapBuilder builder;
  explicit Builder(const SubmapBuilderConfig& config) : builder(config, give<SubmapBuilder>(words, config)) {}
};

struct Due {
  std::vector<int> after;             ///< numbers of taken scans, from 1, at which a submap was due
  std::vector<std::uint32_t> counts;  ///< how many scans each then holds
};

/// The robot goes to and fro by `step_m`; each submap that is due is begun and rendered.
Due due_at(const SubmapBuilderConfig& config, int scans, double step_m, const Sym3& drift = {}) {
  FakeMapper mapper(40, 30);
  Builder b(config);
  std::vector<std::uint8_t> cells(std::size_t{config.side} * config.side);
  Due due;
  for (int i = 1; i <= scans; ++i) {
    mapper.take({i % 2 == 0 ? step_m : 0.0, 0.0, 0.0}, drift);
    if (b.builder.scan_taken(mapper)) {
      REQUIRE(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::ok);
      b.builder.abort();
      due.after.push_back(i);
      due.counts.push_back(b.builder.header().scan_count);
    }
  }
  return due;
}

}  // namespace

TEST_CASE("one particle follows the truth to 2 cm over laps with bad odometry, and takes what it should") {
  const Drive drive(260);
  ParticleMapperConfig config = mapper_config();
  config.remembered_scans = 40;  // more than a lap
  Mapper m(drive, config);
  std::size_t taken = 0;
  double worst = 0.0, worst_turn = 0.0;
  double squares = 0.0, sum_x = 0.0, sum_y = 0.0;
  Pose2 at_taken;
  for (std::size_t i = 0; i < drive.steps.size(); ++i) {
    const Result<ScanOutcome> outcome = m.mapper.add(drive.scan(i));
    REQUIRE(outcome.ok());
    const Pose2 moved = between(at_taken, drive.steps[i].odometry);
    const bool due = i == 0 || translation(moved) >= 0.5 || std::fabs(moved.theta) >= kPi / 6;
    CHECK(outcome.value().taken == due);
    CHECK(outcome.value().use == (due ? ScanUse::taken : ScanUse::matched));
    if (due) {
      at_taken = drive.steps[i].odometry;
      ++taken;
    }
    REQUIRE(outcome.value().anchor_scan == taken - 1);
    const Pose2 from_anchor = compose(m.mapper.scan_pose(outcome.value().anchor_scan), outcome.value().anchor_T_base);
    CHECK(translation(between(from_anchor, m.mapper.pose())) < 1e-9);
    const Pose2 error = between(drive.truth(i), m.mapper.pose());
    worst = std::max(worst, translation(error));
    const double dx = m.mapper.pose().x - drive.truth(i).x;
    const double dy = m.mapper.pose().y - drive.truth(i).y;
    squares += dx * dx + dy * dy;
    sum_x += dx;
    sum_y += dy;
    worst_turn = std::max(worst_turn, std::fabs(error.theta));
  }
  // Round the mean offset, which is that of the first scan within its cells.
  const auto steps = static_cast<double>(drive.steps.size());
  CHECK(std::sqrt((squares - (sum_x * sum_x + sum_y * sum_y) / steps) / steps) < 0.02);
  CHECK(worst < 0.05);  // a cell: the first scan alone decides where in their cells the walls lie
  CHECK(worst_turn < 0.01);
  // The odometry alone is far off by then.
  const Pose2 odometry = between(drive.steps.front().odometry, drive.steps.back().odometry);
  CHECK(translation(between(drive.truth(259), odometry)) > 0.5);
  CHECK(m.mapper.statistics().taken == taken);
  CHECK(m.mapper.statistics().scans == 260);
  CHECK(m.mapper.statistics().unmatched == 0);
}

namespace {

/// How much shorter a drive along a plain corridor comes out than its odometry, which is exact; share of it.
double shortened(float search_gain) {
  LaserConfig lasers[kMaxLasers];
  lasers[0].beams = 180;
  lasers[0].max_range_m = 12.0F;
  ParticleMapperConfig config = mapper_config();
  config.matcher.search_gain = search_gain;
  std::vector<std::uint64_t> words;
  ParticleMapper mapper(config, give<ParticleMapper>(words, config), {lasers, kMaxLasers}, 1);
  Random random(1, 1);
  constexpr int kScans = 80;
  for (int i = 0; i < kScans; ++i) {
    const Pose2 truth{-20.0 + 0.5 * i, 0.1 * std::sin(0.3 * i), 0.03 * std::cos(0.3 * i)};
    std::vector<float> ranges = measure(test::corridor(), truth, lasers[0]);
    for (float& range : ranges) {
      range += 0.01F * static_cast<float>(random.normal());
    }
    REQUIRE(mapper.add({i, span(ranges), truth, 0}).ok());
  }
  // What the scans say along it is next to nothing, and so is what is claimed of the scale.
  CHECK(std::fabs(mapper.odometry().bias().scale) < std::sqrt(mapper.odometry().bias_covariance().xx));
  return 1.0 - translation(mapper.pose()) / (0.5 * (kScans - 1));
}

}  // namespace

TEST_CASE("along a plain corridor the way is that of the odometry, unless the search runs after the map's roughness") {
  const double held = shortened(ScanMatcherConfig{}.search_gain);
  const double loose = shortened(0.0F);
  CAPTURE(held);
  CAPTURE(loose);
  CHECK(std::fabs(held) < 0.008);
  CHECK(loose > 2.0 * std::fabs(held));
}

TEST_CASE("the live map is that of the remembered scans, whatever came before") {
  const Drive drive(260);
  for (const std::uint16_t particles : std::initializer_list<std::uint16_t>{1, 4}) {
    ParticleMapperConfig config = mapper_config(particles);
    config.cell_m = 0.1F;
    config.side = 256;
    Mapper m(drive, config);
    for (std::size_t i = 0; i < drive.steps.size(); ++i) {
      REQUIRE(m.mapper.add(drive.scan(i)).ok());
      if (i != 60 && i + 1 != drive.steps.size()) {
        continue;
      }
      const ScanMemory& scans = m.mapper.scans();
      const CellRect w = m.mapper.live_map().window();
      mellin::test::CellMap expected(w);
      for (std::uint32_t n = m.mapper.first_remembered(); n < scans.end(); ++n) {
        count(expected, scans, n, m.mapper.scan_pose(n), config.cell_m);
      }
      std::size_t wrong = 0, hits = 0;
      for (std::int32_t r = w.row_min; r < w.row_end; ++r) {
        for (std::int32_t c = w.column_min; c < w.column_end; ++c) {
          const CellCount want = expected.at(c, r);
          const CellCount have = m.mapper.live_map().at(c, r);
          wrong += want.hits != have.hits || want.observations != have.observations ? 1U : 0U;
          hits += have.hits;
        }
      }
      CHECK(wrong == 0);
      CHECK(hits > 1000);
    }
    CHECK(m.mapper.scans().end() > 2U * config.remembered_scans);
    CHECK(m.mapper.scans().end() - m.mapper.first_remembered() == config.remembered_scans);
  }
}

TEST_CASE("ten particles: the seed decides, the truth is followed all the same") {
  const Drive drive(120);
  ParticleMapperConfig config = mapper_config(10);
  config.cell_m = 0.1F;
  config.side = 256;
  const auto run = [&](std::uint64_t seed) {
    Mapper m(drive, config, seed);
    std::vector<Pose2> poses;
    for (std::size_t i = 0; i < drive.steps.size(); ++i) {
      REQUIRE(m.mapper.add(drive.scan(i)).ok());
      poses.push_back(m.mapper.pose());
      CHECK(translation(between(drive.truth(i), m.mapper.pose())) < 0.2);  // two cells
      const Sym3 covariance = m.mapper.covariance();
      CHECK(covariance.xx > 0.0);
      CHECK(covariance.xx < 0.1);
    }
    CHECK(m.mapper.statistics().resampled > 0);
    return poses;
  };
  const std::vector<Pose2> first = run(1), again = run(1), other = run(2);
  std::size_t same = 0, same_other = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const auto equal = [](const Pose2& a, const Pose2& b) { return a.x == b.x && a.y == b.y && a.theta == b.theta; };
    same += equal(first[i], again[i]) ? 1U : 0U;
    same_other += equal(first[i], other[i]) ? 1U : 0U;
  }
  CHECK(same == first.size());
  CHECK(same_other < first.size() / 4);
}

TEST_CASE("bad scans are refused and change nothing; a blind laser rides on odometry") {
  const Drive drive(60);
  ParticleMapperConfig config = mapper_config();
  config.odometry.learn_bias = false;  // the ride is that of the raw odometry
  Mapper m(drive, config);
  for (std::size_t i = 0; i < 40; ++i) {
    REQUIRE(m.mapper.add(drive.scan(i)).ok());
  }
  const Pose2 before = m.mapper.pose();
  const std::uint32_t taken = m.mapper.scans().end();
  Scan bad = drive.scan(59);
  bad.odom_T_base.theta = static_cast<double>(kNaN);
  CHECK(m.mapper.add(bad).status() == Status::bad_data);
  bad = drive.scan(59);
  bad.ranges_m = bad.ranges_m.first(179);
  CHECK(m.mapper.add(bad).status() == Status::bad_data);
  for (const std::uint8_t laser : std::initializer_list<std::uint8_t>{1, 3, 4, 255}) {
    bad = drive.scan(59);
    bad.laser = laser;
    CHECK(m.mapper.add(bad).status() == Status::bad_data);
  }
  bad = drive.scan(59);
  bad.odom_T_base.x = 1.5 * ParticleMapper::kReach_m;
  CHECK(m.mapper.add(bad).status() == Status::bad_data);
  CHECK(m.mapper.statistics().refused == 7);
  CHECK(m.mapper.scans().end() == taken);
  CHECK(m.mapper.pose().x == before.x);
  CHECK(m.mapper.pose().theta == before.theta);

  const std::vector<float> blind(180, kNaN);
  for (std::size_t i = 40; i < 50; ++i) {
    Scan scan = drive.scan(i);
    scan.ranges_m = span(blind);
    const Result<ScanOutcome> outcome = m.mapper.add(scan);
    REQUIRE(outcome.ok());
    CHECK(outcome.value().use == ScanUse::odometry);
    const Pose2 by_odometry = compose(before, between(drive.steps[39].odometry, drive.steps[i].odometry));
    CHECK(translation(between(by_odometry, m.mapper.pose())) < 1e-9);
  }
  CHECK(m.mapper.statistics().unmatched == 10);
  // Sight again: back on the map.
  for (std::size_t i = 50; i < 60; ++i) {
    REQUIRE(m.mapper.add(drive.scan(i)).ok());
  }
  CHECK(translation(between(drive.truth(59), m.mapper.pose())) < 0.05);
}

TEST_CASE("a blind robot rides the better the more it has learnt of its odometry") {
  const Drive drive(200);
  double off[2] = {};
  for (const bool learn : {false, true}) {
    ParticleMapperConfig config = mapper_config();
    config.odometry.learn_bias = learn;
    Mapper m(drive, config);
    const std::vector<float> blind(180, kNaN);
    for (std::size_t i = 0; i < 200; ++i) {
      Scan scan = drive.scan(i);
      scan.ranges_m = i < 120 ? scan.ranges_m : span(blind);
      REQUIRE(m.mapper.add(scan).ok());
    }
    off[learn ? 1 : 0] = translation(between(drive.truth(199), m.mapper.pose()));
  }
  CAPTURE(off[0]);
  CAPTURE(off[1]);
  CHECK(off[1] < 0.5 * off[0]);
}

TEST_CASE("a submap is the frozen scans rendered in one piece, whatever the bands, centred where they lie") {
  FakeMapper mapper(16, 12);
  for (int i = 0; i < 15; ++i) {
    mapper.take({-2.0 + 0.25 * i, 0.6 * std::sin(0.9 * i), 0.3 * i});
  }
  for (const std::uint16_t band_rows : std::initializer_list<std::uint16_t>{1, 7, 32, 100, 256, 400}) {
    CAPTURE(band_rows);
    const SubmapBuilderConfig config = builder_config(band_rows);
    Builder b(config);
    std::vector<std::uint8_t> cells(std::size_t{config.side} * config.side, 1);
    REQUIRE(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::ok);
    CHECK(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::busy);
    int steps = 0;
    for (bool done = false; !done; ++steps) {
      const Result<bool> result = b.builder.step(mapper.scans());
      REQUIRE(result.ok());
      done = result.value();
    }
    CHECK(steps == (256 + band_rows - 1) / band_rows);
    CHECK_FALSE(b.builder.active());
    // The ten newest: 5 to 14.
    const SubmapHeader& header = b.builder.header();
    CHECK(header.first_scan == 5);
    CHECK(header.scan_count == 10);
    CHECK(header.stamp_us == 14000);
    double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9;
    for (std::uint32_t n = 5; n < 15; ++n) {
      const Pose2 p = mapper.scan_pose(n);
      low_x = std::min(low_x, p.x), high_x = std::max(high_x, p.x);
      low_y = std::min(low_y, p.y), high_y = std::max(high_y, p.y);
    }
    CHECK(header.session_T_submap.x == doctest::Approx((low_x + high_x) / 2));
    CHECK(header.session_T_submap.y == doctest::Approx((low_y + high_y) / 2));
    CHECK(translation(between(compose(header.session_T_submap, header.submap_T_robot), mapper.pose())) < 1e-9);
    mellin::test::CellMap counts({-128, -128, 128, 128});
    for (std::uint32_t n = 5; n < 15; ++n) {
      count(counts, mapper.scans(), n, between(header.session_T_submap, mapper.scan_pose(n)), config.cell_m);
    }
    std::size_t wrong = 0, occupied = 0;
    for (int r = 0; r < 256; ++r) {
      for (int c = 0; c < 256; ++c) {
        const std::uint8_t want = submap_cell(counts.at(c - 128, r - 128));
        const std::uint8_t have = cells[static_cast<std::size_t>(r * 256 + c)];
        wrong += want != have ? 1U : 0U;
        occupied += have > 127 && have != kUnobserved ? 1U : 0U;
      }
    }
    CHECK(wrong == 0);
    CHECK(occupied > 200);
  }
}

TEST_CASE("the step from the submap before is that of the scans that both hold, and of none after a reset") {
  FakeMapper mapper(40, 24);
  Builder b(builder_config());
  std::vector<std::uint8_t> cells(256 * 256);
  const auto freeze = [&] {
    REQUIRE(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::ok);
    for (bool done = false; !done;) {
      const Result<bool> step = b.builder.step(mapper.scans());
      REQUIRE(step.ok());
      done = step.value();
    }
    return b.builder.header();
  };
  const auto take = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const auto n = static_cast<double>(mapper.scans().end());
      mapper.take({-3.0 + 0.2 * n, 0.3 * std::sin(n), 0.1 * n});
      (void)b.builder.scan_taken(mapper);
    }
  };
  take(12);
  const SubmapHeader first = freeze();  // scans 2 to 11
  CHECK(b.builder.from_before().shared_scans == 0);
  take(4);
  const SubmapHeader second = freeze();  // scans 6 to 15
  const SubmapStep step = b.builder.from_before();
  CHECK(step.before_first_scan == 2);
  CHECK(step.shared_scans == 6);
  const Pose2 off = between(between(first.session_T_submap, second.session_T_submap), step.before_T_submap);
  CHECK(translation(off) < 1e-9);
  CHECK(std::fabs(off.theta) < 1e-9);
  b.builder.reset();
  take(1);
  (void)freeze();  // scans 7 to 16, of which the one before held nine; but that was another session
  CHECK(b.builder.from_before().shared_scans == 0);
}

TEST_CASE(
    "smoothed submaps are joined by where both hold their scans, and their newest scan stays where the robot is") {
  FakeMapper mapper(40, 24);
  SubmapBuilderConfig config = builder_config();
  config.smoother.iterations = 3;
  config.smoother.max_scans = config.max_scans;
  config.smoother.max_beams = 90;
  Builder b(config);
  std::vector<std::uint8_t> cells(256 * 256);
  Random random(5, 1);
  std::vector<std::vector<Pose2>> frozen;
  std::vector<SubmapHeader> headers;
  for (int i = 0; i < 16; ++i) {
    const Pose2 truth{-3.0 + 0.2 * i, 0.3 * std::sin(i), 0.1 * i};
    const Pose2 seen =
        compose(truth, {0.02 * random.normal(), 0.02 * random.normal(), 0.005 * random.normal()});  // as mapped
    mapper.take(seen, truth, Sym3{});
    (void)b.builder.scan_taken(mapper);
    if (i != 11 && i != 15) {
      continue;
    }
    REQUIRE(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::ok);
    for (bool done = false; !done;) {
      const Result<bool> step = b.builder.step(mapper.scans());
      REQUIRE(step.ok());
      done = step.value();
    }
    headers.push_back(b.builder.header());
    const Span<const Pose2> poses = b.builder.submap_T_scan();
    frozen.emplace_back(poses.begin(), poses.end());
    CHECK(translation(between(compose(headers.back().session_T_submap, headers.back().submap_T_robot), seen)) < 1e-9);
  }
  // Scans 6 to 11 are in both. Laid on one another by the step they agree on average; by the mapper's poses they do
  // not.
  const auto mean_off = [&](const Pose2& step) {
    Pose2 mean;
    for (std::size_t i = 0; i < 6; ++i) {
      const Pose2 here = compose(step, frozen[1][i]);
      mean = {mean.x + (here.x - frozen[0][i + 4].x) / 6, mean.y + (here.y - frozen[0][i + 4].y) / 6,
              mean.theta + wrap_angle(here.theta - frozen[0][i + 4].theta) / 6};
    }
    return mean;
  };
  const SubmapStep step = b.builder.from_before();
  REQUIRE(step.shared_scans == 6);
  CHECK(translation(mean_off(step.before_T_submap)) < 1e-9);
  CHECK(std::fabs(mean_off(step.before_T_submap).theta) < 1e-9);
  CHECK(translation(mean_off(between(headers[0].session_T_submap, headers[1].session_T_submap))) > 0.002);
}

TEST_CASE("submaps are due after K scans and then each N, or after so much path, or when drift has added up") {
  CHECK(due_at(builder_config(), 30, 0.1).after == std::vector<int>{10, 14, 18, 22, 26, 30});
  CHECK(due_at(builder_config(), 30, 0.1).counts == std::vector<std::uint32_t>(6, 10));
  SubmapBuilderConfig path = builder_config();
  path.max_path_m = 3.1F;
  path.every_path_m = 1.1F;
  // Steps of 0.5 m: 3.5 m after the eighth scan, then 1.5 m more each; 6 steps fit into 3.1 m, which are 7 scans.
  const Due by_path = due_at(path, 17, 0.5);
  CHECK(by_path.after == std::vector<int>{8, 11, 14, 17});
  CHECK(by_path.counts == std::vector<std::uint32_t>(4, 7));
  // Drift of 0.1 m a scan that points the same way with share 0.5: after n scans 0.05 n m. The limit of 0.32 m is
  // passed by the seventh; among the last n scans n - 1 lie between, so that seven hold together.
  SubmapBuilderConfig drift = builder_config();
  drift.max_drift_m = 0.32F;
  drift.min_scans = 3;
  const Due by_drift = due_at(drift, 9, 0.1, diagonal(0.01, 0.0, 0.0));
  REQUIRE(!by_drift.after.empty());
  CHECK(by_drift.after[0] == 7);
  CHECK(by_drift.counts[0] == 7);
  // However uncertain, min_scans are rendered.
  drift.max_drift_m = 0.0001F;
  const Due hopeless = due_at(drift, 9, 0.1, diagonal(0.01, 0.0, 0.0));
  CHECK(hopeless.after == std::vector<int>{3, 6, 9});
  CHECK(hopeless.counts == std::vector<std::uint32_t>(3, 3));
  // So does heading.
  drift.max_drift_m = 100.0F;
  drift.max_drift_rad = 0.001F;
  CHECK(due_at(drift, 9, 0.1, diagonal(0.0, 0.0, 0.01)).after == std::vector<int>{3, 6, 9});
}

TEST_CASE("the drift between two submaps is that of the scans from middle to middle, all pointing the same way") {
  FakeMapper mapper(40, 40);
  Builder b(builder_config());
  std::vector<std::uint8_t> cells(std::size_t{256} * 256);
  for (int i = 0; i < 10; ++i) {
    mapper.take({0.0, 0.0, 0.0}, diagonal(0.01, 0.0004, 0.0));
  }
  REQUIRE(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::ok);
  CHECK(b.builder.from_before().drift.xx == 0.0);  // there is none before
  b.builder.abort();
  for (int i = 0; i < 4; ++i) {
    mapper.take({0.0, 0.0, 0.0}, diagonal(0.01, 0.0004, 0.0));
  }
  REQUIRE(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::ok);
  // Four scans of deviation 0.1 m, half of which is common: (4 * 0.05)^2; across a fifth of it.
  CHECK(b.builder.from_before().drift.xx == doctest::Approx(0.04));
  CHECK(b.builder.from_before().drift.yy == doctest::Approx(0.0016));
}

TEST_CASE("a submap whose scans leave the memory meanwhile is lost, and says so; without scans there is none") {
  FakeMapper mapper(12, 10);
  Builder b(builder_config());
  std::vector<std::uint8_t> cells(std::size_t{256} * 256);
  CHECK(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::degenerate);
  for (int i = 0; i < 10; ++i) {
    mapper.take({0.1 * i, 0.0, 0.0});
  }
  REQUIRE(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::ok);
  mapper.take({1.0, 0.0, 0.0});
  mapper.take({1.1, 0.0, 0.0});
  REQUIRE(b.builder.step(mapper.scans()).ok());  // the spare ones have not run out
  mapper.take({1.2, 0.0, 0.0});
  CHECK(b.builder.step(mapper.scans()).status() == Status::not_found);
  CHECK_FALSE(b.builder.active());
  CHECK(b.builder.begin(mapper, {cells.data(), cells.size()}) == Status::ok);
}
