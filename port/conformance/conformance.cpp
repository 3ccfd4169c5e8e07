#include "conformance/conformance.hpp"

namespace mellin::port {
namespace {

Outcome run(const Check& check, Subject& subject, const Reporter& reporter, Tally& tally) {
  const Finding finding = check.run(subject);
  tally.passed += finding.outcome == Outcome::passed ? 1U : 0U;
  tally.failed += finding.outcome == Outcome::failed ? 1U : 0U;
  tally.absent += finding.outcome == Outcome::absent ? 1U : 0U;
  reporter.result(reporter.context, check, finding);
  return finding.outcome;
}

}  // namespace

Tally check_board(Subject& subject, const Reporter& reporter) {
  Tally tally;
  for (const Check& check : machine_checks()) {
    (void)run(check, subject, reporter, tally);
  }
  for (const Check& check : service_checks()) {
    (void)run(check, subject, reporter, tally);
  }
  for (const Check& check : flash_checks()) {
    const bool first = &check == flash_checks().begin();
    if (run(check, subject, reporter, tally) != Outcome::passed && first) {
      break;
    }
  }
  return tally;
}

}  // namespace mellin::port
