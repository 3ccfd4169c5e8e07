// The map collection over fake matchers: which pairs it looks at, what it keeps, and what it finds again after a
// restart. That fakes fit in shows that the spectral method is one of several that could.
#include <doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "mellin/collection/map_collection.hpp"
#include "ramflash/heap_flash.hpp"
#include "tests/store_fixture.hpp"

using namespace mellin;

namespace {

using Pair = std::pair<std::uint32_t, std::uint32_t>;
constexpr std::uint16_t kSide = 64;

Pose2 true_pose(SubmapId id) { return {3.0 * std::cos(0.5 * id), 3.0 * std::sin(0.5 * id), 0.1 * id}; }

PlaceHypothesis place(const Pose2& a_T_b, float agreement) {
  PlaceHypothesis p;
  p.a_T_b = a_T_b;
  p.covariance = diagonal(1e-4, 1e-4, 1e-6);
  p.agreement = agreement;
  p.overlap = 0.6F;
  p.peak = 0.5F;
  return p;
}

/// Compares by a table instead of pictures; a digest is four bytes of the submap's mark.
class FakeDigests final : public DigestMatcher {
 public:
  std::function<float(std::uint32_t, std::uint32_t)> agreement = [](std::uint32_t, std::uint32_t) { return 0.0F; };
  std::function<CompareEnd(std::uint32_t, std::uint32_t)> end = [](std::uint32_t, std::uint32_t) {
    return CompareEnd::compared;
  };
  std::vector<Pair> compared;
  std::vector<Pair> thorough_ones;
  std::vector<std::uint8_t> digests = std::vector<std::uint8_t>(4 * 256);
  int restored = 0;
  bool holds_all = true;

  Status begin_describe(std::uint32_t index, const GridView& grid) override {
    forget_others(index);
    for (std::size_t i = 0; i < 4; ++i) {
      digests[4 * index + i] = static_cast<std::uint8_t>(grid.cells[0] + i);
    }
    described_ = index;
    return start();
  }
  Status begin_restore(std::uint32_t index, Span<const std::uint8_t> digest) override {
    if (digest.size() != 4) {
      return Status::invalid_argument;
    }
    forget_others(described_);
    std::copy(digest.begin(), digest.end(), digests.begin() + 4 * index);
    ++restored;
    return start();
  }
  Status begin_compare(std::uint32_t a, std::uint32_t b, bool thorough) override {
    compared.emplace_back(a, b);
    if (thorough) {
      thorough_ones.emplace_back(a, b);
    }
    end_ = end(a, b);
    for (const std::uint32_t index : {a, b}) {
      for (std::size_t i = 0; i < 4; ++i) {
        CHECK(digests[4 * index + i] == index + i);  // both are there, and they are the right ones
      }
    }
    hypotheses_.clear();
    if (agreement(a, b) > 0.0F) {
      (void)hypotheses_.push(place(between(true_pose(a), true_pose(b)), agreement(a, b)));
    }
    return start();
  }
  bool step() override { return --steps_ == 0; }
  const PlaceHypotheses& hypotheses() const override { return hypotheses_; }
  CompareEnd compare_end() const override { return end_; }
  Span<const std::uint8_t> digest_bytes(std::uint32_t index) const override { return {digests.data() + 4 * index, 4}; }
  bool holds_digests() const override { return holds_all; }

 private:
  void forget_others(std::uint32_t kept) {
    for (std::uint32_t index = 0; !holds_all && index < 256; ++index) {
      if (index != kept) {
        std::fill_n(digests.begin() + 4 * index, 4, std::uint8_t{0xEE});
      }
    }
  }
  Status start() {
    steps_ = 3;
    return Status::ok;
  }
  std::uint32_t described_ = 0;
  CompareEnd end_ = CompareEnd::compared;
  int steps_ = 0;
  PlaceHypotheses hypotheses_;
};

/// Knows submaps by the mark in their first cell.
class FakeGrids final : public GridMatcher {
 public:
  std::function<float(std::uint32_t, std::uint32_t)> agreement = [](std::uint32_t, std::uint32_t) { return 0.9F; };
  std::vector<Pair> registered;

