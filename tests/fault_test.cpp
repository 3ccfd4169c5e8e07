// Faults of sensor, odometry, clock and flash, as the whole system meets them: each gets a Status and a count, the live
// map goes on, and the store keeps what it had.
#include <doctest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <vector>

#include "mellin/core/random.hpp"
#include "mellin/slam.hpp"
#include "ramflash/heap_flash.hpp"
#include "tests/support/machine.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
#if defined(__SANITIZE_ADDRESS__)
constexpr int kStride = 5;  // of the places at which a fault is put
#else
constexpr int kStride = 1;
#endif

/// The map's cells are 0.1 m: within one of the truth by itself, within two while it is being disturbed.
constexpr double kCell_m = 0.1;

enum class Op { read, program, erase, sync };

/// Flash in memory whose calls fail as they are told to.
class FaultyFlash {
 public:
  enum class Mode { none, once, from, share, garbage };

  mellin_flash flash() {
    mellin_flash flash = inner_flash_;
    flash.context = this;
    flash.read = [](void* c, std::uint32_t a, void* b, std::uint32_t n) { return self(c).read(a, b, n); };
    flash.program = [](void* c, std::uint32_t a, const void* b, std::uint32_t n) {
      FaultyFlash& f = self(c);
      return f.strikes(Op::program) ? -5 : f.inner_flash_.program(f.inner_flash_.context, a, b, n);
    };
    flash.erase = [](void* c, std::uint32_t block) {
      FaultyFlash& f = self(c);
      return f.strikes(Op::erase) ? -5 : f.inner_flash_.erase(f.inner_flash_.context, block);
    };
    flash.sync = [](void* c) {
      FaultyFlash& f = self(c);
      return f.strikes(Op::sync) ? -5 : f.inner_flash_.sync(f.inner_flash_.context);
    };
    return flash;
  }
  mellin_port port() {
    mellin_port port = {};
    port.flash = flash();
    return port;
  }

  /// The n-th call of this kind from now fails: it alone, it and all after it, or one call in n at random.
  void fail(Op op, Mode mode, std::uint64_t n) {
    op_ = op;
    mode_ = mode;
    n_ = n;
    calls_ = 0;
    struck_ = 0;
  }
  void recover() { mode_ = Mode::none; }
  std::uint64_t struck() const { return struck_; }
  std::vector<std::uint8_t>& bytes() { return inner_.bytes(); }

 private:
  static FaultyFlash& self(void* context) { return *static_cast<FaultyFlash*>(context); }

  bool strikes(Op op) {
    if (mode_ == Mode::none || op != op_) {
      return false;
    }
    const std::uint64_t call = calls_++;
    const bool at_random = mode_ == Mode::share || mode_ == Mode::garbage;
    const bool now = at_random ? random_.bits() % n_ == 0 : mode_ == Mode::once ? call == n_ : call >= n_;
    struck_ += now ? 1U : 0U;
    return now;
  }

  int read(std::uint32_t address, void* buffer, std::uint32_t size) {
    const bool struck = strikes(Op::read);
    if (!struck) {
      return inner_flash_.read(inner_flash_.context, address, buffer, size);
    }
    for (std::uint32_t i = 0; i < size; ++i) {
      static_cast<unsigned char*>(buffer)[i] = static_cast<unsigned char>(random_.bits());
    }
    return mode_ == Mode::garbage ? 0 : -5;
  }

  port::HeapFlash inner_{port::FlashGeometry{4096, 512, 256}};
  mellin_flash inner_flash_ = inner_.flash();
  Random random_{1, 1};
  Op op_ = Op::read;
  Mode mode_ = Mode::none;
  std::uint64_t n_ = 0;
  std::uint64_t calls_ = 0;
  std::uint64_t struck_ = 0;
};
using Mode = FaultyFlash::Mode;

