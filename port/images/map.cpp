// The main job on a board: maps a stream of scans in memory given once, writes the trajectory and the graph to the
// board's host, and prints hashes of what came out, so that two machines can be compared bit by bit, and what it cost.
//
// arguments: SCANS FOLDER [key=value…]
//   SCANS   what `mellin record` makes of a log
//   FOLDER  where live.tum, trajectory.tum and graph.g2o go; must exist
//   keys    profile=micro|nano, seed=N, particles=N, submaps=N (how many are kept)
#include <cstdlib>
#include <cstring>

#include "board.h"
#include "images/cost.hpp"
#include "images/hash.hpp"
#include "images/print.hpp"
#include "images/scan_stream.hpp"
#include "images/text_file.hpp"
#include "mellin/slam.hpp"
#include "ramflash/flash_model.hpp"

namespace mellin::image {
namespace {

constexpr port::FlashGeometry kGeometry{4096, 2048, 256};  // 8 MiB

alignas(kArenaAlignment) std::byte arena[MELLIN_ARENA_BYTES];
__attribute__((section(".bulk"))) std::uint8_t flash_bytes[kGeometry.bytes()];

struct Arguments {
  const char* scans = nullptr;
  const char* folder = nullptr;
  Config config;
};

/// A name in the folder.
struct Path {
  char text[256] = {};
  Path(const char* folder, const char* name) {
    std::strncat(text, folder, 200);
    std::strncat(text, "/", 2);
    std::strncat(text, name, 50);
  }
};

bool apply(Config& config, const char* key, const char* value) {
  const unsigned long number = std::strtoul(value, nullptr, 10);
  if (std::strcmp(key, "profile") == 0) {
    const bool micro = std::strcmp(value, "micro") == 0;
    config = micro ? micro_profile() : nano_profile();
    return micro || std::strcmp(value, "nano") == 0;
  }
  if (std::strcmp(key, "seed") == 0) {
    config.seed = number;
  } else if (std::strcmp(key, "particles") == 0) {
    config.mapper.particles = static_cast<std::uint16_t>(number);
  } else if (std::strcmp(key, "submaps") == 0) {
    config.max_submaps = static_cast<std::uint32_t>(number);
  } else {
    return false;
  }
  return true;
}

/// Cuts the next word off a line; nullptr at its end.
char* next_word(char*& line) {
  char* const word = line;
  if (word == nullptr || *word == '\0') {
    return nullptr;
  }
  line = std::strchr(word, ' ');
  if (line != nullptr) {
    *line++ = '\0';
  }
  return word;
}

/// Takes the command line apart, which it changes. Returns what is wrong with it, or nullptr.
const char* parse(char* line, Arguments& arguments) {
  (void)next_word(line);  // the program
  arguments.scans = next_word(line);
  arguments.folder = next_word(line);
  for (char* word = next_word(line); word != nullptr; word = next_word(line)) {
    char* const equals = std::strchr(word, '=');
    if (equals == nullptr) {
      return "expected key=value after the scans and the folder";
    }
    *equals = '\0';
    if (!apply(arguments.config, word, equals + 1)) {
      return "keys are profile=micro|nano, seed, particles, submaps";
    }
  }
  return arguments.folder == nullptr ? "expected: SCANS FOLDER [key=value…]" : nullptr;
}

std::uint64_t ticks(void*) { return board_ticks(); }

void log_line(void*, mellin_log_level level, const char* line) {
  if (level == MELLIN_LOG_WARNING) {
    print("mellin: ", line, "\n");
  }
}

/// The run: the system, what it cost, and the live poses as they came.
class Job {
 public:
  Job(Slam& slam, const char* folder) : slam_(slam), folder_(folder) {}

  bool run(ScanReader& reader) {
    if (!live_.open(Path(folder_, "live.tum").text) || !open_poses(BOARD_WRITE)) {
      print("a file in ", folder_, " cannot be written\n");
      return false;
    }
    Scan scan;
    while (reader.next(scan)) {
      add(scan);
      drain();
    }
    (void)slam_.begin_flush();
    drain();
    const bool written = live_.close() && board_close(poses_) == 0 && complete_;
    return written && write_trajectory() && write_graph();
  }

