#include "mellin/core/status.hpp"

#include "mellin/core/arena.hpp"

namespace mellin {

const char* to_string(Status status) {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::invalid_argument:
      return "invalid argument";
    case Status::invalid_config:
      return "invalid configuration";
    case Status::insufficient_memory:
      return "insufficient memory";
    case Status::bad_data:
      return "bad data";
    case Status::not_found:
      return "not found";
    case Status::full:
      return "full";
    case Status::busy:
      return "busy";
    case Status::device_error:
      return "device error";
    case Status::version_mismatch:
      return "version mismatch";
    case Status::lost:
      return "lost";
    case Status::degenerate:
      return "degenerate";
  }
  return "unknown";
}

const char* to_string(Part part) {
  static constexpr const char* kNames[kPartCount] = {"grid",  "scans", "mapper",     "submaps",   "spectral", "digests",
                                                     "store", "graph", "collection", "workspace", "slam"};
  const auto i = static_cast<std::size_t>(part);
  return i < kPartCount ? kNames[i] : "unknown";
}

}  // namespace mellin
