// CRC-32 of IEEE 802.3 (polynomial 0x04C11DB7, reflected; the one of zlib and PNG), over a table of 256 entries (1 KiB
// of constants).
#pragma once

#include <cstdint>

#include "mellin/core/span.hpp"

namespace mellin {

/// The checksum of `bytes` appended to what gave `crc` so far; 0 to start with. Some five operations a byte.
std::uint32_t crc32(Span<const std::uint8_t> bytes, std::uint32_t crc = 0);

}  // namespace mellin
