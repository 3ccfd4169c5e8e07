// The port's entropy on a POSIX host.
#pragma once

#include "mellin/port.h"

namespace mellin::posix {

/// The kernel's random numbers (getrandom). Fails with -1 where they are not to be had.
mellin_entropy system_entropy();

}  // namespace mellin::posix
