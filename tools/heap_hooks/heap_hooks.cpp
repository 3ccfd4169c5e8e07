// The hooks of heap_counter.hpp, compiled into each program that links mellin_heap_counter. The linker's --wrap sends
// calls of malloc to __wrap_malloc and those of __real_malloc to malloc; operator new goes past the wrapper, so that
// each allocation counts once.
#include <cstddef>
#include <cstdlib>
#include <new>

#include "host/heap_counter.hpp"

using mellin::host::note_allocation;
using mellin::host::note_free;

// The names are the linker's.
// NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)
extern "C" {
void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t count, std::size_t size);
void* __real_realloc(void* old, std::size_t size);
void __real_free(void* memory);
int __real_posix_memalign(void** out, std::size_t alignment, std::size_t size);
void* __real_aligned_alloc(std::size_t alignment, std::size_t size);

void* __wrap_malloc(std::size_t size) {
  note_allocation(size);
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t count, std::size_t size) {
  note_allocation(count * size);
  return __real_calloc(count, size);
}
void* __wrap_realloc(void* old, std::size_t size) {
  note_allocation(size);
  return __real_realloc(old, size);
}
void __wrap_free(void* memory) {
  if (memory != nullptr) {
    note_free();
  }
  __real_free(memory);
}
int __wrap_posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  note_allocation(size);
  return __real_posix_memalign(out, alignment, size);
}
void* __wrap_aligned_alloc(std::size_t alignment, std::size_t size) {
  note_allocation(size);
  return __real_aligned_alloc(alignment, size);
}
}

namespace {

[[maybe_unused]] const bool announced = (mellin::host::announce_heap_hooks(), true);

void* allocate(std::size_t size) noexcept {
  note_allocation(size);
  return __real_malloc(size == 0 ? 1 : size);
}

void* allocate(std::size_t size, std::align_val_t alignment) noexcept {
  note_allocation(size);
  const auto align = static_cast<std::size_t>(alignment);
  return __real_aligned_alloc(align, (size + align - 1) / align * align);
}

void* or_throw(void* memory) {
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}

void release(void* memory) noexcept {
  if (memory != nullptr) {
    note_free();
  }
  __real_free(memory);
}

}  // namespace
// NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)

void* operator new(std::size_t size) { return or_throw(allocate(size)); }
void* operator new[](std::size_t size) { return or_throw(allocate(size)); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return allocate(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return allocate(size); }
void* operator new(std::size_t size, std::align_val_t alignment) { return or_throw(allocate(size, alignment)); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return or_throw(allocate(size, alignment)); }
void operator delete(void* memory) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { release(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
