// Flash on a host: over an image file that outlives the program. As strict as the real thing: what was
// not erased since it was last programmed cannot be programmed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mellin/port.h"
#include "mellin/store/flash_format.hpp"
#include "ramflash/flash_model.hpp"

namespace mellin::posix {

using port::FlashCounts;
using port::FlashGeometry;

/// An image file. Calls of the mellin_flash return -1 for what the contract excludes (unaligned or out of the device,
/// programming what was not erased) and -2 where the file fails.
class FlashImage {
 public:
  /// Opens the image, or creates it erased (0xFF). Throws std::runtime_error, naming the file, where it cannot be
  /// opened, or its size is not that of the geometry, or the geometry is none.
  FlashImage(const std::string& path, const FlashGeometry& geometry, bool read_only = false);
  ~FlashImage();
  FlashImage(const FlashImage&) = delete;
  FlashImage& operator=(const FlashImage&) = delete;

  /// Valid as long as this object.
  mellin_flash flash();
  const FlashCounts& counts() const { return counts_; }
  bool created() const { return created_; }

 private:
  static int read(void* context, std::uint32_t address, void* buffer, std::uint32_t size);
  static int program(void* context, std::uint32_t address, const void* data, std::uint32_t size);
  static int erase(void* context, std::uint32_t block);
  static int sync(void* context);
  void create();

  std::string path_;
  FlashGeometry geometry_;
  FlashCounts counts_;
  std::vector<std::uint8_t> scratch_;
  int file_ = -1;
  bool created_ = false;
  bool read_only_ = false;
};

/// What an image says about itself.
struct ImageInfo {
  FlashGeometry geometry;
  BlockHeader newest;  ///< of the blocks' headers, the one with the highest sequence
};

/// Looks for block headers in an image. Throws std::runtime_error, naming the file, where it cannot be read, holds
/// none, or has not the size that they tell.
ImageInfo probe_image(const std::string& path);

}  // namespace mellin::posix
