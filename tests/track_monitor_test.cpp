// When the local mapper doubts where it is, when it says that it is lost, and what it compares with what.
#include "mellin/mapping/track_monitor.hpp"

#include <doctest.h>

#include <cmath>
#include <initializer_list>
#include <vector>

#include "mellin/mapping/live_grid.hpp"
#include "tests/support/room.hpp"

using namespace mellin;
using mellin::test::measure;
using mellin::test::room;
using mellin::test::span;
using mellin::test::Walls;

namespace {

/// Of 60 beams.
MapAgreement agreement(std::uint16_t agreeing, std::uint16_t short_of, std::uint16_t through) {
  return {60, agreeing, short_of, through};
}

constexpr MapAgreement kHome{60, 58, 1, 0};
constexpr MapAgreement kElsewhere{60, 12, 18, 15};
constexpr MapAgreement kNewRoom{60, 6, 1, 0};

/// The live grid of scans at known poses, and a matcher over it.
struct Bench {
  LaserConfig lasers[kMaxLasers];
  ScanMatcherConfig config;
  std::vector<std::uint64_t> words[3];
  LiveGrid grid;
  ScanMatcher matcher;
  ScanMemory scans;

  template <class T, class... Arguments>
  typename T::Memory give(std::size_t at, const Arguments&... arguments) {
    MeasureArena measured;
    (void)T::carve(measured, arguments...);
    words[at].assign(measured.use().total() / 8, 0);
    Arena arena({reinterpret_cast<std::byte*>(words[at].data()), words[at].size() * 8});
    return T::carve(arena, arguments...);
  }

  explicit Bench(const Walls& walls, std::initializer_list<Pose2> poses) {
    lasers[0].beams = 180;
    lasers[0].max_range_m = 20.0F;
    config.max_points = 180;
    constexpr std::uint16_t kSide = 512;
    constexpr float kCell_m = 0.05F;
    grid = LiveGrid(give<LiveGrid>(0, kSide, std::size_t{1}), 0, kSide, kCell_m);
    matcher = ScanMatcher(config, give<ScanMatcher>(1, config));
    const ScanMemoryConfig memory{40, 180};
    scans = ScanMemory(memory, give<ScanMemory>(2, memory), {lasers, kMaxLasers});
    grid.reset({});
    for (const Pose2& pose : poses) {
      stage(walls, pose);
      grid.add(scans, scans.take_staged(), pose, grid.grid().window());
    }
  }
  void stage(const Walls& walls, const Pose2& pose) {
    const std::vector<float> ranges = measure(walls, pose, lasers[0]);
    scans.stage({0, span(ranges), {}, 0});
    (void)matcher.set_scan(scans.ranges(scans.end()), scans.directions(scans.end()), {}, grid.cell_m());
  }
};

/// All round from three places.
Bench whole_room() {
  return Bench(room(), {{-1.0, 0.0, 0.0},
                        {-1.0, 0.0, 2.1},
                        {-1.0, 0.0, -2.1},
                        {-0.5, 0.3, 0.5},
                        {-0.5, 0.3, 2.6},
                        {-0.5, 0.3, -1.6},
                        {0.0, 1.0, 1.0},
                        {0.0, 1.0, 3.1},
                        {0.0, 1.0, -1.1}});
}

}  // namespace

TEST_CASE("lost is said after as many contradicting scans in a row as are configured, and not before") {
  for (const std::uint8_t wanted : std::initializer_list<std::uint8_t>{1, 2, 4, 9}) {
    TrackMonitorConfig config;
    config.lost_scans = wanted;
    TrackMonitor monitor(config);
    for (int round = 0; round < 3; ++round) {
      CHECK(monitor.judge(true, kHome) == TrackState::sure);
      for (int i = 1; i < wanted; ++i) {
        CHECK(monitor.judge(i % 2 == 0, kElsewhere) == TrackState::doubted);
      }
      CHECK(monitor.judge(false, kElsewhere) == TrackState::lost);
    }
  }
}

