#include "host/grid_registration.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>

#include "host/heap_arena.hpp"
#include "mellin/collection/registration.hpp"

namespace mellin::host {
namespace {

constexpr double kRegistrationPixel_m = 0.2;  // coarse enough to be robust, fine enough for alignment's capture range
constexpr double kVerificationCell_m = 0.2;   // where verification discriminates best
constexpr std::size_t kFewestPixels = 96;
constexpr std::size_t kMostPixels = 1024;

void require(Status status, const char* what) {
  if (status != Status::ok) {
    throw std::runtime_error(std::string(what) + ": " + to_string(status));
  }
}

/// Sides for both padded grids: `pixels` of the matcher times a power of two.
struct Sides {
  std::uint16_t pixels = 0;
  std::uint16_t cells = 0;
  std::uint16_t classes = 0;
};

/// `halvings` of the padded grid to the picture that is registered. None where no transform is that large.
std::optional<Sides> sides_for(std::size_t largest, unsigned halvings, double resolution_m) {
  const std::size_t fewest = std::max<std::size_t>((largest + (1U << halvings) - 1) >> halvings, kFewestPixels / 2);
  for (std::size_t pixels = (fewest + 3) / 4 * 4; pixels <= kMostPixels; pixels += 4) {
    if (is_fft_side(static_cast<std::uint32_t>(pixels)) && (pixels << halvings) <= 0xFFFF) {
      const std::size_t cells = pixels << halvings;
      std::size_t block = 1;
      while (resolution_m * 2.0 * static_cast<double>(block) <= kVerificationCell_m * 1.01 &&
             cells % (4 * block) == 0) {
        block *= 2;
      }
      return Sides{static_cast<std::uint16_t>(pixels), static_cast<std::uint16_t>(cells),
                   static_cast<std::uint16_t>(cells / block)};
    }
  }
  return std::nullopt;
}

/// Halvings that bring a cell near kRegistrationPixel_m, with enough pixels left.
unsigned halvings_for(std::size_t largest, double resolution_m) {
  unsigned halvings = 0;
  while (resolution_m * 2.0 * (1U << halvings) <= kRegistrationPixel_m * 1.01 &&
         (largest >> (halvings + 1)) >= kFewestPixels) {
    ++halvings;
  }
  while ((largest >> halvings) > kMostPixels) {
    ++halvings;
  }
  return halvings;
}

PaddedGrid pad(const OccupancyImage& image, std::uint16_t side, double resolution_m) {
  PaddedGrid padded{
      std::vector<std::uint8_t>(std::size_t{side} * side, kUnobserved), side, static_cast<float>(resolution_m), {}};
  const std::size_t left = (side - image.width) / 2;
  const std::size_t below = (side - image.height) / 2;
  for (std::size_t row = 0; row < image.height; ++row) {
    std::copy_n(image.cells.begin() + static_cast<std::ptrdiff_t>(row * image.width), image.width,
                padded.cells.begin() + static_cast<std::ptrdiff_t>((row + below) * side + left));
  }
  const double half = 0.5 * side;
  padded.centre_T_corner = {(static_cast<double>(left) - half) * resolution_m,
                            (static_cast<double>(below) - half) * resolution_m, 0.0};
  return padded;
}

}  // namespace

RegistrationConfig grid_registration_config(std::size_t largest, double resolution_m) {
  const std::optional<Sides> sides = sides_for(largest, halvings_for(largest, resolution_m), resolution_m);
  if (!sides) {
    throw std::invalid_argument("the grids are too large");
  }
  RegistrationConfig config;
  config.grid_side = sides->cells;
  config.class_side = sides->classes;
  config.matcher.side = sides->pixels;
  config.matcher.pixel_m = static_cast<float>(resolution_m * sides->cells / sides->pixels);
  config.aligned = kMaxPlaceHypotheses;
  return config;
}

PaddedPair pad(const OccupancyImage& a, const OccupancyImage& b, double resolution_m) {
  if (!(resolution_m >= kFinestResolution_m && resolution_m <= kCoarsestResolution_m)) {
    throw std::invalid_argument("the resolution is from 0.0001 to 100 m a cell");
  }
  PaddedPair pair;
  pair.config = grid_registration_config(std::max({a.width, a.height, b.width, b.height}), resolution_m);
  pair.a = pad(a, pair.config.grid_side, resolution_m);
  pair.b = pad(b, pair.config.grid_side, resolution_m);
  return pair;
}

std::vector<GridHypothesis> register_grids(const PaddedPair& pair) {
  HeapArena memory;
  SpectralRegistration registration;
  require(registration.init(pair.config,
                            memory.carve([&](auto& arena) { return SpectralRegistration::carve(arena, pair.config); })),
          "registration");
  require(registration.set_query(pair.b.view()), "grid B");
  require(registration.begin(pair.a.view()), "grid A");
  while (!registration.step()) {
  }
  std::vector<GridHypothesis> hypotheses;
  for (const PlaceHypothesis& place : registration.hypotheses()) {
    hypotheses.push_back({pair.between_corners(place.a_T_b), static_cast<double>(place.confidence),
                          static_cast<double>(place.peak), static_cast<double>(place.agreement)});
  }
  return hypotheses;
}

std::vector<GridHypothesis> register_grids(const OccupancyImage& a, const OccupancyImage& b, double resolution_m) {
  return register_grids(pad(a, b, resolution_m));
}

}  // namespace mellin::host