std::uint32_t failures(const Slam& slam, Op op) {
  const FlashFailures f = slam.store().statistics().flash_failures;
  const std::uint32_t counts[] = {f.reads, f.programs, f.erases, f.syncs};
  return counts[static_cast<std::size_t>(op)];
}

/// Where the robot is by the truth, in the frame of a session that began at step `first`.
Pose2 truth(int step, int first = 0) { return between(on_circle(first), on_circle(step)); }

double off_truth(const Slam& slam, int step, int first = 0) {
  return translation(between(truth(step, first), slam.pose()));
}

/// A system without flash that has gone a bit of its way, and the scan that would come next.
struct Under {
  Machine machine{small()};
  std::vector<float> good;
  int step = 20;
  Under() {
    REQUIRE(machine.status == Status::ok);
    circle(*machine, 0, step);
    good = measure(room(), on_circle(step), machine->config().lasers[0]);
  }
  Slam& slam() { return *machine; }
  const MapperStatistics& counts() { return machine->mapper().statistics(); }
  Result<ScanOutcome> add(const std::vector<float>& ranges, const Pose2& odometry) {
    return machine->add({step * 100000, span(ranges), odometry, 0});
  }
  /// The robot goes on and knows where it is.
  void goes_on() {
    circle(*machine, step, step + 30);
    CHECK(off_truth(*machine, step + 29) < kCell_m);
    CHECK(machine.memory.intact());
  }
};

/// What the store holds, by CRC of each submap. Each has to be whole.
std::map<SubmapId, std::uint32_t> held(Slam& slam) {
  std::map<SubmapId, std::uint32_t> all;
  for (std::size_t i = 0; i < slam.store().submap_count(); ++i) {
    const SubmapId id = slam.store().submap_id(i);
    const Result<std::uint32_t> crc = slam.store().grid_crc32(id);
    CHECK(crc.ok());
    CHECK(slam.store().header(id).ok());
    Status status = slam.store().begin_fetch(id);
    while (status == Status::ok && !slam.store().is_resident(id)) {
      status = slam.store().step_fetch();
      status = status == Status::busy ? Status::ok : status;
    }
    CHECK(status == Status::ok);
    CHECK(slam.store().step_fetch() != Status::busy);
    all[id] = crc.ok() ? crc.value() : 0;
  }
  return all;
}

bool contains_all(const std::map<SubmapId, std::uint32_t>& have, const std::map<SubmapId, std::uint32_t>& wanted) {
  for (const auto& [id, crc] : wanted) {
    const auto found = have.find(id);
    if (found == have.end() || found->second != crc) {
      return false;
    }
  }
  return true;
}

void flush(Slam& slam) {
  CHECK(slam.begin_flush() == Status::ok);
  drain(slam);
}

}  // namespace

TEST_CASE("ranges that no sensor should give are beams that measured nothing") {
  Under u;
  const float kinds[] = {
      kNaN, kInfinity, -kInfinity, -3.0F, -0.0F, 0.0F, 1e-40F, 1e30F, std::numeric_limits<float>::max()};
  // One beam in three of each kind: the map takes the rest.
  std::uint32_t bad = 0;
  for (const float kind : kinds) {
    CAPTURE(kind);
    std::vector<float> ranges = measure(room(), on_circle(u.step), u.slam().config().lasers[0]);
    for (std::size_t i = 0; i < ranges.size(); i += 3) {
      ranges[i] = kind;
    }
    const Result<ScanOutcome> outcome = u.add(ranges, on_circle(u.step));
    REQUIRE(outcome.ok());
    CHECK(outcome.value().use != ScanUse::odometry);
    CHECK(off_truth(u.slam(), u.step) < 2 * kCell_m);
    bad += std::isnan(kind) || kind < 0.0F ? 1U : 0U;
    CHECK(u.counts().bad_ranges == bad);
    ++u.step;
  }
  CHECK(u.counts().blind == 0);
  // All beams: the robot rides on its odometry, which is exact here.
  for (const float kind : kinds) {
    CAPTURE(kind);
    const Pose2 before = u.slam().pose();
    const std::vector<float> ranges(u.good.size(), kind);
    const Result<ScanOutcome> outcome = u.add(ranges, on_circle(u.step));
    REQUIRE(outcome.ok());
    CHECK(outcome.value().use == ScanUse::odometry);
    const Pose2 ridden = compose(before, between(on_circle(u.step - 1), on_circle(u.step)));
    CHECK(translation(between(ridden, u.slam().pose())) < 1e-9);
    ++u.step;
  }
  CHECK(u.counts().blind == std::size(kinds));
  CHECK(u.counts().bad_ranges == 2 * bad);
  CHECK(u.counts().refused == 0);
  u.goes_on();
}

