// Whether the local mapper still knows where it is. New space and a changed world must not be mistaken for a robot that
// was carried off: a beam that ends where nothing was ever observed says nothing, a moved cupboard and people in the
// way are few of many beams. What cannot be is that most of what the map knows is contradicted, scan after scan.
#pragma once

#include <cstdint>

#include "mellin/mapping/scan_matcher.hpp"

namespace mellin {

struct TrackMonitorConfig {
  /// Lost after so many scans in a row, of those that are due to be taken, that contradict the live map; 0: nothing
  /// counts as a contradiction, and every scan is taken. More of them forgive a longer crowd, and cost as much way
  /// after the robot was carried off.
  std::uint8_t lost_scans = 4;
  /// A scan contradicts where so many of the beams that the map knows something about are in conflict with it, those
  /// that went through something counting double …
  float conflict_share = 0.3F;
  /// … and so many of all its beams: else the map knows too little about where it looks.
  float least_share = 0.12F;
  /// A doubt ends with a match at which so many beams agree.
  float sure_share = 0.7F;
  /// Where so many of those that the map knows went through something, or the scan contradicts, the pose is looked for
  /// in a wider search. Beams that end early do not suffice: somebody stands there.
  float suspect_share = 0.1F;
};

enum class TrackState : std::uint8_t {
  sure,     ///< the scan may be taken
  doubted,  ///< it contradicts the live map, or follows one that does: taking it might spoil the map
  lost,     ///< so did the last ones, as many as it takes
};

class TrackMonitor {
 public:
  TrackMonitor() = default;
  explicit TrackMonitor(const TrackMonitorConfig& config) : config_(config) {}

  /// The live map starts afresh: no scan is held against it.
  void reset() { doubts_ = 0; }

  /// Whether the scan cannot have been taken there, if the map is right.
  bool contradicts(const MapAgreement& agreement) const;

  /// Whether so much speaks against the pose that a better one should be looked for.
  bool suspects(const MapAgreement& agreement) const;

  /// To be told of each scan that is due to be taken and has seen something: whether it matched, and how it then goes
  /// with the map. An unmatched one that contradicts nothing is new space; but as long as there is doubt only a match
  /// at which most beams agree ends it, or a robot that was carried off would draw the new place beside the old one.
  TrackState judge(bool matched, const MapAgreement& agreement);

 private:
  bool speaks(const MapAgreement& agreement) const;

  TrackMonitorConfig config_;
  std::uint8_t doubts_ = 0;  ///< scans in a row
};

}  // namespace mellin
