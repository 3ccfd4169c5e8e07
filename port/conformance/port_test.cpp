// The conformance test of a board: a line for each check that fails, one for each part that the board does not have,
// the hello test, and last `N passed, N failed`, which is also the exit status. Erases what is in the port's flash.
#include "board.h"
#include "board_port.h"
#include "conformance/conformance.hpp"
#include "conformance/hello.hpp"
#include "images/print.hpp"

namespace {

using namespace mellin;

void print_result(void*, const port::Check& check, const port::Finding& finding) {
  const char* const text = finding.text.text();
  const bool silent = *text == '\0';
  switch (finding.outcome) {
    case port::Outcome::failed:
      image::print("FAILED ", check.name, ": expected: ", check.contract, "; found: ", text, "\n");
      break;
    case port::Outcome::absent:
      image::print("absent ", check.name, silent ? "" : ": ", text, "\n");
      break;
    case port::Outcome::passed:
      image::print("passed ", check.name, silent ? "" : ": ", text, "\n");
      break;
  }
}

}  // namespace

int main() {
  static port::Subject subject;
  subject.port = board_port();
  subject.board = {board_stack_size, board_stack_untouched};
  port::Tally tally = port::check_board(subject, {nullptr, print_result});
  if (tally.failed == 0) {
    ++(image::hello(subject.port) ? tally.passed : tally.failed);
  } else {
    image::print("hello: not run, since checks failed\n");
  }
  if (board_stack_size() > 0) {
    image::print("stack: ", board_stack_size() - board_stack_untouched(), " of ", board_stack_size(), " bytes used\n");
  }
  image::print(tally.passed, " passed, ", tally.failed, " failed\n");
  return tally.failed == 0 ? 0 : 1;
}