TEST_CASE("wrong counts and unknown lasers are refused by their reason, and the pose stays") {
  Under u;
  const Pose2 before = u.slam().pose();
  std::vector<float> more = u.good;
  more.resize(5000, 1.0F);
  std::uint32_t wrong = 0;
  for (const std::size_t size : {0U, 1U, 89U, 91U, 5000U}) {
    CAPTURE(size);
    CHECK(u.slam().add({0, span(more).first(size), on_circle(u.step), 0}).status() == Status::bad_data);
    CHECK(u.counts().wrong_count == ++wrong);
  }
  std::uint32_t unknown = 0;
  for (const std::uint8_t laser : std::initializer_list<std::uint8_t>{1, 3, 4, 255}) {
    CAPTURE(laser);
    CHECK(u.slam().add({0, span(u.good), on_circle(u.step), laser}).status() == Status::bad_data);
    CHECK(u.counts().unknown_laser == ++unknown);
  }
  CHECK(u.counts().refused == wrong + unknown);
  CHECK(u.slam().pose().x == before.x);
  CHECK(u.slam().pose().theta == before.theta);
  u.goes_on();
}

TEST_CASE("odometry that is no number or out of reach is refused; one that jumps is ridden out") {
  Under u;
  const Pose2 before = u.slam().pose();
  std::uint32_t refused = 0;
  for (const double bad : {static_cast<double>(NAN), static_cast<double>(INFINITY), -1.0 / 0.0, 1e30, -1e300, 1.1e6}) {
    for (const Pose2& odometry : {Pose2{bad, 0.0, 0.0}, Pose2{0.0, bad, 0.0}, Pose2{0.0, 0.0, bad}}) {
      CHECK(u.add(u.good, odometry).status() == Status::bad_data);
      CHECK(u.counts().bad_odometry == ++refused);
    }
  }
  CHECK(u.counts().refused == refused);
  CHECK(u.slam().pose().x == before.x);
  // Jumps of a cell to and fro are matched away; then one of metres and back again.
  for (int i = 0; i < 10; ++i, ++u.step) {
    Pose2 odometry = on_circle(u.step);
    odometry.x += i % 2 == 0 ? 0.1 : -0.1;
    const std::vector<float> ranges = measure(room(), on_circle(u.step), u.slam().config().lasers[0]);
    REQUIRE(u.add(ranges, odometry).ok());
    CHECK(off_truth(u.slam(), u.step) < 2 * kCell_m);
  }
  Pose2 far = on_circle(u.step);
  far.x += 5.0;
  REQUIRE(u.add(std::vector<float>(90, kNaN), far).ok());
  REQUIRE(u.add(measure(room(), on_circle(u.step), u.slam().config().lasers[0]), on_circle(u.step)).ok());
  ++u.step;
  u.goes_on();
  // Jumps within its own reach that lead the pose out of the mapper's: refused, and the pose stays.
  drain(u.slam());
  REQUIRE(u.slam().new_session({9e5, 0.0, 0.0}) == Status::ok);
  REQUIRE(u.add(u.good, {0.0, 0.0, 0.0}).ok());
  CHECK(u.add(u.good, {5e5, 0.0, 0.0}).status() == Status::bad_data);
  CHECK(u.counts().beyond_reach == 1);
  CHECK(u.counts().refused == refused + 1);
  CHECK(u.slam().pose().x == 9e5);
  for (int i = 0; i < 2000; ++i) {
    const double side = i % 2 == 0 ? 9e5 : -9e5;
    (void)u.add(u.good, {side, side, i % 2 == 0 ? 0.0 : kPi}).ok();
    CHECK(ParticleMapper::within_reach(u.slam().pose()));
  }
  CHECK(u.counts().refused == refused + u.counts().beyond_reach);
  drain(u.slam());
  REQUIRE(u.slam().new_session() == Status::ok);
  circle(u.slam(), 0, 30);
  CHECK(off_truth(u.slam(), 29) < kCell_m);
}

