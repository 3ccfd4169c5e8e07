// The machine-readable results of `mellin map`: summary.json, submaps.csv and matches.csv. SI units.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "mellin/core/se2.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin::host {

using ConfigValue = std::variant<bool, std::int64_t, double, std::string>;

struct SessionSummary {
  std::string log;
  std::string id;  ///< UUID
  std::uint64_t scans = 0;
  std::uint64_t submaps = 0;
  std::uint64_t component = 0;  ///< of its first submap
  std::uint64_t lost = 0;       ///< times that a new component was begun, since the robot did not know where it was
};

struct EdgeCounts {
  std::uint64_t odometry = 0;
  std::uint64_t loop = 0;
  std::uint64_t merge = 0;
  std::uint64_t rejected = 0;
};

struct PairCounts {
  std::uint64_t possible = 0;
  std::uint64_t screened = 0;
  std::uint64_t dropped_coarse = 0;    ///< of the screened ones
  std::uint64_t dropped_rotation = 0;  ///< likewise
  std::uint64_t cut_short = 0;         ///< likewise
  std::uint64_t registered = 0;
  std::uint64_t accepted = 0;
};

struct StageSeconds {
  double total = 0.0;
  double local_mapping = 0.0;
  double screening = 0.0;
  double registration = 0.0;
  double optimisation = 0.0;
  double store = 0.0;
};

struct MemoryFigures {
  std::uint64_t arena_bytes = 0;
  std::uint64_t arena_used_bytes = 0;
  std::uint64_t heap_allocations_after_init = 0;
  std::uint64_t peak_rss_bytes = 0;
};

struct StoreFigures {
  std::uint64_t submaps = 0;
  std::uint64_t logical_bytes = 0;
  std::uint64_t programmed_bytes = 0;
  std::uint64_t erases = 0;
  std::uint64_t max_block_erases = 0;
};

/// The fields of summary.json, by name.
struct Summary {
  std::string version;
  std::vector<std::pair<std::string, ConfigValue>> config;
  std::vector<SessionSummary> sessions;
  std::uint64_t components = 0;
  EdgeCounts edges;
  PairCounts pairs;
  StageSeconds seconds;
  MemoryFigures memory;
  StoreFigures store;
};

/// The JSON text. Throws std::invalid_argument where a number is not finite (JSON has no such numbers).
std::string to_json(const Summary& summary);

/// A row of submaps.csv.
struct SubmapRow {
  SubmapId id = kNoSubmap;
  std::string session;  ///< UUID
  std::uint64_t component = 0;
  std::uint64_t scans = 0;
  double timestamp_s = 0.0;
  Pose2 map_T_submap;
};

/// A row of matches.csv.
struct MatchRow {
  SubmapId a = kNoSubmap;
  SubmapId b = kNoSubmap;
  std::string kind;   ///< loop or merge
  std::string stage;  ///< screened or registered
  double score = 0.0;
  double agreement = 0.0;
  Pose2 a_T_b;
  bool accepted = false;
  std::string why;      ///< why it was accepted or not
  bool nearby = false;  ///< screened: the graph has both in one place; not in the file
};

std::string submaps_csv(const std::vector<SubmapRow>& rows);
std::string matches_csv(const std::vector<MatchRow>& rows);

/// Text form of a session's UUID: 8-4-4-4-12 hexadecimal digits.
std::string to_text(const SessionId& id);

}  // namespace mellin::host
