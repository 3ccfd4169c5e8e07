// The C interface: a run in C99 gives bit for bit what the same run in C++ gives, each setting reaches the field that
// it names, and each error path returns its status.
#include "mellin/c_interface.hpp"

#include <doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "host/heap_counter.hpp"
#include "posix/clock.hpp"
#include "ramflash/heap_flash.hpp"
#include "tests/support/c_drive.h"
#include "tests/support/room.hpp"
#include "tests/support/simulated_log.hpp"

using namespace mellin;
using mellin::test::measure;
using mellin::test::room;
using mellin::test::span;

namespace {

constexpr std::uint16_t kBeams = 90;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The run's configuration, set by hand in C++.
Config drive_config() {
  Config config = nano_profile();
  config.lasers[0].beams = kBeams;
  config.lasers[0].angle_increment_rad = 3.14159265F / static_cast<float>(kBeams);
  config.lasers[0].max_range_m = 20.0F;
  config.lasers[0].base_T_laser.x = 0.1;
  config.cell_m = 0.1F;
  config.mapper.particles = 3;
  config.seed = 7;
  config.submaps.every_scans = 4;
  config.mapper.take_distance_m = 0.3F;
  config.mapper.noise.angle_per_rad = 0.1F;
  return config;
}

mellin_config c_drive_config() {
  mellin_config config = {};
  REQUIRE(::c_drive_config(&config, kBeams) == MELLIN_OK);
  return config;
}

/// A robot that circles in the room, with odometry that drifts; one scan in the middle is not what it claims to be.
class Drive {
 public:
  explicit Drive(int scans) {
    const Config config = drive_config();
    Pose2 odometry;
    for (int i = 0; i < scans; ++i) {
      if (i > 0) {
        const Pose2 moved = between(on_circle(i - 1), on_circle(i));
        odometry = compose(odometry, {1.03 * moved.x, moved.y, 1.05 * moved.theta});
      }
      ranges_.push_back(measure(room(), on_circle(i), config.lasers[0]));
      scans_.push_back({i * 100000, span(ranges_.back()), odometry, static_cast<std::uint8_t>(i == scans / 2 ? 3 : 0)});
    }
  }
  const std::vector<Scan>& scans() const { return scans_; }
  std::vector<mellin_scan> c_scans() const {
    std::vector<mellin_scan> out;
    for (const Scan& s : scans_) {
      out.push_back({s.stamp_us, s.ranges_m.data(), s.ranges_m.size(), c_pose(s.odom_T_base), s.laser});
    }
    return out;
  }

  static Pose2 on_circle(int step) {
    const double angle = 0.15 * step;
    return {2.0 * std::cos(angle) - 1.0, 1.5 * std::sin(angle), angle + kHalfPi};
  }

 private:
  std::vector<std::vector<float>> ranges_;
  std::vector<Scan> scans_;
};

/// Memory, flash and port of one system.
struct Board {
  port::HeapFlash flash{port::FlashGeometry{4096, 512, 256}};
  mellin_port port = {};
  std::vector<std::uint64_t> memory;
  std::size_t bytes = 0;

  explicit Board(std::size_t size) : memory((size + 7) / 8), bytes(size) { port.flash = flash.flash(); }
};

mellin_slam* c_create(Board& board, const mellin_config& config) {
  mellin_slam* slam = nullptr;
  REQUIRE(mellin_create(&config, board.memory.data(), board.bytes, &board.port, &slam) == MELLIN_OK);
  REQUIRE(slam != nullptr);
  return slam;
}

void drain(Slam& slam, std::uint32_t slices) {
  bool more = slam.work(slices == 0 ? 64 : slices);
  while (slices == 0 && more) {
    more = slam.work(64);
  }
}

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }
bool same_bits(const mellin_pose2& a, const Pose2& b) {
  return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.theta, b.theta);
}
bool same_bits(const mellin_sym3& a, const Sym3& b) {
  return same_bits(a.xx, b.xx) && same_bits(a.xy, b.xy) && same_bits(a.xt, b.xt) && same_bits(a.yy, b.yy) &&
         same_bits(a.yt, b.yt) && same_bits(a.tt, b.tt);
}

