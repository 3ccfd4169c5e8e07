// A flash in static memory, for boards without one: what lies in it is gone with the power.
#pragma once

#include "mellin/port.h"

namespace mellin::port {

/// 64 blocks of 4 KiB in section .bulk, erased at the first call; one device for the program.
mellin_flash static_flash();

}  // namespace mellin::port
