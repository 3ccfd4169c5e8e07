// Memory: create() needs required_bytes(config), all of them and not one more, and nothing outside is touched, whatever
// the configuration; what was in the memory before does not matter.
#include <doctest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "mellin/core/random.hpp"
#include "mellin/slam.hpp"
#include "ramflash/heap_flash.hpp"
#include "tests/support/machine.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

constexpr std::uint64_t kSeed = 20130611;
#if defined(__SANITIZE_ADDRESS__)
constexpr std::uint64_t kConfigs = 30;
#else
constexpr std::uint64_t kConfigs = 300;
#endif

template <class T>
T pick(Random& random, std::initializer_list<T> options) {
  return options.begin()[static_cast<std::size_t>(random.uniform() * static_cast<double>(options.size()))];
}

/// A valid configuration: one of the profiles with its sizes drawn anew, small enough to be quick.
Config random_config(std::uint64_t number) {
  Random random(kSeed, number);
  const Config profiles[] = {desktop_profile(), micro_profile(), nano_profile()};
  Config c = with_laser(profiles[number % 3], pick<std::uint16_t>(random, {1, 31, 90, 181, 361}));
  if (random.uniform() < 0.3) {
    c.lasers[2] = c.lasers[0];
    c.lasers[2].beams = pick<std::uint16_t>(random, {7, 400});
    c.lasers[2].angle_increment_rad = 0.01F;
  }
  c.side = pick<std::uint16_t>(random, {64, 96, 128, 160, 192, 256});
  c.cell_m = pick(random, {0.05F, 0.1F, 0.2F});
  const int most = c.side >= 128 ? 4 : 2;  // transforms have at least 32 lines
  c.screening_side = static_cast<std::uint16_t>(c.side / pick(random, {2, most}));
  c.registration_side = static_cast<std::uint16_t>(c.side / pick(random, {1, 2, most}));
  c.class_side = static_cast<std::uint16_t>(c.side / pick(random, {1, 2, 4}));
  c.max_submaps = pick<std::uint32_t>(random, {2, 7, 33, 144});
  c.max_sessions = pick<std::uint16_t>(random, {1, 3, 16});
  c.grid_slots = pick<std::uint16_t>(random, {2, 3, 5});
  c.remembered_scans = pick<std::uint16_t>(random, {2, 7, 40});
  c.mapper.particles = pick<std::uint16_t>(random, {1, 1, 2, 5});
  c.mapper.spare_scans = pick<std::uint16_t>(random, {1, 3, 12});
  c.mapper.matcher.search_points = pick<std::uint16_t>(random, {1, 13, 72});
  c.submaps.every_scans = 3;
  c.submaps.band_rows = pick<std::uint16_t>(random, {1, 7, 32, 500});
  c.screening.cache_features = random.uniform() < 0.5;
  c.screening.hold_digests = c.screening.cache_features || random.uniform() < 0.5;
  c.mapper.count_once_a_scan = random.uniform() < 0.5;
  c.registration.alignment.max_points = pick<std::uint16_t>(random, {64, 333, 1024});
  c.registration.alignment.keep_both = random.uniform() < 0.5;
  c.collection.linker.pending = pick<std::uint16_t>(random, {1, 5, 64});
  c.collection.graph.max_edges = pick<std::uint32_t>(random, {4, 63, 512});
  c.collection.graph.max_fill = c.max_submaps * pick<std::uint32_t>(random, {1, 7});
  c.seed = random.bits();
  return c;
}

std::size_t sum_of_parts(const ArenaUse& use) {
  std::size_t sum = 0;
  for (const std::size_t bytes : use.by_part) {
    sum += bytes;
  }
  return sum;
}

/// Flash and a log, as a port.
struct Outside {
  port::HeapFlash flash{port::FlashGeometry{4096, 256, 256}};
  std::vector<std::string> lines;
  mellin_port port = {};
  Outside() {
    port.flash = flash.flash();
    port.log = sink_to(lines);
  }
};

/// A scan at each of so many places, the work drained, and a flush.
void short_run(Slam& slam, int scans) {
  circle(slam, 0, scans);
  REQUIRE(slam.begin_flush() == Status::ok);
  drain(slam);
}

/// Everything that a run leaves, in one number (FNV-1a).
class Digest {
 public:
  void take(const void* data, std::size_t size) {
    const auto* const bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) {
      hash_ = (hash_ ^ bytes[i]) * 0x100000001B3U;
    }
  }
  void take(const Pose2& pose) {
    for (const double value : {pose.x, pose.y, pose.theta}) {
      take(&value, sizeof value);
    }
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325U;
};

std::uint64_t result_of(const Slam& slam, const mellin_flash& flash) {
  Digest digest;
  digest.take(slam.pose());
  for (SubmapId id = 0; id < slam.collection().size(); ++id) {
    digest.take(slam.collection().map_T_submap(id));
  }
  std::vector<unsigned char> block(flash.block_size);
  for (std::uint32_t i = 0; i < flash.block_count; ++i) {
    REQUIRE(flash.read(flash.context, i * flash.block_size, block.data(), flash.block_size) == 0);
    digest.take(block.data(), block.size());
  }
  return digest.value();
}

}  // namespace

