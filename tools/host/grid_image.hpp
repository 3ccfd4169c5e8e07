// Occupancy grids from pictures as map_server writes them: dark occupied, light free, grey value 205 unobserved.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace mellin::host {

/// The largest width or height that is read, pixels.
inline constexpr std::size_t kMaxPictureSide = 8192;

/// A grid of submap cells (grid/submap.hpp: 255 unobserved, else round(254 * how occupied)), not necessarily square.
/// Cell (column, row) lies at cells[row * width + column], row 0 at the bottom of the picture.
struct OccupancyImage {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint8_t> cells;
};

/// Reads a PGM (P2, P5, 8 or 16 bits) or PNG (any kind; colours become grey, transparent pixels unobserved). Throws
/// std::runtime_error "path: expected …, found …" where the file is no such picture, is cut short, or is larger than
/// kMaxPictureSide.
OccupancyImage read_occupancy_image(const std::string& path);

/// Marks as unobserved what the mask picture (PGM or PNG of the same size) shows dark, and as observed what it shows
/// light. Throws std::runtime_error as above, or where the sizes differ.
void apply_mask(OccupancyImage& image, const std::string& mask_path);

}  // namespace mellin::host