  Status set_query(const GridView& b) override {
    query_ = b.cells[0];
    return Status::ok;
  }
  Status begin(const GridView& a) override {
    registered.emplace_back(a.cells[0], query_);
    hypotheses_.clear();
    (void)hypotheses_.push(place(between(true_pose(a.cells[0]), true_pose(query_)), agreement(a.cells[0], query_)));
    steps_ = 2;
    return Status::ok;
  }
  bool step() override { return --steps_ == 0; }
  const PlaceHypotheses& hypotheses() const override { return hypotheses_; }

 private:
  std::uint8_t query_ = 0;
  int steps_ = 0;
  PlaceHypotheses hypotheses_;
};

struct Bench {
  FakeDigests digests;
  FakeGrids grids;
  CollectionConfig config;
  std::unique_ptr<test::TestStore> store;
  std::vector<std::uint64_t> words;
  MapCollection map;
  std::vector<PairEvent> events;

  /// Mounts what the flash holds, or formats it.
  explicit Bench(const mellin_flash& flash, CollectionConfig wanted = {}, std::uint16_t slots = 2,
                 bool hold_digests = true)
      : config(wanted) {
    digests.holds_all = hold_digests;
    config.max_submaps = 40;
    config.max_sessions = 6;
    config.digest_bytes = 4;
    StoreConfig store_config = test::small_config(kSide);
    store_config.max_submaps = 40;
    store_config.max_blobs = 300;
    store_config.grid_slots = slots;
    store = std::make_unique<test::TestStore>(store_config, flash);
    REQUIRE(store->init_status == Status::ok);
    if (store->store.keeps_data()) {
      const Status status = store->store.mount();
      REQUIRE((status == Status::not_found ? store->store.format() : status) == Status::ok);
    }
    MeasureArena measured;
    (void)MapCollection::carve(measured, config);
    words.resize(measured.use().total() / 8);
    Arena arena({reinterpret_cast<std::byte*>(words.data()), words.size() * 8});
    REQUIRE(map.init(config, MapCollection::carve(arena, config), digests, grids, store->store, {}, Log()) ==
            Status::ok);
    map.observe(
        {this, [](void* context, const PairEvent& event) { static_cast<Bench*>(context)->events.push_back(event); }});
    drain();
  }
  void drain() {
    for (int i = 0; i < 1000000 && !map.idle(); ++i) {
      map.step();
    }
    REQUIRE(map.idle());
  }
  void session(std::uint8_t number) {
    SessionId id;
    id.bytes[0] = number;
    REQUIRE(map.begin_session(id) == Status::ok);
  }
  /// A submap at its true pose, off by `error`; scans from `first_scan` on.
  void insert(std::uint32_t first_scan, const Pose2& error = {}, std::uint16_t stretch = 0) {
    Result<SlotHandle> slot = store->store.slots().acquire_free();
    REQUIRE(slot.ok());
    for (std::uint8_t& cell : store->store.slots().cells(slot.value())) {
      cell = 0;
    }
    store->store.slots().cells(slot.value())[0] = static_cast<std::uint8_t>(map.size());
    SubmapHeader header;
    header.session_T_submap = compose(error, true_pose(map.size()));
    header.first_scan = first_scan;
    header.scan_count = 40;
    REQUIRE(map.insert(header, slot.value(), SubmapStep{}, stretch).ok());
    CHECK(slot.value().empty());  // taken over
    drain();
    CHECK(store->store.slots().pinned() == 0);
  }
  std::size_t edges(EdgeKind kind) const {
    std::size_t count = 0;
    for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
      count += map.graph().edge(id).kind == kind && map.graph().edge(id).enabled ? 1U : 0U;
    }
    return count;
  }
};

bool shares(std::uint32_t a, std::uint32_t b) { return b - a < 4; }  // 40 scans each, 10 of them new

}  // namespace

