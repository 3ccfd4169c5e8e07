// The checks of the processor as compiler and start-up code have set it up. Operands are volatile, so that the
// processor computes and not the compiler.
#include <climits>
#include <cstring>
#include <initializer_list>
#include <limits>

#include "conformance/conformance.hpp"
#include "mellin/core/arena.hpp"

namespace mellin::port {
namespace {

Finding failure(const char* text) { return {Outcome::failed, LogLine() << text}; }

Finding integers(Subject&) {
  const volatile std::uint32_t number = 0x01020304U;
  const std::uint32_t copy = number;
  std::uint8_t bytes[4];
  std::memcpy(bytes, &copy, sizeof bytes);
  if (bytes[0] != 4 || bytes[3] != 1) {
    return failure("the most significant byte comes first");
  }
  const volatile std::int32_t negative = -5;
  return (negative >> 1) == -3 && CHAR_BIT == 8 ? Finding{} : failure("-5 >> 1 is not -3");
}

/// Doubles and 64-bit integers at each address that the arena may give, in static memory and on the stack.
Finding alignment(Subject&) {
  alignas(kArenaAlignment) static std::byte in_static_memory[4 * kArenaAlignment];
  alignas(kArenaAlignment) std::byte on_stack[4 * kArenaAlignment];
  for (std::byte* const memory : {in_static_memory, on_stack}) {
    if (reinterpret_cast<std::uintptr_t>(memory) % kArenaAlignment != 0) {
      return failure(memory == on_stack ? "alignas(8) on the stack is not at a multiple of 8"
                                        : "alignas(8) in static memory is not at a multiple of 8");
    }
    for (std::size_t i = 0; i < 4; ++i) {
      auto* const number = ::new (static_cast<void*>(memory + i * kArenaAlignment)) double(1.5);
      *static_cast<volatile double*>(number) = *static_cast<volatile double*>(number) + static_cast<double>(i);
      if (*static_cast<volatile double*>(number) != 1.5 + static_cast<double>(i)) {
        return failure("a double did not keep its value");
      }
      auto* const integer = ::new (static_cast<void*>(memory + i * kArenaAlignment)) std::uint64_t(1);
      *static_cast<volatile std::uint64_t*>(integer) = *static_cast<volatile std::uint64_t*>(integer) << 40U;
      if (*static_cast<volatile std::uint64_t*>(integer) != std::uint64_t{1} << 40U) {
        return failure("a 64-bit integer did not keep its value");
      }
    }
  }
  return {};
}

/// Half a unit in the last place over one, and just more than that, of both signs: only rounding to nearest, ties to
/// even, brings the first to one and the second away from it.
template <class T>
bool rounds_to_nearest() {
  const volatile T one = 1;
  const volatile T half = std::numeric_limits<T>::epsilon() / 2;
  const volatile T more = half * (1 + std::numeric_limits<T>::epsilon());
  const volatile T up = one + half;
  const volatile T up_more = one + more;
  const volatile T down = -one - half;
  const volatile T down_more = -one - more;
  return up == one && up_more > one && down == -one && down_more < -one;
}

Finding rounding(Subject&) {
  if (!rounds_to_nearest<float>()) {
    return failure("a float sum was rounded another way");
  }
  return rounds_to_nearest<double>() ? Finding{} : failure("a double sum was rounded another way");
}

/// Subnormal results are made, and subnormal operands are read as what they are.
template <class T>
bool subnormals_live() {
  const volatile T smallest_normal = std::numeric_limits<T>::min();
  const volatile T quarter = static_cast<T>(0.25);
  const volatile T four = 4;
  const volatile T made = smallest_normal * quarter;
  const volatile T back = made * four;
  return made > 0 && back == smallest_normal;
}

Finding subnormals(Subject&) {
  if (!subnormals_live<float>()) {
    return failure("a float below the smallest normal one became 0 (flush to zero, FPSCR.FZ)");
  }
  return subnormals_live<double>() ? Finding{} : failure("a double below the smallest normal one became 0");
}

/// Unnamed intermediates have the precision and the range of their type.
Finding precision(Subject&) {
  const volatile float largest = std::numeric_limits<float>::max();
  const volatile float two = 2.0F;
  const float there_and_back = largest * two / two;
  const volatile float one = 1.0F;
  const volatile float tiny = std::numeric_limits<float>::epsilon() / 2;
  const float sum = one + tiny - one;
  return there_and_back == std::numeric_limits<float>::infinity() && sum == 0.0F
             ? Finding{}
             : failure("a float expression is evaluated in more than float precision");
}

Finding special_values(Subject&) {
  const volatile float zero = 0.0F;
  const volatile float nan = zero / zero;
  const volatile float infinity = 1.0F / zero;
  const volatile float minus_zero = -zero;
  const bool kept =
      nan != nan && !(nan < 1.0F) && infinity > std::numeric_limits<float>::max() && 1.0F / minus_zero < 0.0F;
  return kept ? Finding{} : failure("NaN, infinity or -0 is not told apart (-ffast-math, -ffinite-math-only)");
}

__attribute__((noinline)) float multiply_add(float a, float b, float c) { return a * b + c; }

Finding contraction(Subject&) { return judge_contraction(multiply_add); }

std::uint32_t stack_used(const Board& board) { return board.stack_size() - board.stack_untouched(); }

bool stack_known(const Board& board) {
  return board.stack_size != nullptr && board.stack_untouched != nullptr && board.stack_size() > 0;
}

constexpr std::uint32_t kStackProbe = 4096;

/// Uses the stack, bytes as the painting has none.
__attribute__((noinline)) std::uint32_t use_stack() {
  volatile std::uint8_t bytes[kStackProbe];
  for (volatile std::uint8_t& byte : bytes) {
    byte = 0;
  }
  return bytes[kStackProbe / 2];
}

Finding stack_painted(Subject& subject) {
  const Board& board = subject.board;
  if (!stack_known(board)) {
    return {Outcome::absent, LogLine() << "board_stack_size() is 0: not known"};
  }
  const std::uint32_t zero = use_stack();
  const std::uint32_t used = stack_used(board) + zero;
  if (board.stack_untouched() > board.stack_size() || used < kStackProbe || used >= board.stack_size()) {
    return {Outcome::failed, LogLine() << "of " << board.stack_size() << " bytes " << board.stack_untouched()
                                       << " are called untouched after " << kStackProbe << " were used"};
  }
  return {Outcome::passed, LogLine() << used << " of " << board.stack_size() << " bytes used so far"};
}

Finding stack_room(Subject& subject) {
  const Board& board = subject.board;
  if (!stack_known(board)) {
    return {Outcome::absent, LogLine()};
  }
  const std::uint32_t left = board.stack_untouched();
  return {left >= kSlamStackBytes ? Outcome::passed : Outcome::failed,
          LogLine() << left << " of " << board.stack_size() << " bytes were never used, Slam takes up to "
                    << kSlamStackBytes};
}

constexpr Check kChecks[] = {
    {"machine.integers", "the least significant byte comes first, and >> keeps the sign", integers},
    {"machine.alignment", "alignas(kArenaAlignment) is honoured and 64-bit values work there", alignment},
    {"machine.rounding", "floats and doubles round to nearest, ties to even", rounding},
    {"machine.subnormals", "subnormal floats and doubles are not flushed to zero", subnormals},
    {"machine.precision", "floats have no excess precision", precision},
    {"machine.special_values", "NaN, infinity and -0 are what IEEE 754 says", special_values},
    {"machine.contraction", "a * b + c is rounded twice (-ffp-contract=off)", contraction},
    {"stack.painted", "board_stack_untouched() tells bytes that were never used", stack_painted},
    {"stack.room", "the stack has room for Slam's calls", stack_room},
};

}  // namespace

Finding judge_contraction(float (*multiply_add)(float a, float b, float c)) {
  // (1 + 2^-12)^2 = 1 + 2^-11 + 2^-24: the last term falls to the rounding of the product, and stays where it is fused.
  const volatile float a = 1.0F + 1.0F / 4096.0F;
  const volatile float c = -(1.0F + 1.0F / 2048.0F);
  return multiply_add(a, a, c) == 0.0F ? Finding{} : failure("the product was not rounded before the sum");
}

Span<const Check> machine_checks() { return {kChecks, sizeof kChecks / sizeof *kChecks}; }

}  // namespace mellin::port
