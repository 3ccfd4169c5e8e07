// Whether a board keeps the contract of mellin/port.h and what the library takes for granted of a processor. Each check
// is a function on its own, with the sentence that it holds the board to, so that a failure says what to mend. The
// image porttest.elf (port_test.cpp) runs them on a board, the host's tests over ports broken on purpose.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/log.hpp"
#include "mellin/core/span.hpp"
#include "mellin/port.h"

namespace mellin::port {

enum class Outcome : std::uint8_t {
  passed,
  failed,
  absent  ///< the board does not have this part, and need not
};

/// What a check saw. For a failure the text says what was found instead; otherwise it may hold a figure.
struct Finding {
  Outcome outcome = Outcome::passed;
  LogLine text;
};

/// What checks need beside the port.
struct Board {
  std::uint32_t (*stack_size)() = nullptr;       ///< board_stack_size(); nullptr or a size of 0: not known
  std::uint32_t (*stack_untouched)() = nullptr;  ///< board_stack_untouched()
};

/// The stack that has to be free for Slam's calls, bytes.
inline constexpr std::uint32_t kSlamStackBytes = 16 * 1024;

/// The board under test, with room for the checks to work in (8 KiB: not for a stack).
struct Subject {
  static constexpr std::uint32_t kBuffer = 4096;  ///< two of the largest program units
  static constexpr std::uint32_t kGuard = 8;

  mellin_port port = {};
  Board board = {};
  std::uint8_t out[kBuffer + kGuard] = {};  ///< what is programmed
  std::uint8_t in[kBuffer + kGuard] = {};   ///< what is read
};

struct Check {
  const char* name;
  const char* contract;  ///< what has to hold
  Finding (*run)(Subject& subject);
};

/// Flash. The first check is of the geometry; where it does not pass, the others have no sense. They erase and program
/// the first and the last block and some between, and leave those erased.
Span<const Check> flash_checks();
/// Clock, entropy and log sink.
Span<const Check> service_checks();
/// The processor, as the compiler's options and the start-up code have set it up: byte order, floats, alignment, stack.
Span<const Check> machine_checks();

/// Adds rounding once or twice: a * b + c. Passed in, so that a fused one can be told from it.
Finding judge_contraction(float (*multiply_add)(float a, float b, float c));

/// Where results go, one call a check. `finding` is valid during the call only.
struct Reporter {
  void* context = nullptr;
  void (*result)(void* context, const Check& check, const Finding& finding) = nullptr;
};

struct Tally {
  std::uint32_t passed = 0;
  std::uint32_t failed = 0;
  std::uint32_t absent = 0;
};

/// All checks, in a fixed order. Cost: about a hundred erases and 40 blocks' worth of programming; the clock is watched
/// for two million reads at most.
Tally check_board(Subject& subject, const Reporter& reporter);

}  // namespace mellin::port
