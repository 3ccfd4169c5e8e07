#include "host/grid_image.hpp"

#include <png.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "mellin/grid/submap.hpp"

namespace mellin::host {
namespace {

constexpr std::uint8_t kUnobservedGrey = 205;
constexpr std::uint8_t kFreeGrey = 254;
constexpr std::uint8_t kHalf = 128;

/// Grey values from the top row down.
struct Grey {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint8_t> pixels;
};

[[noreturn]] void fail(const std::string& path, const std::string& expected, const std::string& found) {
  throw std::runtime_error(path + ": expected " + expected + ", found " + found);
}

std::string read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file.is_open() || file.bad()) {
    fail(path, "a readable file", std::strerror(errno));
  }
  return bytes;
}

void check_size(const std::string& path, std::size_t width, std::size_t height) {
  if (width == 0 || height == 0 || width > kMaxPictureSide || height > kMaxPictureSide) {
    fail(path, "1 to " + std::to_string(kMaxPictureSide) + " pixels a side",
         std::to_string(width) + " x " + std::to_string(height));
  }
}

/// The numbers of a PGM: separated by white space, with comments from # to the end of the line.
class PgmReader {
 public:
  PgmReader(const std::string& path, const std::string& bytes) : path_(path), bytes_(bytes) {}

  Grey read() {
    const bool binary = bytes_[1] == '5';
    at_ = 2;
    Grey grey;
    grey.width = number("a width");
    grey.height = number("a height");
    check_size(path_, grey.width, grey.height);
    const std::size_t largest = number("a maximum value");
    if (largest == 0 || largest > 65535) {
      fail(path_, "a maximum value from 1 to 65535", std::to_string(largest));
    }
    const std::size_t count = grey.width * grey.height;
    const std::size_t sample_bytes = largest > 255 ? 2 : 1;
    if (binary) {
      ++at_;  // the one white space that ends the header
      if (at_ > bytes_.size() || bytes_.size() - at_ < count * sample_bytes) {
        fail(path_, std::to_string(count * sample_bytes) + " bytes of pixels",
             std::to_string(bytes_.size() - std::min(at_, bytes_.size())));
      }
    }
    grey.pixels.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t value = binary ? sample(sample_bytes) : number("pixel " + std::to_string(i));
      if (value > largest) {
        fail(path_, "pixels up to " + std::to_string(largest), std::to_string(value));
      }
      grey.pixels.push_back(static_cast<std::uint8_t>((value * 255 + largest / 2) / largest));
    }
    return grey;
  }

 private:
  std::size_t sample(std::size_t size) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      value = value * 256 + static_cast<unsigned char>(bytes_[at_++]);
    }
    return value;
  }

  std::size_t number(const std::string& what) {
    skip_space();
    std::size_t value = 0;
    const std::size_t start = at_;
    while (at_ < bytes_.size() && bytes_[at_] >= '0' && bytes_[at_] <= '9' && at_ - start < kMostDigits) {
      value = value * 10 + static_cast<std::size_t>(bytes_[at_++] - '0');
    }
    if (at_ == start) {
      fail(path_, what,
           at_ < bytes_.size() ? "byte " + std::to_string(at_) + " that is no digit" : "the end of the file");
    }
    return value;
  }

  void skip_space() {
    while (at_ < bytes_.size()) {
      if (bytes_[at_] == '#') {
        while (at_ < bytes_.size() && bytes_[at_] != '\n') {
          ++at_;
        }
      } else if (std::strchr(" \t\r\n\v\f", bytes_[at_]) != nullptr && bytes_[at_] != '\0') {
        ++at_;
      } else {
        return;
      }
    }
  }

  static constexpr std::size_t kMostDigits = 9;
  const std::string& path_;
  const std::string& bytes_;
  std::size_t at_ = 0;
};

/// Transparent pixels come back as kUnobservedGrey.
Grey read_png(const std::string& path, const std::string& bytes) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
    fail(path, "a PNG picture", image.message);
  }
  const Grey size{image.width, image.height, {}};
  if (size.width > kMaxPictureSide || size.height > kMaxPictureSide) {
    png_image_free(&image);
    check_size(path, size.width, size.height);
  }
  image.format = PNG_FORMAT_GA;
  std::vector<std::uint8_t> pairs(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, pairs.data(), 0, nullptr) == 0) {
    fail(path, "a whole PNG picture", image.message);
  }
  Grey grey = size;
  for (std::size_t i = 0; i < pairs.size(); i += 2) {
    grey.pixels.push_back(pairs[i + 1] < kHalf ? kUnobservedGrey : pairs[i]);
  }
  return grey;
}

Grey read_grey(const std::string& path) {
  const std::string bytes = read_bytes(path);
  if (bytes.starts_with("\x89PNG")) {
    return read_png(path, bytes);
  }
  if (bytes.starts_with("P5") || bytes.starts_with("P2")) {
    return PgmReader(path, bytes).read();
  }
  fail(path, "a PGM (P2, P5) or PNG picture", bytes.empty() ? "an empty file" : "other content");
}

/// 254 where the picture is black, 0 where it is as light as free space.
std::uint8_t occupied_share(std::uint8_t grey) {
  return grey >= kFreeGrey ? 0 : static_cast<std::uint8_t>(kFreeGrey - grey);
}

}  // namespace

OccupancyImage read_occupancy_image(const std::string& path) {
  const Grey grey = read_grey(path);
  OccupancyImage image{grey.width, grey.height, {}};
  image.cells.reserve(grey.pixels.size());
  for (std::size_t row = 0; row < grey.height; ++row) {
    const std::size_t start = (grey.height - 1 - row) * grey.width;
    for (std::size_t column = 0; column < grey.width; ++column) {
      const std::uint8_t value = grey.pixels[start + column];
      image.cells.push_back(value == kUnobservedGrey ? kUnobserved : occupied_share(value));
    }
  }
  return image;
}

void apply_mask(OccupancyImage& image, const std::string& mask_path) {
  const Grey mask = read_grey(mask_path);
  if (mask.width != image.width || mask.height != image.height) {
    fail(mask_path, std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels like the grid's",
         std::to_string(mask.width) + " x " + std::to_string(mask.height));
  }
  for (std::size_t row = 0; row < image.height; ++row) {
    for (std::size_t column = 0; column < image.width; ++column) {
      std::uint8_t& cell = image.cells[row * image.width + column];
      if (mask.pixels[(image.height - 1 - row) * image.width + column] < kHalf) {
        cell = kUnobserved;
      } else if (cell == kUnobserved) {
        cell = occupied_share(kUnobservedGrey);
      }
    }
  }
}

}  // namespace mellin::host