TEST_CASE("a scan that agrees ends the doubt; new space alone neither raises nor ends one") {
  TrackMonitor monitor((TrackMonitorConfig()));
  for (int i = 0; i < 20; ++i) {
    CHECK(monitor.judge(false, kNewRoom) == TrackState::sure);
  }
  for (int i = 0; i < 20; ++i) {  // a crowd that comes and goes
    CHECK(monitor.judge(true, kElsewhere) == TrackState::doubted);
    CHECK(monitor.judge(true, kElsewhere) == TrackState::doubted);
    CHECK(monitor.judge(true, kHome) == TrackState::sure);
  }
  CHECK(monitor.judge(false, kElsewhere) == TrackState::doubted);
  // A match by half of the beams, or new space, may be chance at a place where the robot is not.
  CHECK(monitor.judge(true, agreement(36, 2, 0)) == TrackState::doubted);
  CHECK(monitor.judge(false, kNewRoom) == TrackState::doubted);
  CHECK(monitor.judge(false, kNewRoom) == TrackState::lost);
  CHECK(monitor.judge(false, kNewRoom) == TrackState::sure);  // the map begins afresh
  CHECK(monitor.judge(false, kElsewhere) == TrackState::doubted);
  monitor.reset();
  CHECK(monitor.judge(false, kNewRoom) == TrackState::sure);
}

TEST_CASE("what contradicts: shares of what the map knows, beams through walls twice, few beams never") {
  const TrackMonitor monitor((TrackMonitorConfig()));  // 0.3 of the known ones, 0.12 of all
  CHECK_FALSE(monitor.contradicts(agreement(0, 0, 0)));
  CHECK(monitor.contradicts(agreement(34, 16, 0)));  // of 50
  CHECK_FALSE(monitor.contradicts(agreement(36, 14, 0)));
  CHECK(monitor.contradicts(agreement(42, 0, 8)));  // 2 x 8 of 50
  CHECK_FALSE(monitor.contradicts(agreement(43, 0, 7)));
  CHECK_FALSE(monitor.contradicts(agreement(0, 7, 0)));  // less than 0.12 of 60
  CHECK(monitor.contradicts(agreement(0, 8, 0)));
  CHECK_FALSE(monitor.contradicts({11, 0, 5, 6}));
  CHECK(monitor.contradicts({12, 0, 6, 6}));
  CHECK(monitor.suspects(agreement(45, 0, 5)));  // a tenth went through walls
  CHECK_FALSE(monitor.suspects(agreement(46, 0, 5)));
  CHECK_FALSE(monitor.suspects(agreement(45, 5, 0)));  // somebody stands there …
  CHECK_FALSE(monitor.suspects(agreement(36, 14, 0)));
  CHECK(monitor.suspects(agreement(34, 16, 0)));  // … but so many people?
  TrackMonitorConfig off;
  off.lost_scans = 0;
  TrackMonitor never(off);
  for (int i = 0; i < 50; ++i) {
    CHECK(never.judge(false, kElsewhere) == TrackState::sure);
  }
  CHECK_FALSE(never.suspects(kElsewhere));
}

TEST_CASE("a scan at its place agrees; turned round, it contradicts; nothing speaks for or against in an empty map") {
  Bench b = whole_room();
  const Pose2 here{-0.7, 0.4, 0.9};
  b.stage(room(), here);
  const MapAgreement at_home = b.matcher.compare(b.grid, here);
  CHECK(at_home.beams >= 45);
  CHECK(at_home.agreeing >= at_home.beams * 9 / 10);
  CHECK(at_home.conflicts() <= at_home.beams / 20);
  const TrackMonitor monitor((TrackMonitorConfig()));
  CHECK(monitor.contradicts(b.matcher.compare(b.grid, {here.x, here.y, here.theta + kPi})));
  CHECK(monitor.contradicts(b.matcher.compare(b.grid, {here.x + 1.5, here.y - 1.0, here.theta})));
  Bench empty(room(), {});
  empty.stage(room(), here);
  const MapAgreement unknown = empty.matcher.compare(empty.grid, here);
  CHECK(unknown.beams == at_home.beams);
  CHECK(unknown.agreeing == 0);
  CHECK(unknown.conflicts() == 0);
}