/// The same session through C++; each step is compared with what C saw.
void follow(Slam& slam, const std::vector<Scan>& scans, std::uint32_t slices, const std::vector<c_drive_step>& steps) {
  REQUIRE(steps.size() == scans.size());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    CAPTURE(i);
    const c_drive_step& c = steps[i];
    const Result<ScanOutcome> outcome = slam.add(scans[i]);
    REQUIRE(static_cast<int>(c.added) == static_cast<int>(outcome.status()));
    if (outcome.ok()) {
      const ScanOutcome& o = outcome.value();
      CHECK(static_cast<int>(c.outcome.use) == static_cast<int>(o.use));
      CHECK(c.outcome.taken == o.taken);
      CHECK(c.outcome.anchor_scan == o.anchor_scan);
      CHECK(same_bits(c.outcome.session_T_base, o.session_T_base));
      CHECK(same_bits(c.outcome.anchor_T_base, o.anchor_T_base));
    }
    drain(slam, slices);
    CHECK(same_bits(c.pose, slam.pose()));
    CHECK(same_bits(c.covariance, slam.covariance()));
    CHECK(same_bits(c.map_pose, slam.map_pose().map_T_base));
    CHECK(c.component == slam.map_pose().component);
  }
  REQUIRE(slam.begin_flush() == Status::ok);
  drain(slam, 0);
}

void compare_maps(const mellin_slam* c, const MapCollection& map) {
  REQUIRE(mellin_submap_count(c) == map.size());
  for (SubmapId id = 0; id < map.size(); ++id) {
    mellin_submap submap = {};
    REQUIRE(mellin_read_submap(c, id, &submap) == MELLIN_OK);
    CHECK(submap.id == id);
    CHECK(submap.component == map.component(id));
    CHECK(submap.session == map.session_of(id));
    CHECK(submap.stamp_us == map.header(id).stamp_us);
    CHECK(submap.first_scan == map.header(id).first_scan);
    CHECK(submap.scan_count == map.header(id).scan_count);
    CHECK(same_bits(submap.map_T_submap, map.map_T_submap(id)));
    CHECK(same_bits(submap.session_T_submap, map.header(id).session_T_submap));
  }
  REQUIRE(mellin_edge_count(c) == map.graph().edge_count());
  for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
    const Edge& want = map.graph().edge(id);
    mellin_edge edge = {};
    REQUIRE(mellin_read_edge(c, id, &edge) == MELLIN_OK);
    CHECK(edge.a == want.a);
    CHECK(edge.b == want.b);
    CHECK(static_cast<int>(edge.kind) == static_cast<int>(want.kind));
    CHECK(edge.enabled == want.enabled);
    CHECK(same_bits(edge.a_T_b, want.a_T_b));
    CHECK(same_bits(edge.information, want.information));
  }
}

