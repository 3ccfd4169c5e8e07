#include "posix/flash_image.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace mellin::posix {
namespace {

constexpr int kRefused = -1;
constexpr int kFileError = -2;
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 32U;

/// pread and pwrite may do less than they were asked for.
bool read_all(int file, std::uint8_t* buffer, std::size_t size, std::uint64_t at) {
  while (size > 0) {
    const ssize_t got = ::pread(file, buffer, size, static_cast<off_t>(at));
    if (got <= 0) {
      if (got < 0 && errno == EINTR) {
        continue;
      }
      return false;
    }
    buffer += got;
    size -= static_cast<std::size_t>(got);
    at += static_cast<std::uint64_t>(got);
  }
  return true;
}

bool write_all(int file, const std::uint8_t* buffer, std::size_t size, std::uint64_t at) {
  while (size > 0) {
    const ssize_t put = ::pwrite(file, buffer, size, static_cast<off_t>(at));
    if (put < 0) {
      if (errno == EINTR) {
        continue;
      }
      return false;
    }
    buffer += put;
    size -= static_cast<std::size_t>(put);
    at += static_cast<std::uint64_t>(put);
  }
  return true;
}

std::uint64_t file_size(int file) {
  struct stat info {};
  return ::fstat(file, &info) == 0 && info.st_size > 0 ? static_cast<std::uint64_t>(info.st_size) : 0;
}

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

}  // namespace

FlashImage::FlashImage(const std::string& path, const FlashGeometry& geometry, bool read_only)
    : path_(path), geometry_(geometry), scratch_(geometry.block_size), read_only_(read_only) {
  if (!geometry.valid()) {
    fail(path, "the flash geometry contradicts itself");
  }
  file_ = ::open(path.c_str(), (read_only ? O_RDONLY : O_RDWR | O_CREAT) | O_CLOEXEC, 0644);
  if (file_ < 0) {
    fail(path, std::string("cannot be opened: ") + std::strerror(errno));
  }
  const std::uint64_t size = file_size(file_);
  if (size == 0 && !read_only) {
    create();
  } else if (size != geometry.bytes()) {
    ::close(file_);
    fail(path,
         "expected a flash image of " + std::to_string(geometry.bytes()) + " bytes, found " + std::to_string(size));
  }
}

FlashImage::~FlashImage() { ::close(file_); }

void FlashImage::create() {
  created_ = true;
  std::fill(scratch_.begin(), scratch_.end(), port::kErasedByte);
  for (std::uint32_t block = 0; block < geometry_.block_count; ++block) {
    if (!write_all(file_, scratch_.data(), scratch_.size(), std::uint64_t{block} * geometry_.block_size)) {
      const std::string why = std::strerror(errno);
      ::close(file_);
      fail(path_, "cannot be written: " + why);
    }
  }
  ::fsync(file_);
}

mellin_flash FlashImage::flash() {
  mellin_flash flash = port::describe(this, geometry_);
  flash.read = read;
  flash.program = program;
  flash.erase = erase;
  flash.sync = sync;
  return flash;
}

int FlashImage::read(void* context, std::uint32_t address, void* buffer, std::uint32_t size) {
  const auto& self = *static_cast<const FlashImage*>(context);
  if (!self.geometry_.inside(address, size)) {
    return kRefused;
  }
  return read_all(self.file_, static_cast<std::uint8_t*>(buffer), size, address) ? 0 : kFileError;
}

int FlashImage::program(void* context, std::uint32_t address, const void* data, std::uint32_t size) {
  auto& self = *static_cast<FlashImage*>(context);
  if (!self.geometry_.programmable(address, size) || self.read_only_) {
    return kRefused;
  }
  if (self.scratch_.size() < size) {
    self.scratch_.resize(size);
  }
  if (!read_all(self.file_, self.scratch_.data(), size, address)) {
    return kFileError;
  }
  if (!port::is_erased(Span<const std::uint8_t>(self.scratch_.data(), size))) {
    return kRefused;
  }
  ++self.counts_.programs;
  self.counts_.programmed_bytes += size;
  return write_all(self.file_, static_cast<const std::uint8_t*>(data), size, address) ? 0 : kFileError;
}

int FlashImage::erase(void* context, std::uint32_t block) {
  auto& self = *static_cast<FlashImage*>(context);
  if (block >= self.geometry_.block_count || self.read_only_) {
    return kRefused;
  }
  ++self.counts_.erases;
  std::fill(self.scratch_.begin(), self.scratch_.end(), port::kErasedByte);
  const std::uint64_t at = std::uint64_t{block} * self.geometry_.block_size;
  return write_all(self.file_, self.scratch_.data(), self.geometry_.block_size, at) ? 0 : kFileError;
}

int FlashImage::sync(void* context) {
  auto& self = *static_cast<FlashImage*>(context);
  ++self.counts_.syncs;
  return self.read_only_ || ::fsync(self.file_) == 0 ? 0 : kFileError;
}

ImageInfo probe_image(const std::string& path) {
  constexpr std::uint64_t kSmallestBlock = 4096;
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) {
    fail(path, std::string("cannot be opened: ") + std::strerror(errno));
  }
  const std::uint64_t size = file_size(file);
  ImageInfo info;
  FlashGeometry& geometry = info.geometry;
  bool found = false;
  // Of all headers the newest one speaks; every block begins at a multiple of the smallest block.
  for (std::uint64_t at = 0; at + kBlockHeaderBytes <= size && size <= kMostBytes; at += kSmallestBlock) {
    std::array<std::uint8_t, kBlockHeaderBytes> bytes{};
    BlockHeader header;
    if (read_all(file, bytes.data(), bytes.size(), at) &&
        decode_block_header(Span<const std::uint8_t>(bytes.data(), bytes.size()), header) == Status::ok &&
        header.block_size != 0 && at % header.block_size == 0 && header.sequence > info.newest.sequence) {
      info.newest = header;
      geometry = {header.block_size, header.block_count, header.program_unit};
      found = true;
    }
  }
  ::close(file);
  if (!found) {
    fail(path, "no block header found: this is no flash image of a submap store");
  }
  if (!geometry.valid() || geometry.bytes() != size) {
    fail(path, "expected " + std::to_string(geometry.block_count) + " blocks of " +
                   std::to_string(geometry.block_size) + " bytes, found " + std::to_string(size) + " bytes");
  }
  return info;
}

}  // namespace mellin::posix
