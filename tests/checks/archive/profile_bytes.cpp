// required_bytes() of the profiles, for a laser of 180 beams, as the sizes of symbols: sizes.py reads them with nm. The
// object is only looked at.
#include "mellin/config.hpp"
#include "mellin/slam.hpp"

namespace {

constexpr mellin::Config with_laser(mellin::Config config) {
  config.lasers[0].beams = 180;
  return config;
}

}  // namespace

extern "C" {
char mellin_ram_desktop[mellin::required_bytes(with_laser(mellin::desktop_profile()))];
char mellin_ram_micro[mellin::required_bytes(with_laser(mellin::micro_profile()))];
char mellin_ram_nano[mellin::required_bytes(with_laser(mellin::nano_profile()))];
}
