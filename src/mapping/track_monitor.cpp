#include "mellin/mapping/track_monitor.hpp"

namespace mellin {
namespace {

constexpr std::uint16_t kFewBeams = 12;  // of the sample: too few to say anything

}  // namespace

bool TrackMonitor::contradicts(const MapAgreement& agreement) const {
  const auto beams = static_cast<float>(agreement.beams);
  const auto known = static_cast<float>(agreement.agreeing + agreement.conflicts);
  const auto conflicts = static_cast<float>(agreement.conflicts);
  return config_.lost_scans > 0 && agreement.beams >= kFewBeams && conflicts >= config_.conflict_share * known &&
         conflicts >= config_.least_share * beams;
}

TrackState TrackMonitor::judge(bool matched, const MapAgreement& agreement) {
  const bool against = contradicts(agreement);
  if (!against && (matched || doubts_ == 0)) {
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
