// One loop, no threads: scans are taken as they come, at the sensor's rate, and background work fills the time between
// them, one slice at a time. Shows that the pose is there at the latest one slice and one add() after its scan was due.
//
// The sensor's timer is simulated: time goes by while the library computes, by as much as it had the processor, and
// jumps to the next interrupt where a board would sleep.
#include <cstddef>
#include <cstdint>

#include "example.h"
#include "mellin/c_interface.hpp"
#include "mellin/core/log.hpp"
#include "mellin/slam.hpp"
#include "ramflash/flash_model.hpp"
#include "simulated_robot.h"

namespace {

constexpr int kScans = 3 * SIMULATED_STEPS_PER_ROUND;

constexpr mellin::Config configure() {
  mellin::Config config = mellin::micro_profile();
  config.lasers[0].beams = SIMULATED_BEAMS;
  config.lasers[0].angle_min_rad = static_cast<float>(-mellin::kPi);
  config.lasers[0].angle_increment_rad = static_cast<float>(mellin::kTwoPi / double{SIMULATED_BEAMS});
  config.lasers[0].max_range_m = 20.0F;
  config.side = 160;  // 16 m
  config.registration_side = 40;
  config.class_side = 80;
  config.max_submaps = 24;
  config.collection.graph.max_edges = 96;
  config.collection.graph.max_fill = 128;
  config.mapper.take_distance_m = 0.35F;
  return config;
}
constexpr mellin::Config kConfig = configure();

alignas(mellin::kArenaAlignment) std::byte memory[mellin::required_bytes(kConfig)];

constexpr mellin::port::FlashGeometry kFlash = {4096, 64, 16};
std::uint8_t flash_bytes[kFlash.bytes()];

/// The sensor and its interrupt: every period a scan is laid into a mailbox for one, whoever computes.
class Sensor {
 public:
  explicit Sensor(std::uint64_t period_us) : period_us_(period_us) {
    simulated_start(&robot_);
    advance(0);
  }
  /// Time goes on; interrupts that fall into it happen.
  void advance(std::uint64_t us) {
    for (now_us_ += us; delivered_ < kScans && next_us_ <= now_us_; next_us_ += period_us_) {
      interrupt();
    }
  }
  /// Until the next interrupt.
  void sleep() {
    idle_us_ += next_us_ - now_us_;
    advance(next_us_ - now_us_);
  }

  bool scan_waits() const { return full_; }
  /// Requires scan_waits(). The scan is valid until the next interrupt.
  mellin_scan take() {
    full_ = false;
    return simulated_scan(&robot_);
  }
  std::uint64_t due_us() const { return due_us_; }
  std::uint64_t period_us() const { return period_us_; }
  std::uint64_t now_us() const { return now_us_; }
  std::uint64_t idle_us() const { return idle_us_; }
  int delivered() const { return delivered_; }
  std::uint32_t overruns() const { return overruns_; }
  const simulated_robot& robot() const { return robot_; }

 private:
  void interrupt() {
    overruns_ += full_ ? 1U : 0U;
    if (delivered_ > 0) {
      simulated_drive(&robot_);
    }
    full_ = true;
    due_us_ = next_us_;
    ++delivered_;
  }

  simulated_robot robot_ = {};
  std::uint64_t period_us_;
  std::uint64_t now_us_ = 0;
  std::uint64_t next_us_ = 0;  ///< next interrupt
  std::uint64_t due_us_ = 0;   ///< of the scan in the mailbox
  std::uint64_t idle_us_ = 0;
  int delivered_ = 0;
  std::uint32_t overruns_ = 0;
  bool full_ = false;
};

/// How long something took, each time and at most.
struct Times {
  std::uint32_t count = 0;
  std::uint64_t sum_us = 0;
  std::uint64_t longest_us = 0;

