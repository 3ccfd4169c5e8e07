// Writes what `mellin map` leaves in its folder, from a finished run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/mapping_run.hpp"
#include "host/summary.hpp"

namespace mellin::host {

struct OutputFigures {
  double total_seconds = 0.0;
  std::uint64_t heap_allocations = 0;  ///< inside library calls
  std::vector<std::string> remarks;    ///< shown in the report
};

/// Writes all files; returns the summary that was written. Throws std::runtime_error where a file cannot be written.
Summary write_outputs(MappingRun& run, const std::string& directory, const OutputFigures& figures);

}  // namespace mellin::host