TEST_CASE("stamps that jump or stand still are counted and change nothing") {
  constexpr std::int64_t kYear = 365LL * 86400 * 1000000;
  const std::int64_t stamps[] = {0,      100000, 200000,    200000,    100000,    -5,        10 * kYear,
                                 300000, -kYear, INT64_MAX, INT64_MIN, INT64_MIN, INT64_MAX, 0};
  Machine odd(small());
  Machine even(small());
  REQUIRE(odd.status == Status::ok);
  REQUIRE(even.status == Status::ok);
  for (int i = 0; i < 42; ++i) {
    const Pose2 pose = on_circle(i);
    REQUIRE(add_at(*odd, pose, stamps[static_cast<std::size_t>(i) % std::size(stamps)]).ok());
    REQUIRE(add_at(*even, pose, 100000 * i).ok());
    drain(*odd);
    drain(*even);
    CHECK(odd->pose().x == even->pose().x);
    CHECK(odd->pose().theta == even->pose().theta);
  }
  // In one round: back five times; the same again twice, and once more where the rounds meet.
  CHECK(odd->mapper().statistics().stamps_back == 3 * 6);
  CHECK(odd->mapper().statistics().stamps_repeated == 3 * 2 + 2);
  CHECK(even->mapper().statistics().stamps_back == 0);
  CHECK(even->mapper().statistics().stamps_repeated == 0);
  CHECK(odd->collection().size() == even->collection().size());
  CHECK(odd->mapper().statistics().refused == 0);
}

TEST_CASE("a clock of the port that runs back disturbs nothing but times") {
  std::uint64_t now = UINT64_MAX;
  mellin_port port = {};
  port.clock = {&now, [](void* context) { return --*static_cast<std::uint64_t*>(context); }};
  Machine machine(small(), port);
  REQUIRE(machine.status == Status::ok);
  circle(*machine, 0, 60);
  CHECK(off_truth(*machine, 59) < kCell_m);
  CHECK(machine->collection().size() > 0);
  CHECK(machine->statistics().clock_back > 60);
  CHECK(machine->statistics().mapping_us == 0);
  CHECK(machine->statistics().rendering_us == 0);
  CHECK(machine->collection().statistics().screening_us + machine->collection().statistics().store_us == 0);
}

