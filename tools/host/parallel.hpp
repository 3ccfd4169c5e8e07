// Independent jobs side by side.
#pragma once

#include <cstddef>
#include <functional>

namespace mellin::host {

/// Calls job(worker, index) once for each index below `count`, on `threads` threads at most; `worker` is below
/// `threads`, and no two calls of one worker run at once. Which worker takes which index is left open: results that are
/// kept by index do not depend on the number of threads. The first exception of a job is thrown again, when all
/// threads have stopped.
void in_parallel(std::size_t threads, std::size_t count, const std::function<void(std::size_t, std::size_t)>& job);

}  // namespace mellin::host
