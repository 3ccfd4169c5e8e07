// The port's clock on a POSIX host.
#pragma once

#include "mellin/port.h"

namespace mellin::posix {

/// CLOCK_MONOTONIC in microseconds.
mellin_clock monotonic_clock();

}  // namespace mellin::posix
