#include "host/heap_counter.hpp"

#include <doctest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "ramflash/heap_flash.hpp"
#include "store_fixture.hpp"
#include "tests/support/machine.hpp"

using namespace mellin;
using mellin::host::heap_counts;
using mellin::host::heap_is_counted;
using mellin::host::LibraryCall;
using mellin::host::reset_heap_counts;
using namespace mellin::test;

namespace {

/// Keeps the compiler from leaving out an allocation that nobody reads.
void* volatile sink_of_pointers;

template <class F>
host::HeapCounts counted(F&& call) {
  reset_heap_counts();
  {
    const LibraryCall inside;
    call();
  }
  return heap_counts();
}

bool counting() {
  if (!heap_is_counted()) {
    MESSAGE("not counted under sanitizers");
  }
  return heap_is_counted();
}

}  // namespace

TEST_CASE("each way to the heap is counted once") {
  if (!counting()) {
    return;
  }
  const auto free_it = [](void* memory) {
    sink_of_pointers = memory;
    std::free(memory);
  };
  CHECK(counted([&] { free_it(std::malloc(100)); }).bytes == 100);
  CHECK(counted([&] { free_it(std::calloc(3, 7)); }).bytes == 21);
  CHECK(counted([&] { free_it(std::aligned_alloc(64, 128)); }).bytes == 128);
  CHECK(counted([&] { free_it(std::realloc(std::malloc(8), 50)); }).allocations == 2);
  CHECK(counted([&] {
          void* memory = nullptr;
          CHECK(posix_memalign(&memory, 64, 64) == 0);
          free_it(memory);
        }).frees == 1);
  const host::HeapCounts by_new = counted([&] {
    auto* const one = new int(1);
    sink_of_pointers = one;
    delete one;
    auto* const many = new double[10];
    sink_of_pointers = many;
    delete[] many;
    struct alignas(128) Wide {
      char bytes[128];
    };
    auto* const wide = new Wide();
    sink_of_pointers = wide;
    delete wide;
  });
  CHECK(by_new.allocations == 3);
  CHECK(by_new.frees == 3);
  CHECK(by_new.bytes == sizeof(int) + 10 * sizeof(double) + 128);
}

TEST_CASE("outside a library call, and in other threads, nothing is counted") {
  if (!counting()) {
    return;
  }
  reset_heap_counts();
  auto outside = std::make_unique<std::vector<int>>(1000);
  sink_of_pointers = outside->data();
  CHECK(heap_counts().allocations == 0);
  CHECK(counted([] {}).allocations == 0);
  // The thread's own start allocates in this one; what it does itself is not in the library.
  std::uint64_t in_thread = 1;
  std::thread([&] {
    reset_heap_counts();
    sink_of_pointers = std::malloc(10);
    std::free(sink_of_pointers);
    in_thread = heap_counts().allocations;
  }).join();
  CHECK(in_thread == 0);
}

TEST_CASE("a callback of the port that allocates is found out, the store itself does not allocate") {
  if (!counting()) {
    return;
  }
  port::HeapFlash flash({4096, 64, 256});
  std::vector<std::string> lines;
  const mellin_log log = {&lines, [](void* context, mellin_log_level, const char* line) {
                            static_cast<std::vector<std::string>*>(context)->emplace_back(line);
                          }};
  for (const bool allocates : {false, true}) {
    test::TestStore t(test::small_config(), flash.flash(), allocates ? log : mellin_log{});
    const std::vector<std::uint8_t> cells = test::room_grid(64, 1);
    const std::vector<std::uint8_t> blob = test::random_bytes(3000, 1);
    const host::HeapCounts counts = counted([&] {
      static_cast<void>(t.store.format());
      static_cast<void>(t.put(test::sample_header(0), cells, blob));
      static_cast<void>(t.store.mount());
      static_cast<void>(t.fetch(0));
    });
    CHECK(t.store.is_resident(0));
    CHECK((counts.allocations > 0) == allocates);
  }
}

TEST_CASE("library calls leave the heap alone") {
  if (!host::heap_is_counted()) {
    MESSAGE("not counted under sanitizers");
    return;
  }
  const Config config = small();
  port::HeapFlash flash({4096, 512, 256});
  mellin_port port = {};
  port.flash = flash.flash();
  GuardedMemory memory(required_bytes(config));
  std::vector<std::vector<float>> scans;
  for (int i = 0; i < 60; ++i) {
    scans.push_back(measure(room(), on_circle(i), config.lasers[0]));
  }
  host::reset_heap_counts();
  {
    const host::LibraryCall inside;
    Result<Slam*> made = Slam::create(config, memory.span(), port);
    REQUIRE(made.ok());
    for (int i = 0; i < 60; ++i) {
      (void)made.value()->add({0, span(scans[static_cast<std::size_t>(i)]), on_circle(i), 0}).ok();
      drain(*made.value());
    }
    (void)made.value()->begin_flush();
    drain(*made.value());
  }
  CHECK(host::heap_counts().allocations == 0);
}