TEST_CASE("a wall that is gone is gone through; one that is new ends beams in free space; a door opens on new space") {
  Walls hall = room();
  const Walls door{{{-2.0, 4.0}, {-2.0, -4.0}}};  // shuts the western third off
  Walls shut = hall;
  shut.insert(shut.end(), door.begin(), door.end());
  Bench closed(shut, {{0.0, 0.0, 3.0}, {0.5, 0.4, 2.8}, {0.3, -0.5, -2.8}, {0.0, 0.6, 2.9}});
  closed.stage(hall, {0.2, 0.1, 3.1});
  const MapAgreement opened = closed.matcher.compare(closed.grid, {0.2, 0.1, 3.1});
  CHECK(opened.through > opened.beams / 4);
  CHECK(opened.short_of <= opened.beams / 20);

  Bench open(hall, {{0.0, 0.0, 3.0}, {0.5, 0.4, 2.8}, {0.3, -0.5, -2.8}, {0.0, 0.6, 2.9}});
  open.stage(shut, {0.2, 0.1, 3.1});
  const MapAgreement closing = open.matcher.compare(open.grid, {0.2, 0.1, 3.1});
  CHECK(closing.short_of > closing.beams / 4);
  CHECK(closing.through == 0);

  // From a dead end with one scan's view to a pose from which half of the beams end where nothing was observed.
  Bench narrow(hall, {{-5.0, -3.0, kPi}, {-5.1, -3.0, kPi + 0.1}});
  narrow.stage(hall, {-5.0, -3.0, 0.0});
  const MapAgreement fresh = narrow.matcher.compare(narrow.grid, {-5.0, -3.0, 0.0});
  CHECK(fresh.conflicts() <= fresh.beams / 20);
  CHECK(fresh.agreeing < fresh.beams / 2);
}

TEST_CASE("the wider search finds the pose over a metre and 35 degrees off; a scan of another room it leaves") {
  Bench b = whole_room();
  const Pose2 here{-0.7, 0.4, 0.9};
  b.stage(room(), here);
  for (const Pose2& off :
       {Pose2{0.9, 0.6, 0.3}, Pose2{-1.1, 0.2, -0.6}, Pose2{0.3, -1.1, 0.6}, Pose2{0.0, 0.0, 0.65}}) {
    const Pose2 prior{here.x + off.x, here.y + off.y, here.theta + off.theta};
    const Sym3 tight = diagonal(2500.0, 2500.0, 10000.0);
    const MatchResult ordinary = b.matcher.search(b.grid, prior, tight);
    const MatchResult found = b.matcher.recover(b.grid, prior, ordinary);
    CHECK(found.good);
    CHECK(found.recovered);
    CHECK(translation(between(here, found.pose)) < 0.03);
    CHECK(std::fabs(wrap_angle(found.pose.theta - here.theta)) < 0.01);
  }
  // Not better than a match that is right already.
  const MatchResult right = b.matcher.refine(b.grid, here, here, diagonal(2500.0, 2500.0, 10000.0));
  REQUIRE(right.good);
  CHECK_FALSE(b.matcher.recover(b.grid, here, right).good);
  Walls other{
      {{-2.0, -1.0}, {2.0, -1.4}}, {{2.0, -1.4}, {2.3, 1.1}}, {{2.3, 1.1}, {-1.7, 1.6}}, {{-1.7, 1.6}, {-2.0, -1.0}}};
  b.stage(other, {});
  CHECK_FALSE(b.matcher.recover(b.grid, here, {}).good);
}
