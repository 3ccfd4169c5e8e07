// What each stage of the screening cascade drops and keeps, on the submaps of a whole drive: the pairs that became
// edges of the map without the cascade are those that it must not lose.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "host/mapping_run.hpp"
#include "mellin/config.hpp"

namespace mellin::host {

/// Counts of pairs that share no scans.
struct CascadeCounts {
  std::uint64_t pairs = 0;
  std::uint64_t dropped_coarse = 0;
  std::uint64_t dropped_rotation = 0;
  std::uint64_t cut_short = 0;
  std::uint64_t nearby = 0;  ///< by the graph as it was when they were screened: no stage drops them
  std::uint64_t candidates = 0;
  std::uint64_t edges = 0;       ///< pairs that are joined by a loop or merge edge …
  std::uint64_t edges_kept = 0;  ///< … and still are candidates
  double us_a_pair = 0.0;        ///< of the processor, by this thread
};

/// `config` with all that drops pairs or leaves out hypotheses turned off, and all rotation peaks tried.
Config without_cascade(Config config);

/// Screens each submap of a finished run against all before it, with the screening of `config`, whose sizes must be the
/// run's. Throws std::runtime_error where the library refuses it or a grid cannot be had.
CascadeCounts screen_all(MappingRun& run, const Config& config);

}  // namespace mellin::host
