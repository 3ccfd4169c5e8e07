// The small runner: what the suites use of doctest, for targets where doctest itself does not fit (no exceptions, no
// iostream, no C++ library on RISC-V). Found as <doctest.h> in the self-test image; the case bodies are the same.
//
// A failed REQUIRE leaves its case by longjmp, so that destructors are not run: the image ends soon after, as failed.
#pragma once

#include <csetjmp>
#include <cstdint>

namespace doctest {

/// A number that another one equals within a relative tolerance, as doctest has it.
class Approx {
 public:
  template <class T>
  explicit Approx(T value) : value_(static_cast<double>(value)) {}
  Approx& epsilon(double epsilon) {
    epsilon_ = epsilon;
    return *this;
  }
  friend bool operator==(double other, const Approx& approx) {
    const double size = magnitude(other) > magnitude(approx.value_) ? magnitude(other) : magnitude(approx.value_);
    return magnitude(other - approx.value_) < approx.epsilon_ * (1.0 + size);
  }

 private:
  static double magnitude(double x) { return x < 0.0 ? -x : x; }

  double value_;
  double epsilon_ = 1.1920929e-7 * 100.0;
};

}  // namespace doctest

namespace mellin::selftest {

using Case = void (*)();

/// Puts a case into the list of those that run; lives as long as the program.
class Registration {
 public:
  Registration(const char* name, Case run);
  const char* name() const { return name_; }
  void run() const { run_(); }
  const Registration* next() const { return next_; }

 private:
  const char* name_;
  Case run_;
  const Registration* next_ = nullptr;
};

/// Notes what a check found; prints the case's first failure.
void check(bool passed, const char* file, int line, const char* expression);
/// Where a failed REQUIRE goes.
[[noreturn]] void leave_case();

}  // namespace mellin::selftest

#define MELLIN_JOIN_(a, b) a##b
#define MELLIN_JOIN(a, b) MELLIN_JOIN_(a, b)
#define MELLIN_CASE(function, name)                                                          \
  static void function();                                                                    \
  static const mellin::selftest::Registration MELLIN_JOIN(function, _entry)(name, function); \
  static void function()

#define TEST_CASE(name) MELLIN_CASE(MELLIN_JOIN(mellin_case_, __LINE__), name)
#define TEST_SUITE(name) namespace MELLIN_JOIN(mellin_suite_, __LINE__)
#define CHECK(...) mellin::selftest::check(static_cast<bool>(__VA_ARGS__), __FILE__, __LINE__, #__VA_ARGS__)
#define CHECK_FALSE(...) \
  mellin::selftest::check(!static_cast<bool>(__VA_ARGS__), __FILE__, __LINE__, "not " #__VA_ARGS__)
#define REQUIRE(...)                                                          \
  do {                                                                        \
    const bool mellin_passed = static_cast<bool>(__VA_ARGS__);                \
    mellin::selftest::check(mellin_passed, __FILE__, __LINE__, #__VA_ARGS__); \
    if (!mellin_passed) {                                                     \
      mellin::selftest::leave_case();                                         \
    }                                                                         \
  } while (false)
#define REQUIRE_FALSE(...) REQUIRE(!static_cast<bool>(__VA_ARGS__))
#define CAPTURE(...) static_cast<void>(0)
#define INFO(...) static_cast<void>(0)
#define MESSAGE(...) static_cast<void>(0)