  const Hash& trajectory_hash() const { return trajectory_hash_; }
  const Costs& costs() const { return costs_; }

 private:
  /// What final_pose() needs of a scan, as it lies in the file poses.bin.
  struct ScanRecord {
    std::int64_t stamp_us;
    std::uint64_t anchor_scan;
    Pose2 session_T_base;
  };

  bool open_poses(int mode) {
    poses_ = board_open(Path(folder_, "poses.bin").text, mode);
    return poses_ >= 0;
  }

  void add(const Scan& scan) {
    const std::uint64_t before = board_ticks();
    const Result<ScanOutcome> outcome = slam_.add(scan);
    const std::uint64_t spent = board_ticks() - before;
    if (!outcome.ok()) {
      return;
    }
    costs_.add(outcome.value().taken ? Cost::taken_scan : Cost::other_scan, spent);
    const Pose2& pose = outcome.value().session_T_base;
    trajectory_hash_.add(static_cast<std::uint64_t>(scan.stamp_us));
    trajectory_hash_.add(pose.x);
    trajectory_hash_.add(pose.y);
    trajectory_hash_.add(pose.theta);
    put_tum(live_, scan.stamp_us, pose);
    const ScanRecord record{scan.stamp_us, outcome.value().anchor_scan, pose};
    complete_ = board_write(poses_, &record, sizeof record) == sizeof record && complete_;
  }

  /// All background work, slice by slice.
  void drain() {
    for (bool more = true; more;) {
      const std::uint64_t before = board_ticks();
      const StageClocks stages(slam_);
      more = slam_.work(1);
      costs_.add(stages.ran(slam_), board_ticks() - before);
    }
  }

  /// The pose in the map: live poses move with the submap that the scan's anchor is in.
  Pose2 final_pose(const ScanRecord& record) const {
    const MapCollection& map = slam_.collection();
    SubmapId home = kNoSubmap;
    for (SubmapId id = 0; id < map.size() && (id == 0 || map.header(id).first_scan <= record.anchor_scan); ++id) {
      home = id;
    }
    return home == kNoSubmap
               ? record.session_T_base
               : compose(map.map_T_submap(home), between(map.header(home).session_T_submap, record.session_T_base));
  }

  bool write_trajectory() {
    TextFile out;
    if (!open_poses(BOARD_READ) || !out.open(Path(folder_, "trajectory.tum").text)) {
      return false;
    }
    ScanRecord record{};
    while (board_read(poses_, &record, sizeof record) == sizeof record) {
      put_tum(out, record.stamp_us, final_pose(record));
    }
    return board_close(poses_) == 0 && out.close();
  }

  bool write_graph() const {
    const PoseGraph& graph = slam_.collection().graph();
    TextFile out;
    if (!out.open(Path(folder_, "graph.g2o").text)) {
      return false;
    }
    for (NodeId i = 0; i < graph.node_count(); ++i) {
      const Pose2& p = graph.pose(i);
      out << "VERTEX_SE2 " << i << " " << p.x << " " << p.y << " " << p.theta << "\n";
    }
    for (EdgeId i = 0; i < graph.edge_count(); ++i) {
      const Edge& e = graph.edge(i);
      const Sym3& n = e.information;
      if (e.enabled) {
        out << "EDGE_SE2 " << e.a << " " << e.b << " " << e.a_T_b.x << " " << e.a_T_b.y << " " << e.a_T_b.theta << " "
            << n.xx << " " << n.xy << " " << n.xt << " " << n.yy << " " << n.yt << " " << n.tt << "\n";
      }
    }
    return out.close();
  }

