// The conformance test of a board, over ports that keep the contract and over ports broken on purpose: each defect has
// to be found, by the check that is meant for it.
#include "conformance/conformance.hpp"

#include <doctest.h>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "posix/clock.hpp"
#include "posix/entropy.hpp"
#include "ramflash/heap_flash.hpp"
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

using namespace mellin;
using namespace mellin::port;

namespace {

enum class Defect {
  none,
  drops_a_byte,
  drops_last_unit,
  shifts_odd_pointers,
  wraps_in_pages,
  erase_spills,
  erase_falls_short,
  program_spills,
  reads_even_addresses,
  reads_beyond,
  reads_outside,
  programs_outside,
  erases_outside,
  blocks_are_one,
  reprogram_spills,
  sync_fails,
  sync_loses,
  wears_out,
  erase_fails_at_last
};

/// A flash over plain bytes that does what the defect says.
class BrokenFlash {
 public:
  BrokenFlash(const FlashGeometry& geometry, Defect defect)
      : geometry_(geometry), defect_(defect), bytes_(static_cast<std::size_t>(geometry.bytes()), kErasedByte) {}

  mellin_flash flash() {
    mellin_flash flash = describe(this, geometry_);
    flash.read = [](void* self, std::uint32_t address, void* to, std::uint32_t size) {
      return static_cast<BrokenFlash*>(self)->read(address, static_cast<std::uint8_t*>(to), size);
    };
    flash.program = [](void* self, std::uint32_t address, const void* data, std::uint32_t size) {
      return static_cast<BrokenFlash*>(self)->program(address, static_cast<const std::uint8_t*>(data), size);
    };
    flash.erase = [](void* self, std::uint32_t block) { return static_cast<BrokenFlash*>(self)->erase(block); };
    flash.sync = [](void* self) { return static_cast<BrokenFlash*>(self)->sync(); };
    return flash;
  }

 private:
  bool has(Defect defect) const { return defect_ == defect; }
  std::uint8_t& at(std::uint64_t address) { return bytes_[static_cast<std::size_t>(address % bytes_.size())]; }

  int read(std::uint32_t address, std::uint8_t* to, std::uint32_t size) {
    if (!geometry_.inside(address, size) && !has(Defect::reads_outside)) {
      return -1;
    }
    for (std::uint32_t i = 0; i < size; ++i) {
      to[i] = at((has(Defect::reads_even_addresses) ? address & ~1U : address) + std::uint64_t{i});
    }
    if (has(Defect::reads_beyond) && size % 4 != 0) {
      to[size] = 0;  // as a copy in words would
    }
    return 0;
  }

  int program(std::uint32_t address, const std::uint8_t* data, std::uint32_t size) {
    if (address % geometry_.program_unit != 0 || size % geometry_.program_unit != 0 ||
        (!geometry_.inside(address, size) && !has(Defect::programs_outside))) {
      return -1;
    }
    if (has(Defect::shifts_odd_pointers)) {
      data -= reinterpret_cast<std::uintptr_t>(data) % 2;
    }
    const bool over_data = at(address) != kErasedByte;
    for (std::uint32_t i = 0; i < size; ++i) {
      if (has(Defect::drops_a_byte) && i == 13) {
        continue;
      }
      if (has(Defect::drops_last_unit) && size > geometry_.program_unit && i >= size - geometry_.program_unit) {
        continue;
      }
      std::uint32_t to = address + i;
      if (has(Defect::wraps_in_pages)) {
        constexpr std::uint32_t kPage = 256;  // as NOR flash does where a program crosses its page's end
        to = address / kPage * kPage + to % kPage;
      }
      at(to) &= data[i];
    }
    if (has(Defect::program_spills) || (has(Defect::reprogram_spills) && over_data)) {
      at(std::uint64_t{address} + size) &= 0xF0;
    }
    return 0;
  }

