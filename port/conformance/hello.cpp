#include "conformance/hello.hpp"

#include "examples/simulated_robot.h"
#include "images/print.hpp"
#include "mellin/c_interface.hpp"
#include "mellin/slam.hpp"

namespace mellin::image {
namespace {

constexpr int kScans = 30;
constexpr std::uint32_t kMostSubmaps = 8;

constexpr Config configure() {
  Config config = nano_profile();
  config.lasers[0].beams = SIMULATED_BEAMS;
  config.lasers[0].angle_min_rad = static_cast<float>(-kPi);
  config.lasers[0].angle_increment_rad = static_cast<float>(kTwoPi / double{SIMULATED_BEAMS});
  config.lasers[0].max_range_m = 20.0F;
  config.mapper.take_distance_m = 0.35F;  // several submaps of so short a drive
  config.remembered_scans = 8;
  config.submaps.every_scans = 4;
  config.max_submaps = kMostSubmaps;
  return config;
}
constexpr Config kConfig = configure();

alignas(kArenaAlignment) std::byte memory[required_bytes(kConfig)];

bool must(bool holds, const char* otherwise) {
  if (!holds) {
    print("hello: FAILED: ", otherwise, "\n");
  }
  return holds;
}

bool succeeded(Status status, const char* what) {
  if (status != Status::ok) {
    print("hello: FAILED: ", what, ": ", to_string(status), "\n");
  }
  return status == Status::ok;
}

/// How long the longest call took, by the port's clock.
class Longest {
 public:
  explicit Longest(const mellin_clock& clock) : clock_(clock) {}
  template <class Call>
  auto measure(const Call& call) {
    const std::uint64_t before = now();
    auto result = call();
    const std::uint64_t took = now() - before;
    us_ = took > us_ ? took : us_;
    return result;
  }
  std::uint64_t us() const { return us_; }

 private:
  std::uint64_t now() const { return clock_.now_us != nullptr ? clock_.now_us(clock_.context) : 0; }
  mellin_clock clock_;
  std::uint64_t us_ = 0;
};

/// What a submap is known by after a restart.
struct Remembered {
  Pose2 session_T_submap;
  std::uint32_t crc = 0;
};

struct Memories {
  std::uint32_t count = 0;
  Remembered submaps[kMostSubmaps];
};

bool erase_all(const mellin_flash& flash) {
  print("hello: erasing ", flash.block_count, " blocks\n");
  for (std::uint32_t block = 0; block < flash.block_count; ++block) {
    if (flash.erase(flash.context, block) != 0) {
      print("hello: FAILED: block ", block, " cannot be erased\n");
      return false;
    }
  }
  return true;
}

Slam* create(const mellin_port& port) {
  const Result<Slam*> made = Slam::create(kConfig, memory, port);
  return succeeded(made.status(), "create") ? made.value() : nullptr;
}

/// Drives through the room with time for all the work after each scan, and stores everything.
bool map_the_room(Slam& slam, const mellin_port& port) {
  static simulated_robot robot;
  Longest add(port.clock);
  Longest work(port.clock);
  const auto drain = [&] {
    while (work.measure([&] { return slam.work(1); })) {
    }
  };
  simulated_start(&robot);
  for (int i = 0; i < kScans; ++i) {
    if (i > 0) {
      simulated_drive(&robot);
    }
    const mellin_scan seen = simulated_scan(&robot);
    const Scan scan{seen.stamp_us, {seen.ranges_m, seen.range_count}, pose_of(seen.odom_T_base), seen.laser};
    if (!succeeded(add.measure([&] { return slam.add(scan); }).status(), "add")) {
      return false;
    }
    drain();
  }
  if (!succeeded(slam.begin_flush(), "begin_flush")) {
    return false;
  }
  drain();
  const mellin_pose2 pose = c_pose(slam.pose());
  const auto error_mm = static_cast<std::uint64_t>(simulated_error_m(&robot, &pose) * 1000.0);
  print("hello: ", kScans, " scans, pose off by ", error_mm, " mm\n");
  if (port.clock.now_us != nullptr) {
    print("hello: add() took ", add.us(), " us at most, work(1) ", work.us(), " us\n");
  }
  return must(error_mm < 200, "the pose is off by more than a cell of 200 mm");
}

/// Requires at most kMostSubmaps in the store.
bool remember(const SubmapStore& store, Memories& memories) {
  for (memories.count = 0; memories.count < store.submap_count(); ++memories.count) {
    const SubmapId id = store.submap_id(memories.count);
    const Result<SubmapHeader> header = store.header(id);
    const Result<std::uint32_t> crc = store.grid_crc32(id);
    if (!succeeded(header.status(), "a submap's header") || !succeeded(crc.status(), "a submap's checksum")) {
      return false;
    }
    memories.submaps[memories.count] = {header.value().session_T_submap, crc.value()};
  }
  return true;
}

bool same(const Memories& a, const Memories& b) {
  bool all = a.count == b.count;
  for (std::uint32_t i = 0; all && i < a.count; ++i) {
    const Pose2& p = a.submaps[i].session_T_submap;
    const Pose2& q = b.submaps[i].session_T_submap;
    all = a.submaps[i].crc == b.submaps[i].crc && p.x == q.x && p.y == q.y && p.theta == q.theta;
  }
  return all;
}

/// Brings every grid back into memory; the store checks each record that it reads.
bool fetch_all(SubmapStore& store) {
  for (std::size_t i = 0; i < store.submap_count(); ++i) {
    Status status = store.begin_fetch(store.submap_id(i));
    while (status == Status::ok || status == Status::busy) {
      status = store.step_fetch();
      if (status == Status::ok) {
        break;
      }
    }
    if (!succeeded(status, "a submap's grid")) {
      return false;
    }
  }
  return true;
}

bool restart(const mellin_port& port, const Memories& before) {
  Slam* const slam = create(port);
  if (slam == nullptr) {
    return false;
  }
  while (slam->work(1)) {
  }
  Memories after;
  if (!remember(slam->store(), after) || !fetch_all(slam->store())) {
    return false;
  }
  print("hello: after the restart ", after.count, " submaps, ", slam->collection().size(), " of them in the map\n");
  return must(same(before, after) && slam->collection().size() == before.count,
              "the flash does not give back the submaps that were stored");
}

}  // namespace

bool hello(const mellin_port& port) {
  print("hello: memory ", sizeof memory, " bytes\n");
  if (port.flash.block_count == 0) {
    print("hello: FAILED: the port has no flash\n");
    return false;
  }
  static Memories stored;
  Slam* const slam = erase_all(port.flash) ? create(port) : nullptr;
  if (slam == nullptr || !map_the_room(*slam, port) || !remember(slam->store(), stored)) {
    return false;
  }
  print("hello: ", stored.count, " submaps in ", slam->store().statistics().logical_bytes, " bytes of flash\n");
  return must(stored.count > 0, "no submap was stored") &&
         must(slam->statistics().submaps_lost == 0, "a submap was lost") && restart(port, stored);
}

}  // namespace mellin::image