TEST_CASE("flash that fails while the robot maps: counted, the map goes on, and what was stored stays") {
  struct Case {
    Op op;
    Mode mode;
    std::uint64_t n;
  };
  std::vector<Case> cases;
  for (const Op op : {Op::program, Op::erase, Op::sync, Op::read}) {
    for (std::uint64_t n : {0U, 1U, 2U, 3U, 5U, 8U, 13U, 21U, 34U}) {
      cases.push_back({op, Mode::once, n});
      cases.push_back({op, Mode::from, n});
    }
    cases.push_back({op, Mode::share, 3});
    cases.push_back({op, Mode::share, 10});
  }
  cases.push_back({Op::read, Mode::garbage, 3});
  cases.push_back({Op::read, Mode::garbage, 10});
  int struck = 0;
  int with_gaps = 0;
  for (std::size_t i = 0; i < cases.size(); i += kStride) {
    const Case& fault = cases[i];
    CAPTURE(static_cast<int>(fault.op));
    CAPTURE(static_cast<int>(fault.mode));
    CAPTURE(fault.n);
    FaultyFlash flash;
    std::map<SubmapId, std::uint32_t> before;
    std::map<SubmapId, std::uint32_t> last;
    {
      Machine machine(small(), flash.port());
      REQUIRE(machine.status == Status::ok);
      circle(*machine, 0, 40);
      flush(*machine);
      before = held(*machine);
      REQUIRE(before.size() >= 2);
      flash.fail(fault.op, fault.mode, fault.n);
      circle(*machine, 40, 80);
      flush(*machine);
      CHECK(off_truth(*machine, 79) < kCell_m);
      const bool hit = flash.struck() > 0;
      struck += hit ? 1 : 0;
      const CollectionStatistics& counts = machine->collection().statistics();
      if (fault.mode != Mode::garbage) {
        CHECK(failures(*machine, fault.op) == flash.struck());
      }
      if (fault.mode == Mode::from && hit && fault.op != Op::read) {
        CHECK(counts.not_stored + counts.flushes_failed > 0);
        CHECK(machine->store().statistics().groups_failed > 0);
        CHECK(counts.last_store_failure != Status::ok);
      }
      flash.recover();
      circle(*machine, 80, 110);
      flush(*machine);
      CHECK(off_truth(*machine, 109) < kCell_m);
      last = held(*machine);
      CHECK(contains_all(last, before));
      CHECK(last.size() > before.size());  // it stores again
      // Where the device fails in the commit itself, what was reported as failed may be there.
      const std::uint32_t uncertain = machine->store().statistics().groups_failed;
      CHECK(counts.stored <= last.size());
      CHECK(last.size() <= counts.stored + uncertain);
      CHECK(counts.stored + counts.not_stored == machine->collection().size());
      CHECK(machine.memory.intact());
    }
    Machine after(small(), flash.port());
    REQUIRE(after.status == Status::ok);
    const std::map<SubmapId, std::uint32_t> found = held(*after);
    CHECK(contains_all(found, last));
    const SubmapId end = found.rbegin()->first + 1;
    CHECK(after->collection().size() == end);
    CHECK(after->collection().statistics().submaps_missing == end - found.size());
    CHECK(after->collection().statistics().records_damaged == 0);
    with_gaps += end > found.size() ? 1 : 0;
    // One session is one component, across what is missing; and it lies as it was driven.
    const SubmapId first = found.begin()->first;
    for (const auto& [id, crc] : found) {
      CHECK(after->collection().component(id) == after->collection().component(first));
      const Pose2 driven =
          between(after->collection().header(first).session_T_submap, after->collection().header(id).session_T_submap);
      const Pose2 mapped = between(after->collection().map_T_submap(first), after->collection().map_T_submap(id));
      CHECK(translation(between(driven, mapped)) < kCell_m);
    }
    circle(*after, 0, 30);
    flush(*after);
    CHECK(after->collection().size() > end);
    CHECK(contains_all(held(*after), found));
  }
  CHECK(struck > static_cast<int>(cases.size()) / kStride / 2);
  CHECK(with_gaps > 3);
}

TEST_CASE("flash that cannot be read at the start: refused, left as it is, and whole afterwards") {
  FaultyFlash flash;
  std::map<SubmapId, std::uint32_t> stored;
  {
    Machine machine(small(), flash.port());
    REQUIRE(machine.status == Status::ok);
    circle(*machine, 0, 60);
    flush(*machine);
    stored = held(*machine);
  }
  REQUIRE(stored.size() > 2);
  const std::vector<std::uint8_t> image = flash.bytes();
  int refused = 0;
  for (std::uint64_t n = 0; n < 4000; n += n < 20 ? 1 : 37 * kStride) {
    CAPTURE(n);
    flash.fail(Op::read, n % 2 == 0 ? Mode::once : Mode::from, n);
    Machine machine(small(), flash.port());
    CHECK(machine.status == (flash.struck() > 0 ? Status::device_error : Status::ok));
    refused += machine.status == Status::ok ? 0 : 1;
    flash.recover();
    CHECK(flash.bytes() == image);
  }
  CHECK(refused > 20);
  Machine machine(small(), flash.port());
  REQUIRE(machine.status == Status::ok);
  CHECK(held(*machine) == stored);
}