TEST_CASE("each pair that shares no scans is screened once, as it comes, and no other") {
  port::HeapFlash flash({4096, 256, 256});
  Bench bench(flash.flash());
  bench.session(1);
  for (std::uint32_t i = 0; i < 12; ++i) {
    bench.insert(10 * i);
  }
  bench.session(2);
  bench.insert(0);  // the same numbers, but of another session
  std::vector<Pair> expected;
  for (std::uint32_t b = 0; b < 13; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) {
      if (b == 12 || !shares(a, b)) {
        expected.emplace_back(a, b);
      }
    }
  }
  CHECK(bench.digests.compared == expected);
  CHECK(bench.map.statistics().pairs_possible == expected.size());
  CHECK(bench.map.statistics().pairs_screened == expected.size());
  CHECK(bench.grids.registered.empty());
  REQUIRE(bench.events.size() == expected.size());
  for (const PairEvent& event : bench.events) {
    CHECK(event.stage == PairEvent::Stage::screened);
    CHECK_FALSE(event.accepted);
    CHECK(event.between_sessions == (event.b == 12));
  }
  CHECK(bench.map.graph().component_count() == 2);
  CHECK(bench.map.component(12) == 12);
  CHECK(bench.edges(EdgeKind::odometry) == 11);
}

void check_candidates(std::uint8_t nearby) {
  CAPTURE(nearby);
  port::HeapFlash flash({4096, 256, 256});
  CollectionConfig config;
  config.candidates = 3;
  config.nearby_candidates = nearby;
  config.nearby_m = 4.0F;
  config.candidate_agreement = 0.3F;
  Bench bench(flash.flash(), config);
  // Like random numbers, but a function of the pair.
  bench.digests.agreement = [](std::uint32_t a, std::uint32_t b) {
    return static_cast<float>((a * 37 + b * 101 + a * b * 13) % 97) / 97.0F;
  };
  bench.grids.agreement = [](std::uint32_t, std::uint32_t) { return 0.1F; };  // never evidence
  bench.session(1);
  for (std::uint32_t i = 0; i < 30; ++i) {
    bench.insert(10 * i);
  }
  std::vector<Pair> expected;
  int otherwise = 0;  // than without the graph
  for (std::uint32_t b = 0; b < 30; ++b) {
    std::vector<std::uint32_t> left;
    for (std::uint32_t a = 0; a < b && !shares(a, b); ++a) {
      if (bench.digests.agreement(a, b) >= 0.3F) {
        left.push_back(a);
      }
    }
    for (int k = 0; k < 3 && !left.empty(); ++k) {
      const auto apart = [&](std::uint32_t a) { return translation(between(true_pose(a), true_pose(b))); };
      std::uint32_t best = *std::max_element(left.begin(), left.end(), [&](std::uint32_t x, std::uint32_t y) {
        return bench.digests.agreement(x, b) < bench.digests.agreement(y, b);
      });
      const std::uint32_t nearest = *std::min_element(
          left.begin(), left.end(), [&](std::uint32_t x, std::uint32_t y) { return apart(x) < apart(y); });
      if (k < nearby && apart(nearest) < 4.0) {
        otherwise += nearest != best ? 1 : 0;
        best = nearest;
      }
      expected.emplace_back(best, b);
      std::erase_if(left, [&](std::uint32_t a) { return a + 3 >= best && a <= best + 3; });
    }
  }
  REQUIRE(expected.size() > 40);
  CHECK((otherwise > 10) == (nearby > 0));
  CHECK(bench.grids.registered == expected);  // from flash, through two slots
  CHECK(bench.map.statistics().pairs_registered == expected.size());
  CHECK(bench.map.statistics().fetches_failed == 0);
  CHECK(bench.edges(EdgeKind::loop) == 0);
  for (const PairEvent& event : bench.events) {
    if (event.stage == PairEvent::Stage::registered) {
      CHECK_FALSE(event.accepted);
      CHECK(event.reason == LinkReason::weak);
    }
  }
}

TEST_CASE("of the pairs that look alike those near by the graph, then the best are registered, one a place") {
  for (const std::uint8_t nearby : std::initializer_list<std::uint8_t>{0, 1, 2}) {
    check_candidates(nearby);
  }
}