void compare_statistics(const mellin_slam* c, const Slam& slam) {
  mellin_statistics have = {};
  REQUIRE(mellin_read_statistics(c, &have) == MELLIN_OK);
  const MapperStatistics& m = slam.mapper().statistics();
  CHECK(have.mapper.scans == m.scans);
  CHECK(have.mapper.taken == m.taken);
  CHECK(have.mapper.unmatched == m.unmatched);
  CHECK(have.mapper.refused == m.refused);
  CHECK(have.mapper.resampled == m.resampled);
  CHECK(have.mapper.recovered == m.recovered);
  CHECK(have.mapper.doubted == m.doubted);
  CHECK(have.mapper.lost == m.lost);
  const SlamStatistics& s = slam.statistics();
  CHECK(have.slam.submaps_due == s.submaps_due);
  CHECK(have.slam.submaps_delayed == s.submaps_delayed);
  CHECK(have.slam.submaps_lost == s.submaps_lost);
  const CollectionStatistics& p = slam.collection().statistics();
  CHECK(have.collection.pairs_possible == p.pairs_possible);
  CHECK(have.collection.pairs_screened == p.pairs_screened);
  CHECK(have.collection.pairs_registered == p.pairs_registered);
  CHECK(have.collection.pairs_accepted == p.pairs_accepted);
  CHECK(have.collection.edges_rejected == p.edges_rejected);
  CHECK(have.collection.fetches_failed == p.fetches_failed);
  CHECK(have.collection.stored == p.stored);
  CHECK(have.collection.not_stored == p.not_stored);
  CHECK(have.collection.optimisations == p.optimisations);
  mellin_store_statistics flash = {};
  REQUIRE(mellin_read_store_statistics(c, &flash) == MELLIN_OK);
  const StoreStatistics f = slam.store().statistics();
  CHECK(flash.submaps == f.submaps);
  CHECK(flash.blobs == f.blobs);
  CHECK(flash.logical_bytes == f.logical_bytes);
  CHECK(flash.programmed_bytes == f.programmed_bytes);
  CHECK(flash.erases == f.erases);
  CHECK(flash.max_block_erases == f.max_block_erases);
  CHECK(flash.free_bytes == f.free_bytes);
  CHECK(flash.lost_records == f.lost_records);
  CHECK(flash.damaged_blocks == f.damaged_blocks);
}

void compare_live_maps(const mellin_slam* c, const CountingGrid& map) {
  mellin_window window = {};
  REQUIRE(mellin_live_window(c, &window) == MELLIN_OK);
  CHECK(CellRect{window.column_min, window.row_min, window.column_end, window.row_end} == map.window());
  REQUIRE(window.side == map.side());
  std::vector<std::uint8_t> submap_row(window.side);
  std::vector<std::uint8_t> ros_row(window.side);
  std::size_t wrong = 0;
  std::size_t walls = 0;
  std::size_t unknown = 0;
  for (std::int32_t row = window.row_min; row < window.row_end; ++row) {
    REQUIRE(mellin_read_live_row(c, row, MELLIN_CELLS_SUBMAP, submap_row.data(), submap_row.size()) == MELLIN_OK);
    REQUIRE(mellin_read_live_row(c, row, MELLIN_CELLS_ROS, ros_row.data(), ros_row.size()) == MELLIN_OK);
    for (std::int32_t column = window.column_min; column < window.column_end; ++column) {
      const CellCount& cell = map.at(column, row);
      const bool seen = cell.observations > 0;
      const double share = seen ? static_cast<double>(cell.hits) / cell.observations : 0.0;
      const auto i = static_cast<std::size_t>(column - window.column_min);
      wrong += submap_row[i] == (seen ? std::floor(254.0 * share + 0.5) : 255.0) ? 0U : 1U;
      wrong += ros_row[i] == (seen ? std::floor(100.0 * share + 0.5) : 255.0) ? 0U : 1U;
      walls += share > 0.5 ? 1U : 0U;
      unknown += seen ? 0U : 1U;
      // One by one, by number and by a point inside.
      std::uint8_t one = 0;
      REQUIRE(mellin_live_cell(c, column, row, MELLIN_CELLS_SUBMAP, &one) == MELLIN_OK);
      wrong += one == submap_row[i] ? 0U : 1U;
      const double edge = static_cast<double>(window.cell_m);
      REQUIRE(mellin_live_cell_at(c, (column + 0.5) * edge, (row + 0.5) * edge, MELLIN_CELLS_ROS, &one) == MELLIN_OK);
      wrong += one == ros_row[i] ? 0U : 1U;
    }
  }
  CHECK(wrong == 0);
  CHECK(walls > 100);
  CHECK(unknown > 100);
}

}  // namespace