TEST_CASE("flash that reads garbage at the start: nothing is invented, and nothing crashes") {
  FaultyFlash flash;
  std::map<SubmapId, std::uint32_t> stored;
  {
    Machine machine(small(), flash.port());
    REQUIRE(machine.status == Status::ok);
    circle(*machine, 0, 60);
    flush(*machine);
    stored = held(*machine);
  }
  for (std::uint64_t share : {1U, 2U, 10U, 100U, 1000U}) {
    for (int trial = 0; trial < 20 / kStride; ++trial) {
      CAPTURE(share);
      flash.fail(Op::read, Mode::garbage, share);
      Machine machine(small(), flash.port());
      flash.recover();
      if (machine.status != Status::ok) {
        continue;
      }
      for (std::size_t i = 0; i < machine->store().submap_count(); ++i) {
        CHECK(stored.count(machine->store().submap_id(i)) == 1);
      }
    }
  }
  Machine machine(small(), flash.port());
  REQUIRE(machine.status == Status::ok);
  CHECK(held(*machine) == stored);
}

TEST_CASE("flash that fails in the first format: refused; blank again for the next start") {
  for (const Op op : {Op::read, Op::program, Op::erase, Op::sync}) {
    CAPTURE(static_cast<int>(op));
    FaultyFlash flash;
    flash.fail(op, Mode::from, 0);
    CHECK(Machine(small(), flash.port()).status == Status::device_error);
    flash.recover();
    Machine machine(small(), flash.port());
    REQUIRE(machine.status == Status::ok);
    circle(*machine, 0, 30);
    flush(*machine);
    CHECK(machine->collection().statistics().stored > 0);
  }
}

TEST_CASE("a power cut within the first format, at every byte: a blank device to the next start") {
  FaultyFlash whole;
  REQUIRE(Machine(small(), whole.port()).status == Status::ok);
  const std::vector<std::uint8_t> header(whole.bytes().begin(), whole.bytes().begin() + 256);
  Random random(5, 5);
  for (std::size_t cut = 0; cut < 64; ++cut) {
    CAPTURE(cut);
    for (int trial = 0; trial < 4; ++trial) {
      // The bytes before the cut whole, of those behind none or some bits at random.
      FaultyFlash flash;
      for (std::size_t i = 0; i < header.size(); ++i) {
        const unsigned keep = i < cut ? 0U : trial == 0 ? 0xFFU : static_cast<unsigned>(random.bits() & 0xFFU);
        flash.bytes()[i] = static_cast<std::uint8_t>(header[i] | keep);
      }
      Machine machine(small(), flash.port());
      CHECK(machine.status == Status::ok);
      REQUIRE(machine.slam != nullptr);
      CHECK(machine->store().submap_count() == 0);
    }
  }
  // Anything else is not ours to format.
  for (std::size_t i = 0; i < 4096; i += i < 56 ? 1 : 97) {
    CAPTURE(i);
    FaultyFlash flash;
    std::copy(header.begin(), header.begin() + 10, flash.bytes().begin());
    const std::uint8_t intended = i < 56 ? header[i] : std::uint8_t{0xFF};
    if (intended == 0) {
      continue;  // every content of this byte may be on its way to zero
    }
    flash.bytes()[i] = static_cast<std::uint8_t>(flash.bytes()[i] & ~(intended & (~intended + 1U)));
    CHECK(Machine(small(), flash.port()).status == Status::bad_data);
  }
}