  int erase(std::uint32_t block) {
    if (block >= geometry_.block_count && !has(Defect::erases_outside)) {
      return -1;
    }
    if (has(Defect::erase_fails_at_last) && block + 1 == geometry_.block_count) {
      return -5;
    }
    if (has(Defect::blocks_are_one) && block == geometry_.block_count - 1) {
      block = 0;
    }
    const std::uint64_t from = std::uint64_t{block} * geometry_.block_size;
    const std::uint32_t extra = has(Defect::erase_spills) ? 1 : 0;
    const std::uint32_t missing = has(Defect::erase_falls_short) ? 1 : 0;
    ++erases_;
    for (std::uint32_t i = 0; i < geometry_.block_size + extra - missing; ++i) {
      at(from + i) = has(Defect::wears_out) && erases_ > kEndurance && i == 100 ? 0x7F : kErasedByte;
    }
    return 0;
  }

  int sync() {
    if (has(Defect::sync_loses)) {
      std::fill(bytes_.begin(), bytes_.end(), kErasedByte);
    }
    return has(Defect::sync_fails) ? -9 : 0;
  }

  static constexpr int kEndurance = 50;
  FlashGeometry geometry_;
  Defect defect_;
  std::vector<std::uint8_t> bytes_;
  int erases_ = 0;
};

/// What the checks said, by name.
struct Results {
  std::vector<std::string> failed;
  std::vector<std::string> absent;
  std::vector<std::string> texts;
  Tally tally;

  bool failed_at(const char* name) const { return std::find(failed.begin(), failed.end(), name) != failed.end(); }
};

Results run(const mellin_port& port, const Board& board = {}) {
  auto subject = std::make_unique<Subject>();
  subject->port = port;
  subject->board = board;
  Results results;
  const Reporter reporter{&results, [](void* context, const Check& check, const Finding& finding) {
                            auto& into = *static_cast<Results*>(context);
                            if (finding.outcome == Outcome::failed) {
                              into.failed.emplace_back(check.name);
                              into.texts.emplace_back(finding.text.text());
                            } else if (finding.outcome == Outcome::absent) {
                              into.absent.emplace_back(check.name);
                            }
                          }};
  results.tally = check_board(*subject, reporter);
  return results;
}

Results run_flash(const mellin_flash& flash) {
  mellin_port port = {};
  port.flash = flash;
  return run(port);
}

Results run_defect(Defect defect) {
  BrokenFlash broken({1024, 32, 16}, defect);
  return run_flash(broken.flash());
}

const Results& results_of(const Results& results) {
  for (std::size_t i = 0; i < results.failed.size(); ++i) {
    MESSAGE(results.failed[i], ": ", results.texts[i]);
  }
  return results;
}

using Fill = int (*)(void*, void*, std::uint32_t);

bool entropy_fails(Fill fill) {
  mellin_port port = {};
  port.entropy.fill = fill;
  return run(port).tally.failed > 0;
}

std::vector<std::string> run_clock(std::uint64_t (*now_us)(void*)) {
  std::uint64_t reads = 0;
  mellin_port port = {};
  port.clock = {&reads, now_us};
  return run(port).failed;
}

std::uint64_t next(void* reads) { return ++*static_cast<std::uint64_t*>(reads); }

}  // namespace