TEST_CASE("a run in C99 over two sessions gives the bits of the same run in C++") {
  const Drive drive(test::kSanitized ? 70 : 150);
  const mellin_config config = c_drive_config();
  const Config same = drive_config();
  REQUIRE(mellin_required_bytes(&config) == required_bytes(same));
  Board c_board(required_bytes(same));
  Board board(required_bytes(same));
  mellin_slam* const c = c_create(c_board, config);
  Result<Slam*> made = Slam::create(same, {reinterpret_cast<std::byte*>(board.memory.data()), board.bytes}, board.port);
  REQUIRE(made.ok());
  Slam& slam = *made.value();

  std::vector<c_drive_step> steps(drive.scans().size());
  REQUIRE(c_drive(c, drive.c_scans().data(), steps.size(), 0, steps.data()) == MELLIN_OK);
  follow(slam, drive.scans(), 0, steps);
  compare_live_maps(c, slam.live_map());

  // A second session, from a pose of its own, with little time for the background work.
  const mellin_pose2 start = {3.0, -2.0, 1.0};
  REQUIRE(mellin_new_session(c, &start) == MELLIN_OK);
  REQUIRE(slam.new_session({3.0, -2.0, 1.0}) == Status::ok);
  mellin_pose2 pose = {};
  REQUIRE(mellin_pose(c, &pose, nullptr) == MELLIN_OK);
  CHECK(same_bits(pose, Pose2{3.0, -2.0, 1.0}));
  std::uint32_t component = 0;
  REQUIRE(mellin_map_pose(c, &pose, &component) == MELLIN_OK);
  CHECK(component == MELLIN_NO_SUBMAP);
  REQUIRE(c_drive(c, drive.c_scans().data(), steps.size(), 40, steps.data()) == MELLIN_OK);
  follow(slam, drive.scans(), 40, steps);

  compare_maps(c, slam.collection());
  compare_statistics(c, slam);
  CHECK(c_board.flash.bytes() == board.flash.bytes());
  // The run was one worth comparing, and counters run over both sessions.
  CHECK(mellin_submap_count(c) > 4);
  mellin_statistics statistics = {};
  REQUIRE(mellin_read_statistics(c, &statistics) == MELLIN_OK);
  CHECK(statistics.mapper.refused == 2);
  CHECK(statistics.mapper.scans == 2 * drive.scans().size());
  CHECK(statistics.collection.stored == mellin_submap_count(c));
  if (!test::kSanitized) {
    CHECK(statistics.collection.pairs_accepted > 0);
  }
}

TEST_CASE("another seed gives another run: the comparison can fail") {
  const Drive drive(60);
  mellin_config config = c_drive_config();
  std::vector<c_drive_step> steps[2];
  for (std::vector<c_drive_step>& run : steps) {
    Board board(mellin_required_bytes(&config));
    run.resize(drive.scans().size());
    REQUIRE(c_drive(c_create(board, config), drive.c_scans().data(), run.size(), 0, run.data()) == MELLIN_OK);
    ++config.seed;
  }
  CHECK_FALSE(same_bits(steps[0].back().pose, pose_of(steps[1].back().pose)));
}

TEST_CASE("one system through both interfaces: a handle is the object") {
  const mellin_config config = c_drive_config();
  Board board(mellin_required_bytes(&config));
  mellin_slam* const c = c_create(board, config);
  Slam& slam = slam_of(*c);
  CHECK(handle_of(slam) == c);
  CHECK(slam.config().seed == 7);
  REQUIRE(slam.new_session({1.0, 2.0, 0.5}) == Status::ok);
  mellin_pose2 pose = {};
  REQUIRE(mellin_pose(c, &pose, nullptr) == MELLIN_OK);
  CHECK(same_bits(pose, Pose2{1.0, 2.0, 0.5}));
}