TEST_CASE(
    "pairs that screening drops are counted, and no candidates; those near by the graph it shall look at in full") {
  port::HeapFlash flash({4096, 256, 256});
  CollectionConfig config;
  config.nearby_m = 2.0F;
  Bench bench(flash.flash(), config);
  bench.digests.agreement = [](std::uint32_t, std::uint32_t) { return 0.9F; };
  bench.digests.end = [](std::uint32_t a, std::uint32_t) { return static_cast<CompareEnd>(a % 4); };
  bench.grids.agreement = [](std::uint32_t, std::uint32_t) { return 0.0F; };  // no edges: the graph stays as it is
  bench.session(1);
  constexpr std::uint32_t kSubmaps = 16;
  for (std::uint32_t i = 0; i < kSubmaps; ++i) {
    bench.insert(10 * i);
  }
  std::uint64_t ends[4] = {};
  std::vector<Pair> near;
  for (std::uint32_t b = 0; b < kSubmaps; ++b) {
    for (std::uint32_t a = 0; a < b; ++a) {
      if (!shares(a, b)) {
        ++ends[a % 4];
        if (translation(between(true_pose(a), true_pose(b))) < 2.0) {
          near.emplace_back(a, b);
        }
      }
    }
  }
  REQUIRE(near.size() > 1);
  CHECK(bench.digests.thorough_ones == near);
  const CollectionStatistics& statistics = bench.map.statistics();
  CHECK(statistics.pairs_dropped_coarse == ends[1]);
  CHECK(statistics.pairs_dropped_rotation == ends[2]);
  CHECK(statistics.pairs_cut_short == ends[3]);
  const LinkReason reasons[] = {LinkReason::none, LinkReason::coarse_mismatch, LinkReason::no_rotation,
                                LinkReason::none};
  for (const PairEvent& event : bench.events) {
    if (event.stage == PairEvent::Stage::screened) {
      CHECK(event.reason == reasons[event.a % 4]);
      CHECK(event.accepted == (event.reason == LinkReason::none));
    } else {
      CHECK(reasons[event.a % 4] == LinkReason::none);
    }
  }
}

TEST_CASE("loops that the matchers find become edges and mend the poses") {
  port::HeapFlash flash({4096, 256, 256});
  Bench bench(flash.flash());
  bench.digests.agreement = [](std::uint32_t, std::uint32_t) { return 0.9F; };
  bench.session(1);
  const Pose2 start = true_pose(0);
  for (std::uint32_t i = 0; i < 16; ++i) {
    bench.insert(10 * i, {0.03 * i, -0.02 * i, 0.004 * i});  // odometry that drifts
  }
  CHECK(bench.edges(EdgeKind::loop) > 5);
  CHECK(bench.map.statistics().pairs_accepted == bench.edges(EdgeKind::loop));
  CHECK(bench.map.statistics().optimisations > 0);
  const auto off = [&](SubmapId id, const Pose2& pose) {
    return translation(between(between(start, true_pose(id)), between(bench.map.map_T_submap(0), pose)));
  };
  const double before = off(15, bench.map.header(15).session_T_submap);
  const double after = off(15, bench.map.map_T_submap(15));
  CHECK(before > 0.3);
  CHECK(after < 0.35 * before);
  // Switched off, no pair is looked at.
  CollectionConfig off_config;
  off_config.close_loops = false;
  port::HeapFlash other({4096, 256, 256});
  Bench none(other.flash(), off_config);
  none.session(1);
  for (std::uint32_t i = 0; i < 8; ++i) {
    none.insert(40 * i);
  }
  CHECK(none.digests.compared.empty());
  CHECK(none.map.statistics().stored == 8);
}

TEST_CASE("without flash only what is still in RAM can be registered, the rest is counted") {
  Bench bench({}, {}, 3);
  bench.digests.agreement = [](std::uint32_t, std::uint32_t) { return 0.9F; };
  bench.grids.agreement = [](std::uint32_t, std::uint32_t) { return 0.0F; };
  bench.session(1);
  for (std::uint32_t i = 0; i < 8; ++i) {
    bench.insert(40 * i);
  }
  // Of the b submaps before submap b, four at most are candidates.
  CHECK(bench.map.statistics().fetches_failed > 0);
  CHECK(!bench.grids.registered.empty());
  CHECK(bench.grids.registered.size() + bench.map.statistics().fetches_failed == 1 + 2 + 3 + 4 * 4);
}

