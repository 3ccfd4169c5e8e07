// The checks of clock, entropy and log sink.
#include <cstring>

#include "conformance/conformance.hpp"

namespace mellin::port {
namespace {

Finding failure(const LogLine& text) { return {Outcome::failed, text}; }

/// Reads the clock until it has advanced often enough, and measures its smallest step: a clock that a slow interrupt
/// counts up passes too.
Finding clock_runs(Subject& subject) {
  constexpr std::uint32_t kReads = 2'000'000;
  constexpr std::uint32_t kSteps = 1000;
  constexpr std::uint32_t kStepsNeeded = 2;
  const mellin_clock& clock = subject.port.clock;
  if (clock.now_us == nullptr) {
    return {Outcome::absent, LogLine() << "now_us is a null pointer: no times are measured"};
  }
  std::uint64_t last = clock.now_us(clock.context);
  std::uint64_t resolution = ~std::uint64_t{0};
  std::uint32_t steps = 0;
  for (std::uint32_t i = 0; i < kReads && steps < kSteps; ++i) {
    const std::uint64_t now = clock.now_us(clock.context);
    if (now < last) {
      return failure(LogLine() << now << " us came after " << last << " us");
    }
    if (now > last) {
      ++steps;
      resolution = now - last < resolution ? now - last : resolution;
    }
    last = now;
  }
  if (steps < kStepsNeeded) {
    return failure(LogLine() << "it stood at " << last << " us for " << kReads << " reads");
  }
  return {Outcome::passed, LogLine() << "its smallest step is " << resolution << " us"};
}

Finding entropy_fills(Subject& subject) {
  constexpr std::uint32_t kSize = 33;
  constexpr std::uint32_t kTrials = 8;
  const mellin_entropy& entropy = subject.port.entropy;
  if (entropy.fill == nullptr) {
    return {Outcome::absent, LogLine() << "fill is a null pointer: UUIDs of sessions come from the seed"};
  }
  std::uint8_t first[kSize] = {};
  bool changed[kSize] = {};
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    std::memset(subject.in, 0xA5, sizeof subject.in);
    const int result = entropy.fill(entropy.context, subject.in, kSize);
    if (result != 0) {
      return failure(LogLine() << "fill returned " << std::int32_t{result});
    }
    if (subject.in[kSize] != 0xA5) {
      return failure(LogLine() << "a byte behind the " << kSize << " asked for was written");
    }
    for (std::uint32_t i = 0; i < kSize; ++i) {
      changed[i] = changed[i] || (trial > 0 && subject.in[i] != first[i]);
      first[i] = trial == 0 ? subject.in[i] : first[i];
    }
  }
  for (std::uint32_t i = 0; i < kSize; ++i) {
    if (!changed[i]) {
      return failure(LogLine() << "byte " << i << " was " << std::uint32_t{first[i]} << " in each of " << kTrials
                               << " calls");
    }
  }
  return {};
}

/// Bytes of one call that are alike, or count up, are not unpredictable either.
Finding entropy_varies(Subject& subject) {
  constexpr std::uint32_t kSize = 32;
  const mellin_entropy& entropy = subject.port.entropy;
  if (entropy.fill == nullptr) {
    return {Outcome::absent, LogLine()};
  }
  if (entropy.fill(entropy.context, subject.in, kSize) != 0) {
    return failure(LogLine() << "fill failed");
  }
  std::uint32_t alike = 0;
  for (std::uint32_t i = 2; i < kSize; ++i) {
    const auto step = static_cast<std::uint8_t>(subject.in[i] - subject.in[i - 1]);
    const auto step_before = static_cast<std::uint8_t>(subject.in[i - 1] - subject.in[i - 2]);
    alike += step == step_before ? 1U : 0U;
  }
  // Of random bytes one step in 256 is like the one before: more than half of 30 would be one case in 10^28.
  return alike > kSize / 2 ? failure(LogLine() << "the bytes of a call are all alike or count up") : Finding{};
}

Finding log_prints(Subject& subject) {
  const mellin_log& log = subject.port.log;
  if (log.write == nullptr) {
    return {Outcome::absent, LogLine() << "write is a null pointer: nobody reads why a configuration is refused"};
  }
  log.write(log.context, MELLIN_LOG_DEBUG, "a line of the log sink, level debug");
  log.write(log.context, MELLIN_LOG_INFO, "a line of the log sink, level info");
  log.write(log.context, MELLIN_LOG_WARNING, "a line of the log sink, level warning");
  return {Outcome::passed, LogLine() << "look for its three lines above; a sink may leave out levels"};
}

constexpr Check kChecks[] = {
    {"clock.runs", "now_us advances and never goes back", clock_runs},
    {"entropy.fills", "fill writes just the bytes asked for, others in each call, and returns 0", entropy_fills},
    {"entropy.varies", "fill writes unpredictable bytes", entropy_varies},
    {"log.prints", "write takes a zero-terminated line of any level", log_prints},
};

}  // namespace

Span<const Check> service_checks() { return {kChecks, sizeof kChecks / sizeof *kChecks}; }

}  // namespace mellin::port