TEST_CASE("each error path returns its status") {
  mellin_config config = c_drive_config();
  config.max_sessions = 2;
  Board board(mellin_required_bytes(&config));
  mellin_slam* slam = nullptr;
  CHECK(mellin_create(&config, reinterpret_cast<char*>(board.memory.data()) + 1, board.bytes, &board.port, &slam) ==
        MELLIN_INVALID_ARGUMENT);
  CHECK(mellin_create(&config, board.memory.data(), 8, &board.port, &slam) == MELLIN_INSUFFICIENT_MEMORY);
  mellin_port failing = board.port;
  failing.flash.read = [](void*, std::uint32_t, void*, std::uint32_t) { return -1; };
  CHECK(mellin_create(&config, board.memory.data(), board.bytes, &failing, &slam) == MELLIN_DEVICE_ERROR);
  CHECK(slam == nullptr);
  slam = c_create(board, config);

  // Scans.
  const Drive drive(40);
  std::vector<mellin_scan> scans = drive.c_scans();
  mellin_scan_outcome outcome = {};
  outcome.anchor_scan = 77;
  const auto refused = [&](const mellin_scan& scan) {
    CHECK(mellin_add(slam, &scan, &outcome) == MELLIN_BAD_DATA);
    CHECK(outcome.anchor_scan == 77);
  };
  mellin_scan bad = scans[0];
  --bad.range_count;
  refused(bad);
  bad = scans[0];
  bad.laser = 255;
  refused(bad);
  bad = scans[0];
  bad.odom_T_base.theta = kNaN;
  refused(bad);
  CHECK(mellin_add(slam, scans.data(), nullptr) == MELLIN_OK);

  // The live map, 16 m round the robot at the origin.
  mellin_window window = {};
  REQUIRE(mellin_live_window(slam, &window) == MELLIN_OK);
  std::uint8_t cell = 1;
  std::vector<std::uint8_t> row(window.side);
  const auto wrong = static_cast<mellin_cell_format>(2);
  CHECK(mellin_live_cell(slam, window.column_end, 0, MELLIN_CELLS_ROS, &cell) == MELLIN_NOT_FOUND);
  CHECK(mellin_live_cell(slam, 0, window.row_min - 1, MELLIN_CELLS_ROS, &cell) == MELLIN_NOT_FOUND);
  CHECK(mellin_live_cell(slam, 0, 0, wrong, &cell) == MELLIN_INVALID_ARGUMENT);
  CHECK(mellin_live_cell_at(slam, kNaN, 0.0, MELLIN_CELLS_ROS, &cell) == MELLIN_INVALID_ARGUMENT);
  CHECK(mellin_live_cell_at(slam, 0.0, INFINITY, MELLIN_CELLS_ROS, &cell) == MELLIN_INVALID_ARGUMENT);
  CHECK(mellin_live_cell_at(slam, 0.0, 0.0, wrong, &cell) == MELLIN_INVALID_ARGUMENT);
  CHECK(mellin_live_cell_at(slam, 100.0, 0.0, MELLIN_CELLS_ROS, &cell) == MELLIN_NOT_FOUND);
  CHECK(mellin_live_cell_at(slam, 0.0, -1e300, MELLIN_CELLS_ROS, &cell) == MELLIN_NOT_FOUND);
  CHECK(cell == 1);
  CHECK(mellin_read_live_row(slam, window.row_end, MELLIN_CELLS_ROS, row.data(), row.size()) == MELLIN_NOT_FOUND);
  CHECK(mellin_read_live_row(slam, 0, wrong, row.data(), row.size()) == MELLIN_INVALID_ARGUMENT);
  CHECK(mellin_read_live_row(slam, 0, MELLIN_CELLS_ROS, row.data(), row.size() - 1) == MELLIN_INVALID_ARGUMENT);

  // The map.
  mellin_submap submap = {};
  mellin_edge edge = {};
  CHECK(mellin_read_submap(slam, 0, &submap) == MELLIN_NOT_FOUND);
  CHECK(mellin_read_edge(slam, 0, &edge) == MELLIN_NOT_FOUND);

  // Sessions.
  const mellin_pose2 nowhere = {kNaN, 0.0, 0.0};
  CHECK(mellin_new_session(slam, &nowhere) == MELLIN_INVALID_ARGUMENT);
  std::vector<c_drive_step> steps(scans.size());
  REQUIRE(c_drive(slam, scans.data(), scans.size(), 0, steps.data()) == MELLIN_OK);
  CHECK(mellin_submap_count(slam) > 0);
  REQUIRE(mellin_begin_flush(slam) == MELLIN_OK);
  CHECK(mellin_new_session(slam, nullptr) == MELLIN_BUSY);
  CHECK(mellin_work(slam, 1) == MELLIN_BUSY);
  while (mellin_work(slam, 1) == MELLIN_BUSY) {
  }
  CHECK(mellin_work(slam, 1) == MELLIN_OK);
  REQUIRE(mellin_new_session(slam, nullptr) == MELLIN_OK);
  REQUIRE(c_drive(slam, scans.data(), scans.size(), 0, steps.data()) == MELLIN_OK);
  CHECK(mellin_new_session(slam, nullptr) == MELLIN_FULL);

  // The flash holds all sessions that there may be; or another configuration's map; or none of ours.
  mellin_slam* again = nullptr;
  CHECK(mellin_create(&config, board.memory.data(), board.bytes, &board.port, &again) == MELLIN_FULL);
  mellin_config other = config;
  other.cell_m = 0.2F;
  CHECK(mellin_create(&other, board.memory.data(), board.bytes, &board.port, &again) == MELLIN_VERSION_MISMATCH);
  std::fill(board.flash.bytes().begin(), board.flash.bytes().end(), std::uint8_t{0x5A});
  CHECK(mellin_create(&config, board.memory.data(), board.bytes, &board.port, &again) == MELLIN_BAD_DATA);
  CHECK(again == nullptr);
}