TEST_CASE("a restart finds submaps, digests, sessions and edges again, also after a crash without a flush") {
  port::HeapFlash flash({4096, 256, 256});
  std::vector<std::uint8_t> digests;
  std::vector<Pose2> poses;
  {
    Bench first(flash.flash());
    first.digests.agreement = [](std::uint32_t, std::uint32_t) { return 0.9F; };
    first.session(7);
    for (std::uint32_t i = 0; i < 10; ++i) {
      first.insert(10 * i);
    }
    // Loop edges lie between the odometry edges now, and are not in the store: the power goes.
    REQUIRE(first.edges(EdgeKind::loop) > 0);
    digests = first.digests.digests;
  }
  {
    Bench second(flash.flash());
    REQUIRE(second.map.size() == 10);
    CHECK(second.digests.restored == 10);
    CHECK(second.digests.digests == digests);
    CHECK(second.map.graph().component_count() == 1);
    CHECK(second.edges(EdgeKind::odometry) == 9);
    CHECK(second.map.session_count() == 1);
    CHECK(second.map.session(0).bytes[0] == 7);
    CHECK(second.map.newest_of_session() == kNoSubmap);
    CHECK(second.digests.compared.empty());
    second.session(8);
    for (std::uint32_t i = 0; i < 5; ++i) {
      second.insert(10 * i);
    }
    CHECK(second.map.graph().component_count() == 2);
  }  // and again
  {
    Bench third(flash.flash());
    REQUIRE(third.map.size() == 15);
    CHECK(third.map.session_count() == 2);
    CHECK(third.edges(EdgeKind::odometry) == 9 + 4);  // none was overwritten by another
    CHECK(third.map.graph().component_count() == 2);
    CHECK(third.map.component(9) == 0);
    CHECK(third.map.component(14) == 10);
    third.digests.agreement = [](std::uint32_t, std::uint32_t) { return 0.9F; };
    third.session(9);
    for (std::uint32_t i = 0; i < 6; ++i) {
      third.insert(40 * i);
    }
    REQUIRE(third.edges(EdgeKind::merge) > 0);
    third.map.begin_flush();
    third.drain();
    for (SubmapId id = 0; id < third.map.size(); ++id) {
      poses.push_back(third.map.map_T_submap(id));
    }
    // All edges came back, in whatever order.
    Bench fourth(flash.flash());
    REQUIRE(fourth.map.size() == 21);
    for (const EdgeKind kind : {EdgeKind::odometry, EdgeKind::loop, EdgeKind::merge}) {
      CHECK(fourth.edges(kind) == third.edges(kind));
    }
    CHECK(fourth.map.graph().component_count() == third.map.graph().component_count());
    for (SubmapId id = 0; id < 21; ++id) {
      CHECK(fourth.map.map_T_submap(id).x == poses[id].x);
      CHECK(fourth.map.map_T_submap(id).y == poses[id].y);
      CHECK(fourth.map.map_T_submap(id).theta == poses[id].theta);
    }
  }
}

TEST_CASE("stretches of a session are components until a loop links them, and again after a restart") {
  port::HeapFlash flash({4096, 256, 256});
  {
    Bench first(flash.flash());
    first.session(7);
    for (std::uint32_t i = 0; i < 9; ++i) {
      first.insert(40 * i, {}, static_cast<std::uint16_t>(i / 3));
    }
    CHECK(first.edges(EdgeKind::odometry) == 6);
    CHECK(first.map.graph().component_count() == 3);
  }
  {
    Bench second(flash.flash());
    REQUIRE(second.map.size() == 9);
    CHECK(second.map.session_count() == 1);
    CHECK(second.edges(EdgeKind::odometry) == 6);
    CHECK(second.map.graph().component_count() == 3);
    for (SubmapId id = 0; id < 9; ++id) {
      CHECK(second.map.stretch_of(id) == id / 3);
      CHECK(second.map.component(id) == id / 3 * 3);
    }
    second.map.begin_flush();  // writes the records anew
    second.drain();
  }
  {
    // A session's stretches count from 0: those of another one are others.
    Bench third(flash.flash());
    CHECK(third.map.graph().component_count() == 3);
    CHECK(third.map.stretch_of(8) == 2);
    third.session(8);
    third.insert(0, {}, 0);
    third.insert(40, {}, 1);
    CHECK(third.map.graph().component_count() == 5);
  }
  port::HeapFlash other({4096, 256, 256});
  Bench alike(other.flash());
  alike.digests.agreement = [](std::uint32_t, std::uint32_t) { return 0.9F; };
  alike.session(7);
  for (std::uint32_t i = 0; i < 8; ++i) {
    alike.insert(40 * i, {}, static_cast<std::uint16_t>(i / 4));
  }
  CHECK(alike.edges(EdgeKind::odometry) == 6);
  CHECK(alike.edges(EdgeKind::loop) > 0);  // of one session
  CHECK(alike.edges(EdgeKind::merge) == 0);
  CHECK(alike.map.graph().component_count() == 1);
}

