// What each step of a run cost, in the board's ticks: how often, on average, at worst.
#pragma once

#include <cstdint>

#include "board.h"
#include "images/print.hpp"
#include "mellin/slam.hpp"

namespace mellin::image {

enum class Cost : std::uint8_t {
  taken_scan,  ///< Slam::add of a scan that is added to the live map
  other_scan,  ///< Slam::add of one that is only matched
  rendering,   ///< a slice of Slam::work that does this, and so on
  screening,
  registration,
  optimisation,
  store,
  linking,  ///< none of the clocks ran: choosing and judging
  count
};

inline const char* to_string(Cost cost) {
  constexpr const char* kNames[] = {"add, taken",         "add, matched only",     "slice of rendering",
                                    "slice of screening", "slice of registration", "slice of optimisation",
                                    "slice of storing",   "slice of linking"};
  return kNames[static_cast<std::size_t>(cost)];
}

/// The system's clocks by stage before a slice; the one that ran tells what the slice was.
class StageClocks {
 public:
  explicit StageClocks(const Slam& slam) { read(slam, before_); }
  Cost ran(const Slam& slam) const {
    std::uint64_t now[kStages];
    read(slam, now);
    for (std::size_t i = 0; i < kStages; ++i) {
      if (now[i] != before_[i]) {
        return static_cast<Cost>(static_cast<std::size_t>(Cost::rendering) + i);
      }
    }
    return Cost::linking;
  }

 private:
  static constexpr std::size_t kStages = 5;
  static void read(const Slam& slam, std::uint64_t (&clocks)[kStages]) {
    const CollectionStatistics& s = slam.collection().statistics();
    clocks[0] = slam.statistics().rendering_us;
    clocks[1] = s.screening_us;
    clocks[2] = s.registration_us;
    clocks[3] = s.optimisation_us;
    clocks[4] = s.store_us;
  }

  std::uint64_t before_[kStages] = {};
};

class Costs {
 public:
  void add(Cost what, std::uint64_t ticks) {
    Entry& entry = entries_[static_cast<std::size_t>(what)];
    ++entry.times;
    entry.total += ticks;
    entry.worst = ticks > entry.worst ? ticks : entry.worst;
  }

  void print_table(std::uint64_t pairs_screened, std::uint64_t pairs_registered) const {
    per_million_ = board_ticks_per_million();
    const char* const unit = per_million_ != 0 ? "instructions" : "nanoseconds";
    print("cost in ", unit, ": times, mean, worst\n");
    for (std::size_t i = 0; i < static_cast<std::size_t>(Cost::count); ++i) {
      const Entry& entry = entries_[i];
      if (entry.times > 0) {
        print("  ", to_string(static_cast<Cost>(i)), ": ", entry.times, ", ", in_unit(entry.total / entry.times), ", ",
              in_unit(entry.worst), "\n");
      }
    }
    print_mean("a pair screened", Cost::screening, pairs_screened);
    print_mean("a pair registered", Cost::registration, pairs_registered);
  }

 private:
  struct Entry {
    std::uint64_t times = 0;
    std::uint64_t total = 0;
    std::uint64_t worst = 0;
  };

  std::uint64_t in_unit(std::uint64_t ticks) const {
    return per_million_ != 0 ? ticks * 1000000U / per_million_ : ticks;
  }
  void print_mean(const char* what, Cost cost, std::uint64_t pieces) const {
    if (pieces > 0) {
      print("  ", what, ": ", pieces, ", ", in_unit(entries_[static_cast<std::size_t>(cost)].total / pieces), "\n");
    }
  }

  Entry entries_[static_cast<std::size_t>(Cost::count)];
  mutable std::uint32_t per_million_ = 0;
};

}  // namespace mellin::image
