// How often a randomised test tries: on an emulated microcontroller, a fiftieth as fast as the host, a twentieth as
// often.
#pragma once

namespace mellin::test {

/// `count` on a host, fewer on a target, at least one.
constexpr int trials(int count) {
#ifdef MELLIN_ON_TARGET
  return count < 20 ? 1 : count / 20;
#else
  return count;
#endif
}

}  // namespace mellin::test