  void note(std::uint64_t us) {
    ++count;
    sum_us += us;
    longest_us = us > longest_us ? us : longest_us;
  }
};

struct Figures {
  Times adds;
  Times slices;
  Times answers;  ///< from a scan's interrupt to its pose
  std::uint32_t refused = 0;
};

mellin::Scan scan_of(const mellin_scan& scan) {
  return {scan.stamp_us, {scan.ranges_m, scan.range_count}, mellin::pose_of(scan.odom_T_base), scan.laser};
}

void add(mellin::Slam& slam, Sensor& sensor, Figures& figures) {
  const std::uint64_t due_us = sensor.due_us();
  const mellin_scan scan = sensor.take();
  const std::uint64_t before = example_now_us();
  const bool added = slam.add(scan_of(scan)).ok();
  const std::uint64_t took = example_now_us() - before;
  sensor.advance(took);
  figures.adds.note(took);
  figures.answers.note(sensor.now_us() - due_us);
  figures.refused += added ? 0U : 1U;
}

/// One slice. Returns whether there is more to do.
bool work(mellin::Slam& slam, Sensor& sensor, Figures& figures) {
  const std::uint64_t before = example_now_us();
  const bool more = slam.work(1);
  const std::uint64_t took = example_now_us() - before;
  sensor.advance(took);
  figures.slices.note(took);
  return more;
}

/// The firmware's main loop.
void run(mellin::Slam& slam, Sensor& sensor, Figures& figures) {
  bool more = true;
  while (sensor.scan_waits() || sensor.delivered() < kScans) {
    if (sensor.scan_waits()) {
      add(slam, sensor, figures);
      more = true;
    } else if (more) {
      more = work(slam, sensor, figures);
    } else {
      sensor.sleep();
    }
  }
}

void print(const char* label, std::uint64_t value, const char* unit) {
  example_print((mellin::LogLine() << label << ": " << value << unit).text());
}

void print(const char* label, const Times& times) {
  example_print((mellin::LogLine() << label << ": " << std::uint64_t{times.count} << ", longest " << times.longest_us
                                   << " us, mean " << times.sum_us / (times.count > 0 ? times.count : 1) << " us")
                    .text());
}

void print(const mellin::Slam& slam, const Sensor& sensor, const Figures& figures, double error_m) {
  print("a scan every", sensor.period_us(), " us");
  print("add()", figures.adds);
  print("work(1)", figures.slices);
  print("interrupt to pose", figures.answers);
  print("scans lost", sensor.overruns(), "");
  print("asleep", sensor.now_us() > 0 ? 100 * sensor.idle_us() / sensor.now_us() : 0, " % of the time");
  print("submaps", slam.collection().size(), "");
  print("submaps delayed", slam.statistics().submaps_delayed, "");
  print("loops closed", slam.collection().statistics().pairs_accepted, "");
  print("error of the pose in the map", static_cast<std::uint64_t>(error_m * 1000.0), " mm");
}

/// nullptr, or what is wrong at any rate.
const char* judge(const mellin::Slam& slam, const Figures& figures, double error_m) {
  if (figures.refused > 0) {
    return "a scan was refused";
  }
  if (figures.answers.longest_us > figures.slices.longest_us + figures.adds.longest_us) {
    return "a pose was later than one slice and one add()";
  }
  if (slam.store().submap_count() < slam.collection().statistics().stored) {
    return "a submap is not in the flash";
  }
  return error_m < 0.1 ? nullptr : "the pose in the map is off by more than a cell";
}

/// nullptr, or what is wrong where the processor has time enough.
const char* judge_at_leisure(const mellin::Slam& slam, const Sensor& sensor) {
  if (sensor.overruns() > 0) {
    return "scans came faster than they were taken";
  }
  if (slam.statistics().submaps_delayed + slam.statistics().submaps_lost > 0) {
    return "the idle time did not suffice for the background work";
  }
  return slam.collection().statistics().pairs_accepted > 0 ? nullptr : "no loop was closed";
}

/// One drive with a scan every so often; a new system over a new flash. nullptr, or what went wrong.
const char* drive(std::uint64_t period_us, bool at_leisure, Figures& figures) {
  mellin::port::FlashModel flash(kFlash, flash_bytes);
  flash.erase_all();
  mellin_port port = {};
  port.flash = flash.flash();
  port.log.write = [](void*, mellin_log_level, const char* line) { example_print(line); };
  const mellin::Result<mellin::Slam*> made = mellin::Slam::create(kConfig, memory, port);
  if (!made.ok()) {
    return mellin::to_string(made.status());
  }
  mellin::Slam& slam = *made.value();
  Sensor sensor(period_us);
  run(slam, sensor, figures);
  const mellin_pose2 pose = mellin::c_pose(slam.map_pose().map_T_base);
  const double error_m = simulated_error_m(&sensor.robot(), &pose);
  print(slam, sensor, figures, error_m);
  const char* const wrong = judge(slam, figures, error_m);
  return wrong == nullptr && at_leisure ? judge_at_leisure(slam, sensor) : wrong;
}

const char* drive_twice() {
  print("memory", sizeof memory, " bytes");
  Figures slow;
  const char* const failure = drive(SIMULATED_PERIOD_US, true, slow);
  if (failure != nullptr) {
    return failure;
  }
  // The shortest period in which a slice and an add() always fit, and as much again.
  Figures fast;
  return drive(2 * (slow.adds.longest_us + slow.slices.longest_us) + 1, false, fast);
}

}  // namespace

int main() {
  const char* const failure = drive_twice();
  if (failure != nullptr) {
    example_print((mellin::LogLine() << "failed: " << failure).text());
    return 1;
  }
  example_print("passed");
  return 0;
}
