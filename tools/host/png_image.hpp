// Pictures in memory, 8 bits a channel, and their PNG and PGM encodings.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace mellin::host {

/// Row 0 is the top one. Pixel (x, y)'s channel c lies at pixels[(y * width + x) * channels + c].
struct Picture {
  std::size_t width = 0;
  std::size_t height = 0;
  std::size_t channels = 1;  ///< 1: grey, 3: red, green, blue
  std::vector<std::uint8_t> pixels;

  Picture() = default;
  /// All pixels have this value in every channel. Throws std::invalid_argument for other than 1 or 3 channels.
  Picture(std::size_t width, std::size_t height, std::size_t channels, std::uint8_t value);

  std::uint8_t* at(std::size_t x, std::size_t y) { return &pixels[(y * width + x) * channels]; }
  const std::uint8_t* at(std::size_t x, std::size_t y) const { return &pixels[(y * width + x) * channels]; }
};

using Colour = std::array<std::uint8_t, 3>;

/// A grey picture in three channels.
Picture to_rgb(const Picture& grey);

/// Draws a line between pixel positions, `thickness` pixels wide; parts outside the picture are left out. Positions
/// beyond a million pixels, or not finite, draw nothing. The picture has 3 channels.
void draw_line(Picture& picture, double x0, double y0, double x1, double y1, Colour colour, int thickness = 1);

/// Draws a filled disc; parts outside the picture are left out.
void draw_disc(Picture& picture, double x, double y, double radius, Colour colour);

/// The PNG file of a picture. Throws std::runtime_error where the picture is empty or libpng fails.
std::string encode_png(const Picture& picture);

/// The binary PGM file (P5) of a grey picture. Throws std::invalid_argument where it is not grey.
std::string encode_pgm(const Picture& grey);

/// RFC 4648, for pictures inside a page.
std::string encode_base64(const std::string& bytes);

}  // namespace mellin::host
