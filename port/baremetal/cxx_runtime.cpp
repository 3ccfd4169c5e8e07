// The parts of a C++ run-time library that compiled code refers to: the board ends by board_exit, so that nothing is
// ever destroyed, and what would throw ends the program. The library needs the first two only; the tests allocate.
#include <cstdlib>
#include <new>

#include "board.h"

namespace {

[[noreturn]] void stop(const char* why) {
  board_print(why);
  board_print("\n");
  board_exit(72);
}

void* allocate(std::size_t bytes) {
  void* const memory = std::malloc(bytes == 0 ? 1 : bytes);
  if (memory == nullptr) {
    stop("the heap is full");
  }
  return memory;
}

}  // namespace

extern "C" {
void* __dso_handle = nullptr;
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; }
int __aeabi_atexit(void*, void (*)(void*), void*) { return 0; }
int atexit(void (*)()) { return 0; }
void __cxa_pure_virtual() { stop("a pure virtual function was called"); }
}

void* operator new(std::size_t bytes) { return allocate(bytes); }
void* operator new[](std::size_t bytes) { return allocate(bytes); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace std {
void __throw_length_error(const char* what) { stop(what); }
void __throw_logic_error(const char* what) { stop(what); }
void __throw_out_of_range(const char* what) { stop(what); }
void __throw_out_of_range_fmt(const char* what, ...) { stop(what); }
void __throw_bad_alloc() { stop("bad_alloc"); }
void __throw_bad_array_new_length() { stop("bad_array_new_length"); }
void __throw_bad_function_call() { stop("bad_function_call"); }
}  // namespace std