  Slam& slam_;
  const char* folder_;
  TextFile live_;
  int poses_ = -1;
  bool complete_ = true;
  Hash trajectory_hash_;
  Costs costs_;
};

Hash hash_of(const PoseGraph& graph) {
  Hash hash;
  for (NodeId i = 0; i < graph.node_count(); ++i) {
    const Pose2& p = graph.pose(i);
    for (const double number : {p.x, p.y, p.theta}) {
      hash.add(number);
    }
  }
  for (EdgeId i = 0; i < graph.edge_count(); ++i) {
    const Edge& e = graph.edge(i);
    const Sym3& n = e.information;
    hash.add(std::uint64_t{e.a} << 32U | e.b);
    hash.add(static_cast<std::uint64_t>(e.kind) << 1U | (e.enabled ? 1U : 0U));
    for (const double number : {e.a_T_b.x, e.a_T_b.y, e.a_T_b.theta, n.xx, n.xy, n.xt, n.yy, n.yt, n.tt, e.weight}) {
      hash.add(number);
    }
  }
  return hash;
}

Hash hash_of(Span<const std::uint8_t> bytes) {
  Hash hash;
  for (const std::uint8_t byte : bytes) {
    hash.add_byte(byte);
  }
  return hash;
}

void print_hash(const char* what, const Hash& hash) {
  char digits[17] = {};
  for (int i = 0; i < 16; ++i) {
    digits[i] = "0123456789abcdef"[hash.value() >> (60 - 4 * i) & 15U];
  }
  print("hash ", what, " ", digits, "\n");
}

void report(const Slam& slam, const Job& job, const port::FlashModel& flash) {
  const MapCollection& map = slam.collection();
  const MapperStatistics& scans = slam.mapper().statistics();
  std::uint32_t loops = 0;
  for (EdgeId i = 0; i < map.graph().edge_count(); ++i) {
    loops += map.graph().edge(i).enabled && map.graph().edge(i).kind != EdgeKind::odometry ? 1U : 0U;
  }
  print("scans ", scans.scans, ", taken ", scans.taken, ", refused ", scans.refused, "; submaps ", map.size(),
        ", lost ", slam.statistics().submaps_lost, "; pairs screened ", map.statistics().pairs_screened,
        ", registered ", map.statistics().pairs_registered, "; loops ", loops, "\n");
  const ArenaUse& use = slam.arena_use();
  print("arena ", use.total(), " of ", sizeof arena, " bytes:");
  for (std::size_t part = 0; part < kPartCount; ++part) {
    print(" ", to_string(static_cast<Part>(part)), " ", use.by_part[part]);
  }
  print("\nflash programmed ", flash.counts().programmed_bytes, " bytes, erased ", flash.counts().erases, " blocks\n");
  if (board_stack_size() > 0) {
    print("stack used ", board_stack_size() - board_stack_untouched(), " of ", board_stack_size(), " bytes\n");
  }
  job.costs().print_table(map.statistics().pairs_screened, map.statistics().pairs_registered);
  print_hash("trajectory", job.trajectory_hash());
  print_hash("graph", hash_of(map.graph()));
  print_hash("flash", hash_of(flash.bytes()));
}

int run(char* line) {
  Arguments arguments;
  arguments.config = MELLIN_DEFAULT_PROFILE();
  const char* const wrong = parse(line, arguments);
  if (wrong != nullptr) {
    print(wrong, "\n");
    return 2;
  }
  static ScanReader reader;
  const char* const unreadable = reader.open(arguments.scans);
  if (unreadable != nullptr) {
    print(arguments.scans, " ", unreadable, "\n");
    return 1;
  }
  for (std::uint32_t i = 0; i < reader.lasers(); ++i) {
    arguments.config.lasers[i] = reader.laser(i);
  }
  static port::FlashModel flash(kGeometry, Span<std::uint8_t>(flash_bytes, sizeof flash_bytes));
  flash.erase_all();
  mellin_port port = {};
  port.flash = flash.flash();
  port.clock = {nullptr, ticks};
  port.log = {nullptr, log_line};
  const Result<Slam*> slam = Slam::create(arguments.config, Span<std::byte>(arena), port);
  if (!slam.ok()) {
    print("refused: ", to_string(slam.status()), "\n");
    return 1;
  }
  static Job job(*slam.value(), arguments.folder);
  if (!job.run(reader)) {
    print("not everything could be written to ", arguments.folder, "\n");
    return 1;
  }
  report(*slam.value(), job, flash);
  return 0;
}

}  // namespace
}  // namespace mellin::image

int main() {
  static char line[1024];
  if (board_arguments(line, sizeof line) != 0) {
    mellin::image::print("no command line\n");
    return 2;
  }
  return mellin::image::run(line);
}
