// The highest peaks of a correlation surface that is looked at row by row and never stored. Along a corridor, or where
// rooms repeat, the right shift is often not the highest peak but among the next ones (IV-B3); what was observed
// decides then.
#pragma once

#include <cstddef>

#include "mellin/core/containers.hpp"
#include "mellin/core/span.hpp"
#include "mellin/spectral/fft2.hpp"
#include "mellin/spectral/matcher_config.hpp"

namespace mellin {

class SurfacePeaks {
 public:
  /// Peaks closer than this in both coordinates are one, pixels.
  static constexpr std::size_t kApart = 3;

  /// For a cyclic surface of `side` rows; keeps the `most` (at most kMaxTranslationPeaks) highest, all of them over 0.
  void begin(std::size_t side, std::size_t most) {
    side_ = side;
    most_ = most;
    peaks_.clear();
  }
  /// Looks at a row; each once, in any order. O(side), and O(most) more for each local maximum that is kept.
  void add_row(std::size_t row, Span<const float> values);
  /// Takes a peak that is already known to be the highest.
  void add(const Fft2::Peak& peak);

  std::size_t size() const { return peaks_.size(); }
  /// Highest first.
  const Fft2::Peak& operator[](std::size_t i) const { return peaks_[i]; }

 private:
  std::size_t side_ = 0;
  std::size_t most_ = 0;
  FixedList<Fft2::Peak, kMaxTranslationPeaks> peaks_;
};

}  // namespace mellin
