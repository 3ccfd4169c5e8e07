// Laser scans as a stream of bytes that firmware can read without parsing text: what `mellin record` makes of a log.
// All numbers are little-endian, without padding:
//
//   header   "MELLINSC", u32 version (1), u32 lasers
//   a laser  u32 beams, f32 angle_min_rad, f32 angle_increment_rad, f32 max_range_m, f64 x, y, theta of base_T_laser
//   a scan   i64 stamp_us, u32 laser, f64 x, y, theta of odom_T_base, f32 a range for each of the laser's beams
#pragma once

#include <cstdint>
#include <cstring>

#include "board.h"
#include "mellin/mapping/laser.hpp"

namespace mellin::image {

inline constexpr char kScanMagic[] = "MELLINSC";
inline constexpr std::uint32_t kScanVersion = 1;
inline constexpr std::uint32_t kScanHeaderBytes = 16;
inline constexpr std::uint32_t kScanLaserBytes = 40;
inline constexpr std::uint32_t kScanPreludeBytes = 36;  ///< of a scan, before its ranges
inline constexpr std::uint32_t kMaxStreamBeams = 2048;

static_assert(sizeof(float) == 4 && sizeof(double) == 8, "IEEE 754 numbers");

/// Takes numbers from bytes, or puts them there. The processors that this runs on are little-endian.
template <class T>
T number_at(const std::uint8_t* bytes) {
  T number{};
  std::memcpy(&number, bytes, sizeof number);
  return number;
}

/// Reads a stream from a file of the board's host.
class ScanReader {
 public:
  ScanReader() = default;
  ScanReader(const ScanReader&) = delete;
  ScanReader& operator=(const ScanReader&) = delete;
  ~ScanReader() {
    if (file_ >= 0) {
      (void)board_close(file_);
    }
  }

  /// Opens the file and reads the lasers. Returns what is wrong with it, or nullptr.
  const char* open(const char* path) {
    file_ = board_open(path, BOARD_READ);
    if (file_ < 0) {
      return "cannot be opened";
    }
    if (!read(bytes_, kScanHeaderBytes) || std::memcmp(bytes_, kScanMagic, 8) != 0) {
      return "is no scan stream (mellin record makes one of a log)";
    }
    lasers_ = number_at<std::uint32_t>(bytes_ + 12);
    if (number_at<std::uint32_t>(bytes_ + 8) != kScanVersion || lasers_ == 0 || lasers_ > kMaxLasers) {
      return "has another version, or not 1 to 4 lasers";
    }
    for (std::uint32_t i = 0; i < lasers_; ++i) {
      if (!read(bytes_, kScanLaserBytes) || number_at<std::uint32_t>(bytes_) > kMaxStreamBeams) {
        return "ends in its header, or has a laser of more than 2048 beams";
      }
      LaserConfig& laser = laser_[i];
      laser.beams = static_cast<std::uint16_t>(number_at<std::uint32_t>(bytes_));
      laser.angle_min_rad = number_at<float>(bytes_ + 4);
      laser.angle_increment_rad = number_at<float>(bytes_ + 8);
      laser.max_range_m = number_at<float>(bytes_ + 12);
      laser.base_T_laser = pose_at(bytes_ + 16);
    }
    return nullptr;
  }
  std::uint32_t lasers() const { return lasers_; }
  const LaserConfig& laser(std::uint32_t i) const { return laser_[i]; }

  /// Reads the next scan, whose ranges are valid until the next call. False at the end, also where it is cut short.
  bool next(Scan& scan) {
    if (!read(bytes_, kScanPreludeBytes) || number_at<std::uint32_t>(bytes_ + 8) >= lasers_) {
      return false;
    }
    scan.stamp_us = number_at<std::int64_t>(bytes_);
    scan.laser = static_cast<std::uint8_t>(number_at<std::uint32_t>(bytes_ + 8));
    scan.odom_T_base = pose_at(bytes_ + 12);
    const std::uint32_t beams = laser_[scan.laser].beams;
    scan.ranges_m = Span<const float>(ranges_, beams);
    return read(ranges_, beams * 4);
  }

 private:
  static Pose2 pose_at(const std::uint8_t* bytes) {
    return {number_at<double>(bytes), number_at<double>(bytes + 8), number_at<double>(bytes + 16)};
  }
  bool read(void* to, std::uint32_t size) { return board_read(file_, to, size) == size; }

  int file_ = -1;
  std::uint32_t lasers_ = 0;
  LaserConfig laser_[kMaxLasers];
  std::uint8_t bytes_[kScanLaserBytes] = {};
  float ranges_[kMaxStreamBeams] = {};
};

}  // namespace mellin::image
