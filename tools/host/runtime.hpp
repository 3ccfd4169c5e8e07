// What the stages of place recognition take, on submaps, and beside them, in the same run, what the transforms in them
// would take by FFTW (the paper's Table I). Times are medians of the processor's time, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/eval_submaps.hpp"

namespace mellin::host {

struct RuntimeRow {
  std::string stage;          ///< extract, screen or register
  std::uint16_t side_px = 0;  ///< of the digests or pictures
  std::uint8_t peaks = 0;     ///< rotation peaks tried, each with beta and beta + 180 degrees; 0 where there are none
  double us = 0.0;
  double fft_us = 0.0;         ///< one real 2D FFT of that side by FFTW: float, FFTW_MEASURE
  std::size_t transforms = 0;  ///< of that side that the stage cannot do without
};

/// How many submaps a query is screened against: what is made of the query alone is spread over so many.
inline constexpr std::size_t kRuntimeCollection = 200;

/// A drive through a simulated building, for those who have no log.
LiveDrive simulated_drive();

/// Some kRuntimeCollection submaps of 40 scans, in random orientations, as evenly spread over the drives as it goes.
/// Throws std::runtime_error where there are too few to compare.
std::vector<EvalSubmap> runtime_submaps(const std::vector<LiveDrive>& drives, std::uint64_t seed);

/// extract: a submap of 768 x 768 cells to its digest of a side and that digest's spectra; screen: a pair of digests as
/// the collection compares it, verification included, the query's own work spread over the submaps; register: a pair of
/// pictures by the matcher, features at hand. Every rotation peak up to the number is tried, however low.
std::vector<RuntimeRow> measure_runtime(const std::vector<EvalSubmap>& submaps);

}  // namespace mellin::host
