#include "mellin/mapping/track_monitor.hpp"

namespace mellin {
namespace {

constexpr std::uint16_t kFewBeams = 12;  // of the sample: too few to say anything

}  // namespace

bool TrackMonitor::conflict(const MapAgreement& agreement, float share) const {
  const auto known = static_cast<float>(agreement.agreeing + agreement.conflicts);
  return config_.lost_scans > 0 && agreement.beams >= kFewBeams && agreement.conflicts > 0 &&
         static_cast<float>(agreement.conflicts) >= share * known;
}

bool TrackMonitor::suspects(const MapAgreement& agreement) const { return conflict(agreement, config_.suspect_share); }

bool TrackMonitor::contradicts(const MapAgreement& agreement) const {
  return conflict(agreement, config_.conflict_share) &&
         static_cast<float>(agreement.conflicts) >= config_.least_share * static_cast<float>(agreement.beams);
}

TrackState TrackMonitor::judge(bool matched, const MapAgreement& agreement) {
  const bool clear = matched && !suspects(agreement) && 2 * agreement.agreeing > agreement.beams;
  if (!contradicts(agreement) && (clear || doubts_ == 0)) {
    doubts_ = 0;
    return TrackState::sure;
  }
  ++doubts_;
  if (doubts_ < config_.lost_scans) {
    return TrackState::doubted;
  }
  doubts_ = 0;
  return TrackState::lost;
}

}  // namespace mellin
