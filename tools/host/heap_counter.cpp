#include "host/heap_counter.hpp"

#include <atomic>

namespace mellin::host {
namespace {

std::atomic<bool> hooked{false};
std::atomic<std::uint64_t> allocations{0};
std::atomic<std::uint64_t> frees{0};
std::atomic<std::uint64_t> bytes{0};
thread_local int depth = 0;

}  // namespace

bool heap_is_counted() { return hooked; }

HeapCounts heap_counts() { return {allocations, frees, bytes}; }

void reset_heap_counts() {
  allocations = 0;
  frees = 0;
  bytes = 0;
}

LibraryCall::LibraryCall() { ++depth; }

LibraryCall::~LibraryCall() { --depth; }

void announce_heap_hooks() { hooked = true; }

void note_allocation(std::uint64_t size) {
  if (depth > 0) {
    ++allocations;
    bytes += size;
  }
}

void note_free() {
  if (depth > 0) {
    ++frees;
  }
}

}  // namespace mellin::host
