// Errors are values: Status says what happened, Result<T> carries a value or the Status that prevented it.
#pragma once

#include <cassert>
#include <cstdint>
#include <utility>

namespace mellin {

/// The outcome of a call. Every public function lists those that it returns and what each means there.
enum class [[nodiscard]] Status : std::uint8_t{
    ok = 0,
    invalid_argument,     ///< the caller passed something that the contract excludes
    invalid_config,       ///< a configuration that contradicts itself or a stated limit
    insufficient_memory,  ///< the memory given is smaller than required_bytes()
    bad_data,             ///< sensor, file or flash content that cannot be what it claims to be
    not_found,            ///< no such submap, node, record or match
    full,                 ///< a fixed capacity is used up
    busy,                 ///< a slot, job or handle is in use; the call can be repeated later
    device_error,         ///< the port's device reported an error
    version_mismatch,     ///< stored by a newer major version or under another configuration
    lost,                 ///< the record existed, but its checksum fails
    degenerate,           ///< the mathematics has no (unique) answer for this input
};

/// A short English name of a status, for logs.
const char* to_string(Status status);

/// A value, or the status that says why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : value_(std::move(value)), status_(Status::ok) {}  // NOLINT: values convert on return
  Result(Status status) : value_{}, status_(status) {                 // NOLINT: statuses convert on return
    assert(status != Status::ok);
  }

  bool ok() const { return status_ == Status::ok; }
  Status status() const { return status_; }
  /// Requires ok().
  const T& value() const {
    assert(ok());
    return value_;
  }
  T& value() {
    assert(ok());
    return value_;
  }

 private:
  T value_;
  Status status_;
};

}  // namespace mellin