TEST_CASE("digests that are not held are read back before they are compared, also after a restart") {
  port::HeapFlash flash({4096, 256, 256});
  CollectionConfig config;
  const auto some_alike = [](std::uint32_t a, std::uint32_t b) { return (a + b) % 3 == 0 ? 0.9F : 0.0F; };
  port::HeapFlash other({4096, 256, 256});
  Bench held(other.flash());
  held.digests.agreement = some_alike;
  held.session(1);
  {
    Bench paged(flash.flash(), config, 2, false);
    paged.digests.agreement = some_alike;
    paged.session(1);
    for (std::uint32_t i = 0; i < 12; ++i) {
      held.insert(10 * i);
      paged.insert(10 * i);
    }
    CHECK(paged.digests.compared == held.digests.compared);
    CHECK(paged.digests.restored == static_cast<int>(held.digests.compared.size()));
    CHECK(paged.grids.registered == held.grids.registered);
    CHECK(paged.edges(EdgeKind::loop) == held.edges(EdgeKind::loop));
    CHECK(paged.edges(EdgeKind::loop) > 0);
    CHECK(paged.map.statistics().digests_missed == 0);
  }
  Bench again(flash.flash(), config, 2, false);
  REQUIRE(again.map.size() == 12);
  CHECK(again.digests.restored == 0);  // not before they are wanted
  again.session(2);
  again.insert(0);
  CHECK(again.digests.compared.size() == 12);
  CHECK(again.map.statistics().digests_missed == 0);
}

TEST_CASE("digests that the flash does not hold are passed over and counted") {
  port::HeapFlash flash({4096, 10, 256});
  Bench bench(flash.flash(), {}, 2, false);
  bench.session(1);
  for (std::uint32_t i = 0; i < 40; ++i) {
    bench.insert(40 * i);
  }
  const CollectionStatistics& statistics = bench.map.statistics();
  REQUIRE(statistics.not_stored > 1);
  CHECK(statistics.pairs_possible == 40 * 39 / 2);
  // Those that were not stored are the last ones: a pair is missed where the older of the two is among them.
  CHECK(statistics.digests_missed == statistics.not_stored * (statistics.not_stored - 1) / 2);
  CHECK(statistics.pairs_screened + statistics.digests_missed == statistics.pairs_possible);
}

TEST_CASE("a full flash loses what does not fit, says so, and the map goes on in RAM") {
  port::HeapFlash flash({4096, 10, 256});
  Bench bench(flash.flash());
  bench.session(1);
  for (std::uint32_t i = 0; i < 40; ++i) {
    bench.insert(10 * i);
  }
  CHECK(bench.map.size() == 40);
  CHECK(bench.map.statistics().stored > 0);
  CHECK(bench.map.statistics().not_stored > 0);
  CHECK(bench.map.statistics().stored + bench.map.statistics().not_stored == 40);
  Bench again(flash.flash());
  CHECK(again.map.size() == bench.map.statistics().stored);
  // Full, busy, and without a session.
  Result<SlotHandle> slot = bench.store->store.slots().acquire_free();
  REQUIRE(slot.ok());
  CHECK(bench.map.insert({}, slot.value(), {}).status() == Status::full);
  CHECK_FALSE(slot.value().empty());  // still the caller's
}
