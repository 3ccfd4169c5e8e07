#include "host/png_image.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

namespace mellin::host {

Picture::Picture(std::size_t w, std::size_t h, std::size_t c, std::uint8_t value)
    : width(w), height(h), channels(c), pixels(w * h * c, value) {
  if (c != 1 && c != 3) {
    throw std::invalid_argument("a picture has 1 or 3 channels, not " + std::to_string(c));
  }
}

Picture to_rgb(const Picture& grey) {
  Picture rgb(grey.width, grey.height, 3, 0);
  for (std::size_t i = 0; i < grey.width * grey.height; ++i) {
    std::fill_n(&rgb.pixels[3 * i], 3, grey.pixels[i * grey.channels]);
  }
  return rgb;
}

void draw_disc(Picture& picture, double x, double y, double radius, Colour colour) {
  if (!(std::fabs(x) < 1e6 && std::fabs(y) < 1e6 && radius >= 0.0 && radius < 1e4) || picture.channels != 3) {
    return;
  }
  const auto first = [](double v) { return static_cast<long>(std::floor(std::max(v, 0.0))); };
  const long x_end = std::min(static_cast<long>(picture.width), static_cast<long>(std::ceil(x + radius)) + 1);
  const long y_end = std::min(static_cast<long>(picture.height), static_cast<long>(std::ceil(y + radius)) + 1);
  for (long row = first(y - radius - 1.0); row < y_end; ++row) {
    for (long column = first(x - radius - 1.0); column < x_end; ++column) {
      const double dx = static_cast<double>(column) + 0.5 - x;
      const double dy = static_cast<double>(row) + 0.5 - y;
      if (dx * dx + dy * dy <= std::max(radius * radius, 0.5)) {
        std::copy(colour.begin(), colour.end(),
                  picture.at(static_cast<std::size_t>(column), static_cast<std::size_t>(row)));
      }
    }
  }
}

void draw_line(Picture& picture, double x0, double y0, double x1, double y1, Colour colour, int thickness) {
  const auto near = [](double v) { return std::fabs(v) < 1e6; };
  if (!(near(x0) && near(y0) && near(x1) && near(y1))) {
    return;
  }
  const double length = std::max(std::fabs(x1 - x0), std::fabs(y1 - y0));
  const auto steps = static_cast<std::size_t>(std::ceil(length));
  for (std::size_t i = 0; i <= steps; ++i) {
    const double share = steps == 0 ? 0.0 : static_cast<double>(i) / static_cast<double>(steps);
    draw_disc(picture, x0 + share * (x1 - x0), y0 + share * (y1 - y0), thickness / 2.0, colour);
  }
}

std::string encode_png(const Picture& picture) {
  if (picture.width == 0 || picture.height == 0 ||
      picture.pixels.size() != picture.width * picture.height * picture.channels) {
    throw std::runtime_error("an empty picture has no PNG");
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = picture.channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.pixels.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("libpng: ") + image.message);
  }
  bytes.resize(size);
  return bytes;
}

std::string encode_pgm(const Picture& grey) {
  if (grey.channels != 1) {
    throw std::invalid_argument("a PGM picture has one channel");
  }
  std::string bytes = "P5\n" + std::to_string(grey.width) + " " + std::to_string(grey.height) + "\n255\n";
  bytes.append(reinterpret_cast<const char*>(grey.pixels.data()), grey.pixels.size());
  return bytes;
}

std::string encode_base64(const std::string& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = (group << 8U) | (k < count ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? kDigits[(group >> (18U - 6U * static_cast<unsigned>(k))) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace mellin::host
