// The features (spectra) of all digests, kept in RAM so that comparing two of them makes none.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/spectral/features.hpp"

namespace mellin {

class FeatureCache {
 public:
  /// Submap by submap; some 10 bytes x side^2 each.
  struct Memory {
    Span<float> images;
    Span<Complex> filters;
    Span<Complex> polar;
    Span<float> floors;
    Span<PictureCurvature> curvatures;
    Span<std::uint8_t> ready;
  };
  template <class A>
  static constexpr Memory carve(A& arena, const MatcherConfig& config, std::size_t slots) {
    return {arena.template take<float>(slots * Features::image_count(config), Part::digests),
            arena.template take<Complex>(slots * Features::filter_count(config), Part::digests),
            arena.template take<Complex>(slots * Features::polar_count(config), Part::digests),
            arena.template take<float>(slots, Part::digests),
            arena.template take<PictureCurvature>(slots, Part::digests),
            arena.template take<std::uint8_t>(slots, Part::digests)};
  }

  FeatureCache() = default;
  FeatureCache(const MatcherConfig& config, const Memory& memory) : config_(config), memory_(memory) {}

  /// Requires slot < the number carved, as all below.
  Features at(std::size_t slot) const {
    const std::size_t image = Features::image_count(config_);
    const std::size_t filter = Features::filter_count(config_);
    const std::size_t polar = Features::polar_count(config_);
    Features f;
    f.image = memory_.images.subspan(slot * image, image);
    f.filter = memory_.filters.subspan(slot * filter, filter);
    f.polar = memory_.polar.subspan(slot * polar, polar);
    f.floor = memory_.floors[slot];
    f.curvature = memory_.curvatures[slot];
    f.ready = memory_.ready[slot] != 0;
    return f;
  }
  /// `features` were extracted into the spans that at(slot) gave.
  void keep(std::size_t slot, const Features& features) {
    memory_.floors[slot] = features.floor;
    memory_.curvatures[slot] = features.curvature;
    memory_.ready[slot] = features.ready ? 1 : 0;
  }

 private:
  MatcherConfig config_;
  Memory memory_;
};

}  // namespace mellin