TEST_CASE("required_bytes() is exact for random configurations of all profiles") {
  MESSAGE(kConfigs, " configurations from seed ", kSeed);
  std::uint64_t with_submaps = 0;
  for (std::uint64_t number = 0; number < kConfigs; ++number) {
    CAPTURE(number);
    const Config config = random_config(number);
    Outside outside;
    const Status valid = validate(config, Log(outside.port.log));
    const std::string said = outside.lines.empty() ? "" : outside.lines[0];
    CAPTURE(said);
    REQUIRE(valid == Status::ok);
    const std::size_t bytes = required_bytes(config);
    CHECK(sum_of_parts(required_memory(config)) == bytes);
    {
      GuardedMemory memory(bytes - 1);
      CHECK(Slam::create(config, memory.span(), outside.port).status() == Status::insufficient_memory);
      REQUIRE(outside.lines.size() == 1);
      CHECK(outside.lines[0].find("lacks 1 byte") != std::string::npos);
      CHECK(memory.intact());
    }
    Machine machine(config, outside.port);
    REQUIRE(machine.status == Status::ok);
    CHECK(machine->arena_use().total() == bytes);
    CHECK(sum_of_parts(machine->arena_use()) == bytes);
    CHECK(machine.memory.intact());
    short_run(*machine, 12);
    CHECK(machine.memory.intact());
    with_submaps += machine->collection().size() > 0 ? 1U : 0U;
  }
  CHECK(with_submaps > kConfigs / 2);  // the runs reach the store and the graph
}

TEST_CASE("the profiles themselves: exact, and too little memory is told in bytes") {
  const Config profiles[] = {desktop_profile(), micro_profile(), nano_profile()};
  for (const Config& profile : profiles) {
    const Config config = with_laser(profile);
    const std::size_t bytes = required_bytes(config);
    CAPTURE(bytes);
    Outside outside;
    for (const std::size_t lacking : {std::size_t{1}, std::size_t{1000}, bytes}) {
      outside.lines.clear();
      GuardedMemory memory(bytes - lacking);
      CHECK(Slam::create(config, memory.span(), outside.port).status() == Status::insufficient_memory);
      REQUIRE(outside.lines.size() == 1);
      CHECK(outside.lines[0].find("lacks " + std::to_string(lacking) + " bytes") != std::string::npos);
    }
    Machine machine(config, outside.port);
    REQUIRE(machine.status == Status::ok);
    CHECK(machine->arena_use().total() == bytes);
    short_run(*machine, 4);
    CHECK(machine.memory.intact());
  }
}

TEST_CASE("two regions, a fast one and a bulk one: each exact, and the same bits as in one") {
  for (std::uint64_t number = 0; number < kConfigs / 10; ++number) {
    CAPTURE(number);
    const Config config = random_config(number);
    const ArenaUse use = required_memory(config);
    REQUIRE(use.fast > 0);
    CHECK(use.fast + use.bulk == required_bytes(config));
    Outside outside;
    GuardedMemory bulk(use.bulk);
    GuardedMemory fast(use.fast);
    GuardedMemory less_bulk(use.bulk - 1);
    GuardedMemory less_fast(use.fast - 1);
    const auto refused = [&](GuardedMemory& a, GuardedMemory& b) {
      outside.lines.clear();
      CHECK(Slam::create(config, a.span(), outside.port, b.span()).status() == Status::insufficient_memory);
      REQUIRE(outside.lines.size() == 1);
      CHECK(outside.lines[0].find("lacks 1 byte") != std::string::npos);
      CHECK(a.intact());
      CHECK(b.intact());
    };
    refused(less_bulk, fast);
    refused(bulk, less_fast);
    Result<Slam*> split = Slam::create(config, bulk.span(), outside.port, fast.span());
    REQUIRE(split.ok());
    CHECK(split.value()->arena_use().fast == use.fast);
    CHECK(split.value()->arena_use().bulk == use.bulk);
    short_run(*split.value(), 12);
    CHECK(bulk.intact());
    CHECK(fast.intact());
    Outside other;
    Machine whole(config, other.port);
    REQUIRE(whole.status == Status::ok);
    short_run(*whole, 12);
    CHECK(result_of(*split.value(), outside.port.flash) == result_of(*whole, other.port.flash));
  }
}

TEST_CASE("what the memory held before create() does not matter: the same bits come out") {
  for (std::uint64_t number = 0; number < kConfigs / 10; ++number) {
    CAPTURE(number);
    const Config config = random_config(number);
    Random random(kSeed, number + kConfigs);
    const GuardedMemory::Fill fills[] = {[](std::size_t) { return std::byte{0}; },
                                         [](std::size_t) { return std::byte{0xA5}; },
                                         [](std::size_t) { return std::byte{0xFF}; },
                                         [&](std::size_t) { return static_cast<std::byte>(random.bits()); }};
    std::vector<std::uint64_t> results;
    for (const GuardedMemory::Fill& fill : fills) {
      Outside outside;
      GuardedMemory memory(required_bytes(config), fill);
      Result<Slam*> made = Slam::create(config, memory.span(), outside.port);
      REQUIRE(made.ok());
      short_run(*made.value(), 16);
      results.push_back(result_of(*made.value(), outside.port.flash));
      CHECK(results.back() == results.front());
    }
  }
}

TEST_CASE("memory that is not aligned is refused and left alone") {
  const Config config = small();
  const ArenaUse use = required_memory(config);
  GuardedMemory memory(required_bytes(config) + kArenaAlignment);
  GuardedMemory fast(use.fast + kArenaAlignment);
  for (std::size_t off = 1; off < kArenaAlignment; ++off) {
    CAPTURE(off);
    const Span<std::byte> askew = memory.span().subspan(off, required_bytes(config));
    CHECK(Slam::create(config, askew, {}).status() == Status::invalid_argument);
    CHECK(Slam::create(config, memory.span(), {}, fast.span().subspan(off, use.fast)).status() ==
          Status::invalid_argument);
  }
  const Span<std::byte> bytes = memory.span();
  CHECK(std::all_of(bytes.begin(), bytes.end(), [](std::byte b) { return b == std::byte{0xA5}; }));
  CHECK(Slam::create(config, memory.span(), {}, fast.span()).ok());
}
