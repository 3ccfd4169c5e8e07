// Everything that the library must not do, for the control of symbols.py: each kind has to be found in this object.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>

namespace control {

int counter = 1;                             // writable global
double at_start = std::sin(counter * 0.25);  // static constructor, libm

struct Base {
  virtual int value() const { return 1; }
};
struct Derived : Base {
  int value() const override { return 2; }
};

int heap(std::size_t size) {
  void* const block = std::malloc(size);
  const int found = block != nullptr ? 1 : 0;
  std::free(block);
  return found;
}
int* operator_new() { return new int(counter); }
int exceptions(int x) {
  if (x > 3) {
    throw x;
  }
  return x;
}
int rtti(const Base* base) { return dynamic_cast<const Derived*>(base) != nullptr ? 1 : 0; }
int guarded_static() {
  static const int first = exceptions(counter);
  return first;
}
float libm(float x) { return atan2f(x, 2.0F) + std::exp(x); }
void stream() { std::cout << counter; }
int not_allowed(const char* text) { return std::puts(text); }

}  // namespace control
