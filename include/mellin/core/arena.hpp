// Memory given once. A component describes what it needs in one constexpr function
//
//   template <class A> static constexpr Memory carve(A& arena, const SomeConfig& config);
//
// which is run twice: over a MeasureArena at compile time, to say how many bytes the configuration needs, and over an
// Arena at start-up, to hand the memory out. Since both run the same code, bytes used equal bytes required.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <type_traits>

#include "mellin/core/span.hpp"

namespace mellin {

/// Alignment of the memory that a caller gives, and of each array carved from it.
inline constexpr std::size_t kArenaAlignment = 8;

/// Whose bytes they are, for the table of use by part.
enum class Part : std::uint8_t {
  grid,
  scans,
  mapper,
  submaps,
  spectral,
  digests,
  store,
  graph,
  collection,
  workspace,  ///< what several parts use in turn, never at the same time
  slam,
  count
};

inline constexpr std::size_t kPartCount = static_cast<std::size_t>(Part::count);

const char* to_string(Part part);

/// Microcontrollers have a small fast memory (tightly coupled) and a large slow one. An array is carved from the one
/// where its use pays; with a single region given, both come from it.
enum class Region : std::uint8_t { bulk, fast };

namespace detail {
inline constexpr std::size_t kMostBytes = ~std::size_t{0};

/// The sum, or the most that can be said: what passes 4 GiB on a 32-bit processor must not look small.
constexpr std::size_t saturating_sum(std::size_t a, std::size_t b) { return b > kMostBytes - a ? kMostBytes : a + b; }

template <class T>
constexpr std::size_t carved_bytes(std::size_t count) {
  static_assert(alignof(T) <= kArenaAlignment, "the arena's alignment does not suffice for this type");
  static_assert(std::is_trivially_destructible_v<T>, "nothing in the arena is ever destroyed");
  return count > (kMostBytes - kArenaAlignment) / sizeof(T)
             ? kMostBytes
             : (count * sizeof(T) + kArenaAlignment - 1) / kArenaAlignment * kArenaAlignment;
}
}  // namespace detail

/// Bytes; sums that are beyond a size_t stay at the largest one.
struct ArenaUse {
  std::size_t by_part[kPartCount] = {};
  std::size_t fast = 0;
  std::size_t bulk = 0;
  constexpr std::size_t total() const { return detail::saturating_sum(fast, bulk); }
  constexpr void add(std::size_t bytes, Part part, Region region) {
    std::size_t& of_part = by_part[static_cast<std::size_t>(part)];
    std::size_t& of_region = region == Region::fast ? fast : bulk;
    of_part = detail::saturating_sum(of_part, bytes);
    of_region = detail::saturating_sum(of_region, bytes);
  }
};

/// The larger of both, region by region: what two parts need that take turns.
constexpr ArenaUse larger(const ArenaUse& a, const ArenaUse& b) {
  ArenaUse out;
  out.fast = a.fast > b.fast ? a.fast : b.fast;
  out.bulk = a.bulk > b.bulk ? a.bulk : b.bulk;
  return out;
}

/// Memory that several parts use in turn: each carves its own from over() the block. None may rely on what it left
/// there when another one has worked meanwhile.
struct Workspace {
  Span<std::byte> bulk;
  Span<std::byte> fast;
};

/// Counts without memory; its spans are null and have a size.
class MeasureArena {
 public:
  static constexpr bool kMeasuring = true;

  template <class T>
  constexpr Span<T> take(std::size_t count, Part part, Region region = Region::bulk) {
    const std::size_t bytes = detail::carved_bytes<T>(count);
    use_.add(bytes, part, region);
    return Span<T>(nullptr, count);
  }
  constexpr Workspace take_workspace(const ArenaUse& largest) {
    return {take<std::byte>(largest.bulk, Part::workspace),
            take<std::byte>(largest.fast, Part::workspace, Region::fast)};
  }
  /// An arena for one of those who take turns. What it measures is not counted again.
  constexpr MeasureArena over(const Workspace& /*workspace*/) const { return {}; }
  constexpr const ArenaUse& use() const { return use_; }

 private:
  ArenaUse use_;
};

/// Hands out the caller's memory, value-initialised, and never takes anything back.
class Arena {
 public:
  static constexpr bool kMeasuring = false;

  /// `bulk` and `fast` stay the caller's and must outlive everything carved from them; both aligned to
  /// kArenaAlignment. Without `fast`, everything comes from `bulk`.
  explicit Arena(Span<std::byte> bulk, Span<std::byte> fast = {}) : bulk_(bulk), fast_(fast), split_(!fast.empty()) {}

  /// Whether take() has handed out everything it was asked for. Check once, after carving.
  bool ok() const { return ok_; }
  const ArenaUse& use() const { return use_; }

  template <class T>
  Span<T> take(std::size_t count, Part part, Region region = Region::bulk) {
    const std::size_t bytes = detail::carved_bytes<T>(count);
    use_.add(bytes, part, region);
    Span<std::byte>& from = split_ && region == Region::fast ? fast_ : bulk_;
    if (bytes > from.size()) {
      ok_ = false;
      return Span<T>(nullptr, 0);
    }
    std::byte* const start = from.data();
    from = from.subspan(bytes, from.size() - bytes);
    T* const typed = reinterpret_cast<T*>(start);
    for (std::size_t i = 0; i < count; ++i) {
      ::new (static_cast<void*>(typed + i)) T();
    }
    return Span<T>(typed, count);
  }
  Workspace take_workspace(const ArenaUse& largest) {
    return {take<std::byte>(largest.bulk, Part::workspace),
            take<std::byte>(largest.fast, Part::workspace, Region::fast)};
  }
  /// An arena for one of those who take turns.
  Arena over(const Workspace& workspace) const { return Arena(workspace.bulk, workspace.fast); }

 private:
  Span<std::byte> bulk_;
  Span<std::byte> fast_;
  ArenaUse use_;
  bool split_;
  bool ok_ = true;
};

/// What carve(arena) takes.
template <class Carve>
constexpr ArenaUse measured(const Carve& carve) {
  MeasureArena arena;
  carve(arena);
  return arena.use();
}

/// What carve(kept, work) takes from `work`.
template <class Carve>
constexpr ArenaUse measured_work(const Carve& carve) {
  MeasureArena kept;
  MeasureArena work;
  carve(kept, work);
  return work.use();
}

}  // namespace mellin
