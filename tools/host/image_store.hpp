// A submap store over an image file, opened read-only with whatever configuration its blocks tell.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/heap_arena.hpp"
#include "mellin/store/submap_store.hpp"
#include "posix/flash_image.hpp"

namespace mellin::host {

class ImageStore {
 public:
  /// Throws std::runtime_error, naming the file, where it is no image or cannot be mounted.
  explicit ImageStore(const std::string& path);

  SubmapStore& store() { return store_; }
  const posix::ImageInfo& info() const { return info_; }
  const std::vector<std::string>& messages() const { return messages_; }  ///< of the store, while mounting

  /// The submap's cells. Throws std::runtime_error where the file fails; empty where its records are damaged.
  std::vector<std::uint8_t> fetch(SubmapId id);
  /// Of a kind and id that are there; the status says whether the bytes are right.
  Status read_blob(BlobKind kind, std::uint32_t id, std::vector<std::uint8_t>& out) const;

 private:
  std::string path_;
  posix::ImageInfo info_;
  posix::FlashImage image_;
  HeapArena memory_;
  std::vector<std::string> messages_;
  SubmapStore store_;
};

/// A line `id crc32` of stored.log.
struct StoredLine {
  SubmapId id = kNoSubmap;
  std::uint32_t crc32 = 0;
};

/// `id crc32`, the checksum as eight hexadecimal digits, without a newline.
std::string to_string(const StoredLine& line);

/// Reads a stored.log; throws std::runtime_error naming file and line. A last line that lacks its newline and is
/// incomplete is passed over: a power cut can leave one.
std::vector<StoredLine> read_stored(const std::string& path);

}  // namespace mellin::host
