// Runs the self tests on a board: a line for each failed case, a line for the sum, and the exit status.
// arguments: [WORD]   only the cases whose name contains the word, each with its cost in millions of instructions
#include <cstring>

#include "board.h"
#include "doctest.h"
#include "images/print.hpp"

namespace mellin::selftest {
namespace {

struct Run {
  const Registration* first = nullptr;
  const char* case_name = "";
  bool failed = false;
  std::jmp_buf leave = {};
};

/// One for the program: the cases register before main().
Run& run() {
  static Run the_run;
  return the_run;
}

const char* file_name(const char* path) {
  const char* const slash = std::strrchr(path, '/');
  return slash == nullptr ? path : slash + 1;
}

/// Runs one case; returns whether it passed.
bool passes(const Registration& test) {
  run().case_name = test.name();
  run().failed = false;
  if (setjmp(run().leave) == 0) {
    test.run();
  }
  return !run().failed;
}

}  // namespace

Registration::Registration(const char* name, Case body) : name_(name), run_(body), next_(selftest::run().first) {
  selftest::run().first = this;
}

void check(bool passed, const char* file, int line, const char* expression) {
  if (passed || run().failed) {
    return;
  }
  run().failed = true;
  image::print("FAILED ", run().case_name, ": ", file_name(file), ":", line, ": ", expression, "\n");
}

void leave_case() { std::longjmp(run().leave, 1); }

}  // namespace mellin::selftest

int main() {
  using namespace mellin;
  char arguments[128] = "";
  const char* wanted = "";
  if (board_arguments(arguments, sizeof arguments) == 0 && std::strchr(arguments, ' ') != nullptr) {
    wanted = std::strchr(arguments, ' ') + 1;
  }
  std::uint32_t passed = 0;
  std::uint32_t failed = 0;
  for (const selftest::Registration* test = selftest::run().first; test != nullptr; test = test->next()) {
    if (std::strstr(test->name(), wanted) == nullptr) {
      continue;
    }
    const std::uint64_t before = board_ticks();
    ++(selftest::passes(*test) ? passed : failed);
    if (*wanted != '\0' && board_ticks_per_million() != 0) {
      image::print((board_ticks() - before) / board_ticks_per_million(), " million instructions: ", test->name(), "\n");
    }
  }
  if (board_stack_size() > 0) {
    image::print("stack: ", board_stack_size() - board_stack_untouched(), " of ", board_stack_size(), " bytes used\n");
  }
  image::print(passed, " passed, ", failed, " failed\n");
  return failed == 0 && passed > 0 ? 0 : 1;
}