TEST_SUITE("conformance") {
  TEST_CASE("A port that keeps the contract passes all checks") {
    for (const FlashGeometry geometry : {FlashGeometry{4096, 64, 256}, FlashGeometry{4096, 2, 1},
                                         FlashGeometry{2048, 3, 2048}, FlashGeometry{8192, 40, 8}}) {
      CAPTURE(geometry.program_unit);
      HeapFlash flash(geometry);
      mellin_port port = {};
      port.flash = flash.flash();
      port.clock = posix::monotonic_clock();
      port.entropy = posix::system_entropy();
      int lines = 0;
      port.log = {&lines, [](void* context, mellin_log_level, const char*) { ++*static_cast<int*>(context); }};
      const Results results = results_of(run(port));
      CHECK(results.failed.empty());
      CHECK(results.absent == std::vector<std::string>{"stack.painted", "stack.room"});
      CHECK(results.tally.passed + 2 == machine_checks().size() + service_checks().size() + flash_checks().size());
      CHECK(lines == 3);
      CHECK(is_erased({flash.bytes().data(), geometry.block_size}));
    }
  }

  TEST_CASE("A device that overwrites in place, takes odd buffers and starts full passes too") {
    CHECK(results_of(run_defect(Defect::none)).failed.empty());
  }

  TEST_CASE("Parts that a port does not have are reported as such, not failed") {
    const Results results = run({});
    CHECK(results.failed.empty());
    for (const char* name : {"flash.geometry", "clock.runs", "entropy.fills", "log.prints"}) {
      CHECK(std::find(results.absent.begin(), results.absent.end(), name) != results.absent.end());
    }
  }

  TEST_CASE("Each defect of a flash is found by the check that is meant for it") {
    const std::pair<Defect, const char*> expected[] = {
        {Defect::drops_a_byte, "flash.program_exact"},
        {Defect::drops_last_unit, "flash.program_run"},
        {Defect::wraps_in_pages, "flash.program_run"},
        {Defect::shifts_odd_pointers, "flash.program_pointer"},
        {Defect::erase_spills, "flash.erase_neighbours"},
        {Defect::erase_falls_short, "flash.erase_complete"},
        {Defect::program_spills, "flash.program_neighbours"},
        {Defect::reads_even_addresses, "flash.read_anywhere"},
        {Defect::reads_beyond, "flash.read_buffer"},
        {Defect::reads_outside, "flash.read_bounds"},
        {Defect::programs_outside, "flash.program_bounds"},
        {Defect::erases_outside, "flash.erase_bounds"},
        {Defect::blocks_are_one, "flash.blocks_distinct"},
        {Defect::reprogram_spills, "flash.reprogram"},
        {Defect::sync_fails, "flash.sync"},
        {Defect::sync_loses, "flash.sync"},
        {Defect::wears_out, "flash.cycles"},
        {Defect::erase_fails_at_last, "flash.blocks_distinct"},
    };
    for (const auto& one : expected) {
      CAPTURE(one.second);
      CHECK(run_defect(one.first).failed_at(one.second));
    }
  }

  TEST_CASE("Some defects show in one check alone") {
    for (const auto& [defect, check] :
         {std::pair{Defect::shifts_odd_pointers, "flash.program_pointer"},
          std::pair{Defect::reads_outside, "flash.read_bounds"}, std::pair{Defect::reprogram_spills, "flash.reprogram"},
          std::pair{Defect::sync_loses, "flash.sync"}, std::pair{Defect::erases_outside, "flash.erase_bounds"}}) {
      CHECK(run_defect(defect).failed == std::vector<std::string>{check});
    }
  }

  TEST_CASE("What was found says where and what") {
    const Results results = run_defect(Defect::sync_fails);
    REQUIRE(!results.texts.empty());
    CHECK(results.texts.front() == "sync(0) returned -9");
    const Results short_erase = run_defect(Defect::erase_falls_short);
    REQUIRE(!short_erase.texts.empty());
    CHECK(short_erase.texts.front().find("byte 1023 (block 0) reads ") == 0);
    CHECK(short_erase.texts.front().find(" instead of 255") != std::string::npos);
  }

  TEST_CASE("A geometry that cannot be is found before anything is erased") {
    HeapFlash good({4096, 64, 256});
    const std::function<void(mellin_flash&)> spoil[] = {
        [](mellin_flash& f) { f.block_count = 1; },   [](mellin_flash& f) { f.program_unit = 0; },
        [](mellin_flash& f) { f.program_unit = 24; }, [](mellin_flash& f) { f.program_unit = 4096; },
        [](mellin_flash& f) { f.block_size = 4000; }, [](mellin_flash& f) { f.block_size = 0; },
        [](mellin_flash& f) { f.sync = nullptr; },    [](mellin_flash& f) { f.block_count = 1U << 21U; }};
    for (const auto& change : spoil) {
      mellin_flash flash = good.flash();
      change(flash);
      CHECK(run_flash(flash).failed == std::vector<std::string>{"flash.geometry"});
    }
    CHECK(good.counts().erases == 0);
    mellin_flash inverted = good.flash();
    inverted.erased_value = 0;
    CHECK(run_flash(inverted).failed_at("flash.erase_complete"));
  }

  TEST_CASE("A clock that goes back or stands still is found, a coarse one is not refused") {
    const std::vector<std::string> found{"clock.runs"};
    CHECK(run_clock([](void* reads) -> std::uint64_t { return next(reads) % 500; }) == found);
    CHECK(run_clock([](void*) -> std::uint64_t { return 7; }) == found);
    CHECK(run_clock([](void* reads) -> std::uint64_t { return next(reads) / 10000 * 10000; }).empty());
  }

  TEST_CASE("Entropy that is none is found") {
    CHECK(entropy_fails([](void*, void*, std::uint32_t) { return -1; }));
    CHECK(entropy_fails([](void*, void* to, std::uint32_t size) {
      std::memset(to, 0, size);
      return 0;
    }));
    CHECK(entropy_fails([](void*, void* to, std::uint32_t size) {  // the same unpredictable bytes in each call
      for (std::uint32_t i = 0; i < size; ++i) {
        static_cast<std::uint8_t*>(to)[i] = static_cast<std::uint8_t>(i * i * 37U >> 2U);
      }
      return 0;
    }));
    CHECK(entropy_fails([](void*, void* to, std::uint32_t size) {  // a counter
      static std::uint8_t count = 0;
      for (std::uint32_t i = 0; i < size; ++i) {
        static_cast<std::uint8_t*>(to)[i] = ++count;
      }
      ++count;
      return 0;
    }));
    CHECK(entropy_fails([](void*, void* to, std::uint32_t size) {  // whole words only
      return posix::system_entropy().fill(nullptr, to, size / 4 * 4);
    }));
    CHECK(entropy_fails([](void*, void* to, std::uint32_t size) {  // one word too many
      return posix::system_entropy().fill(nullptr, to, (size + 4) / 4 * 4);
    }));
  }

  TEST_CASE("A stack that is too small, or not painted, is found") {
    Board small{[]() -> std::uint32_t { return 12288; }, []() -> std::uint32_t { return 4096; }};
    CHECK(run({}, small).failed == std::vector<std::string>{"stack.room"});
    Board unpainted{[]() -> std::uint32_t { return 65536; }, []() -> std::uint32_t { return 65536; }};
    CHECK(run({}, unpainted).failed == std::vector<std::string>{"stack.painted"});
    Board never_counted{[]() -> std::uint32_t { return 65536; }, []() -> std::uint32_t { return 0; }};
    CHECK(run({}, never_counted).failed_at("stack.painted"));
    Board good{[]() -> std::uint32_t { return 65536; }, []() -> std::uint32_t { return 50000; }};
    CHECK(run({}, good).failed.empty());
  }

  TEST_CASE("A fused multiply-add is told from one that rounds twice") {
    CHECK(judge_contraction([](float a, float b, float c) {
            const volatile float product = a * b;
            return product + c;
          }).outcome == Outcome::passed);
    CHECK(judge_contraction([](float a, float b, float c) { return std::fma(a, b, c); }).outcome == Outcome::failed);
  }

#if defined(__SSE2__)
  TEST_CASE("A processor that flushes subnormals or rounds another way is found") {
    const unsigned int before = _mm_getcsr();
    for (const unsigned int flag : {0x8000U, 0x0040U}) {  // results to zero, operands to zero
      _mm_setcsr(before | flag);
      const Results results = run({});
      _mm_setcsr(before);
      CHECK(results.failed == std::vector<std::string>{"machine.subnormals"});
    }
    for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
      REQUIRE(std::fesetround(mode) == 0);
      const Results results = run({});
      REQUIRE(std::fesetround(FE_TONEAREST) == 0);
      CHECK(results.failed_at("machine.rounding"));
    }
  }
#endif
}
