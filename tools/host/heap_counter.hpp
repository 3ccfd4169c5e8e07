// Counts what the library asks of the heap, which has to be nothing. A program that links mellin_heap_counter has
// malloc and its kin wrapped by the linker (in all that is linked statically) and operator new replaced; what they do
// while the calling thread is inside a LibraryCall is counted. In other programs, and under sanitizers, which have
// their own heap, nothing is counted, and heap_is_counted() says so.
#pragma once

#include <cstdint>

namespace mellin::host {

struct HeapCounts {
  std::uint64_t allocations = 0;  ///< reallocations, too
  std::uint64_t frees = 0;        ///< of null pointers, none
  std::uint64_t bytes = 0;        ///< allocated
};

bool heap_is_counted();
/// Of all threads since the start or the last reset.
HeapCounts heap_counts();
void reset_heap_counts();

/// The calling thread is inside the library as long as one of these lives; they nest.
class LibraryCall {
 public:
  LibraryCall();
  ~LibraryCall();
  LibraryCall(const LibraryCall&) = delete;
  LibraryCall& operator=(const LibraryCall&) = delete;
};

// For the hooks only.
void announce_heap_hooks();
void note_allocation(std::uint64_t size);
void note_free();

}  // namespace mellin::host
