// The hello test: the library itself on a board, over the board's own port.
#pragma once

#include "mellin/port.h"

namespace mellin::image {

/// Erases the flash, maps 30 scans of a small room in the nano profile, stores what came of it, starts again over the
/// same flash, and finds its submaps there as they were. Prints lines that start with `hello:`. Returns whether all of
/// it went well.
bool hello(const mellin_port& port);

}  // namespace mellin::image
