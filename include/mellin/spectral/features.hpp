// A picture as the spectral matcher needs it, made once and kept between matches.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mellin/core/arena.hpp"
#include "mellin/core/span.hpp"
#include "mellin/spectral/fft2.hpp"
#include "mellin/spectral/matcher_config.hpp"

namespace mellin {

/// What a picture's features are kept for: to be `a` of a match takes filter and polar, to be `b` image and polar.
enum class FeatureUse : std::uint8_t { as_a, as_b, both };

/// Second differences of a picture's correlation with itself at no shift, turned positive, as shares of its value
/// there: how sharply the picture can tell where it lies. A corridor's are small along it.
struct PictureCurvature {
  float xx = 0.0F;
  float xy = 0.0F;
  float yy = 0.0F;
};

/// A picture as the matcher needs it, over the caller's memory. Kept between matches as long as the caller likes; may
/// be copied with its memory. Empty spans are left out by extract().
struct Features {
  Span<float> image;     ///< seamless picture, side * side; MatcherConfig::masked: then what was observed, 0 or 1
  Span<Complex> filter;  ///< whitened spectrum times low-pass, spectrum_size(side); masked: three spectra instead, of
                         ///< the picture where observed, of the mask, of the picture's square where observed
  Span<Complex> polar;   ///< what the rotation is found by, see RotationEstimator; polar_count(config)
  float floor = 0.0F;    ///< what is added to magnitudes when a turned copy is whitened
  PictureCurvature curvature;
  bool ready = false;  ///< extract() has succeeded

  static constexpr std::size_t image_count(const MatcherConfig& config) {
    return (config.masked ? 2U : 1U) * std::size_t{config.side} * config.side;
  }
  static constexpr std::size_t filter_count(const MatcherConfig& config) {
    return (config.masked ? 3U : 1U) * spectrum_size(config.side);
  }
  static constexpr std::size_t polar_count(const MatcherConfig& config) {
    return config.rotation == RotationMode::rings ? std::size_t{config.side} / 2U * (config.side / 2U + 1U)
                                                  : spectrum_size(config.side);
  }

  template <class A>
  static constexpr Features carve(A& arena, const MatcherConfig& config, FeatureUse use = FeatureUse::both,
                                  Part part = Part::spectral) {
    Features f;
    if (use != FeatureUse::as_a) {
      f.image = arena.template take<float>(image_count(config), part);
    }
    if (use != FeatureUse::as_b) {
      f.filter = arena.template take<Complex>(filter_count(config), part);
    }
    f.polar = arena.template take<Complex>(polar_count(config), part);
    return f;
  }
};

/// Bytes that one picture's features take from an arena.
constexpr std::size_t required_bytes(const MatcherConfig& config, FeatureUse use) {
  MeasureArena measure;
  Features::carve(measure, config, use);
  return measure.use().total();
}

}  // namespace mellin
