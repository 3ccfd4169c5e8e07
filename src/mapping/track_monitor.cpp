#include "mellin/mapping/track_monitor.hpp"

namespace mellin {
namespace {

constexpr std::uint16_t kFewBeams = 12;  // of the sample: too few to say anything
constexpr int kThroughWeight = 2;        // nobody steps aside and leaves a wall out: people only shorten beams

}  // namespace

bool TrackMonitor::suspects(const MapAgreement& agreement) const {
  const auto known = static_cast<float>(agreement.agreeing + agreement.conflicts());
  const bool through = speaks(agreement) && agreement.through > 0 &&
                       static_cast<float>(agreement.through) >= config_.suspect_share * known;
  return through || contradicts(agreement);
}

bool TrackMonitor::contradicts(const MapAgreement& agreement) const {
  const auto known = static_cast<float>(agreement.agreeing + agreement.conflicts());
  const auto against = static_cast<float>(agreement.short_of + kThroughWeight * agreement.through);
  return speaks(agreement) && agreement.conflicts() > 0 && against >= config_.conflict_share * known &&
         static_cast<float>(agreement.conflicts()) >= config_.least_share * static_cast<float>(agreement.beams);
}

/// Whether it has anything to say, and is asked.
bool TrackMonitor::speaks(const MapAgreement& agreement) const {
  return config_.lost_scans > 0 && agreement.beams >= kFewBeams;
}

TrackState TrackMonitor::judge(bool matched, const MapAgreement& agreement) {
  const bool clear =
      matched && static_cast<float>(agreement.agreeing) >= config_.sure_share * static_cast<float>(agreement.beams);
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