#ifdef NDEBUG
TEST_CASE("null pointers are refused, and change nothing") {
  const mellin_config config = c_drive_config();
  Board board(mellin_required_bytes(&config));
  mellin_slam* slam = c_create(board, config);
  mellin_slam* out = slam;
  void* const memory = board.memory.data();
  mellin_memory_use use = {};
  mellin_pose2 pose = {};
  mellin_window window = {};
  std::uint8_t cell = 0;
  mellin_submap submap = {};
  mellin_edge edge = {};
  mellin_statistics statistics = {};
  mellin_store_statistics store = {};
  const mellin_scan no_ranges = {};
  const mellin_status all[] = {
      mellin_config_init(nullptr, MELLIN_PROFILE_MICRO),
      mellin_required_memory(nullptr, &use),
      mellin_required_memory(&config, nullptr),
      mellin_create(nullptr, memory, board.bytes, nullptr, &out),
      mellin_create(&config, nullptr, board.bytes, nullptr, &out),
      mellin_create(&config, memory, board.bytes, nullptr, nullptr),
      mellin_create_split(nullptr, memory, board.bytes, memory, board.bytes, nullptr, &out),
      mellin_create_split(&config, nullptr, board.bytes, memory, board.bytes, nullptr, &out),
      mellin_create_split(&config, memory, board.bytes, nullptr, board.bytes, nullptr, &out),
      mellin_create_split(&config, memory, board.bytes, memory, board.bytes, nullptr, nullptr),
      mellin_add(nullptr, &no_ranges, nullptr),
      mellin_add(slam, nullptr, nullptr),
      mellin_add(slam, &no_ranges, nullptr),
      mellin_work(nullptr, 1),
      mellin_begin_flush(nullptr),
      mellin_new_session(nullptr, &pose),
      mellin_pose(nullptr, &pose, nullptr),
      mellin_pose(slam, nullptr, nullptr),
      mellin_map_pose(nullptr, &pose, nullptr),
      mellin_map_pose(slam, nullptr, nullptr),
      mellin_live_window(nullptr, &window),
      mellin_live_window(slam, nullptr),
      mellin_live_cell(nullptr, 0, 0, MELLIN_CELLS_ROS, &cell),
      mellin_live_cell(slam, 0, 0, MELLIN_CELLS_ROS, nullptr),
      mellin_live_cell_at(nullptr, 0.0, 0.0, MELLIN_CELLS_ROS, &cell),
      mellin_live_cell_at(slam, 0.0, 0.0, MELLIN_CELLS_ROS, nullptr),
      mellin_read_live_row(nullptr, 0, MELLIN_CELLS_ROS, &cell, 1),
      mellin_read_live_row(slam, 0, MELLIN_CELLS_ROS, nullptr, 160),
      mellin_read_submap(nullptr, 0, &submap),
      mellin_read_submap(slam, 0, nullptr),
      mellin_read_edge(nullptr, 0, &edge),
      mellin_read_edge(slam, 0, nullptr),
      mellin_read_statistics(nullptr, &statistics),
      mellin_read_statistics(slam, nullptr),
      mellin_read_store_statistics(nullptr, &store),
      mellin_read_store_statistics(slam, nullptr),
      mellin_read_memory_use(nullptr, &use),
      mellin_read_memory_use(slam, nullptr),
  };
  for (std::size_t i = 0; i < sizeof all / sizeof *all; ++i) {
    CAPTURE(i);
    CHECK(all[i] == MELLIN_INVALID_ARGUMENT);
  }
  CHECK(mellin_required_bytes(nullptr) == 0);
  CHECK(mellin_submap_count(nullptr) == 0);
  CHECK(mellin_edge_count(nullptr) == 0);
  CHECK(out == slam);
  CHECK(mellin_work(slam, 1) == MELLIN_OK);
}
#else
TEST_CASE("a null pointer is an assert where asserts are on") {
  const pid_t child = fork();
  if (child == 0) {
    (void)close(STDERR_FILENO);
    (void)signal(SIGABRT, SIG_DFL);
    (void)mellin_work(nullptr, 1);
    _exit(0);
  }
  REQUIRE(child > 0);
  int ended = 0;
  REQUIRE(waitpid(child, &ended, 0) == child);
  CHECK(WIFSIGNALED(ended));
  CHECK(WTERMSIG(ended) == SIGABRT);
}
#endif

TEST_CASE("the C interface leaves the heap alone, and the port's clock is counted") {
  const mellin_config config = c_drive_config();
  Board board(mellin_required_bytes(&config));
  board.port.clock = posix::monotonic_clock();
  const Drive drive(45);
  const std::vector<mellin_scan> scans = drive.c_scans();
  std::vector<c_drive_step> steps(scans.size());
  mellin_slam* slam = nullptr;
  host::reset_heap_counts();
  mellin_status created = MELLIN_OK;
  mellin_status driven = MELLIN_OK;
  {
    const host::LibraryCall inside;
    created = mellin_create(&config, board.memory.data(), board.bytes, &board.port, &slam);
    driven = created == MELLIN_OK ? c_drive(slam, scans.data(), scans.size(), 0, steps.data()) : created;
  }
  CHECK(created == MELLIN_OK);
  REQUIRE(driven == MELLIN_OK);
  CHECK(host::heap_counts().allocations == 0);
  mellin_statistics statistics = {};
  REQUIRE(mellin_read_statistics(slam, &statistics) == MELLIN_OK);
  CHECK(statistics.slam.mapping_us > 0);
  CHECK(statistics.slam.rendering_us > 0);
  CHECK(statistics.collection.store_us > 0);
}
