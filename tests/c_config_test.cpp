// The C interface's configuration and types: each setting reaches the field that it names, sizes are known beforehand,
// and what C and C++ see is the same.
#include <doctest.h>

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "host/settings.hpp"
#include "mellin/c_interface.hpp"
#include "tests/support/c_drive.h"

using namespace mellin;

// What c_interface.hpp shows.
constexpr mellin_config configuration() {
  mellin_config config = c_config(MELLIN_PROFILE_MICRO);
  config.lasers[0].beams = 180;
  return config;
}
extern "C" {
extern const mellin_config slam_config = configuration();
alignas(MELLIN_ARENA_ALIGNMENT) unsigned char slam_memory[required_bytes(config_of(configuration()))];
extern const std::size_t slam_memory_bytes = sizeof slam_memory;
}

namespace {

auto settings_of(const mellin_config& config) { return host::list_settings(config_of(config)); }

}  // namespace

TEST_CASE("a profile comes through unchanged, and each field changes the setting that it names and no other") {
  mellin_config config = {};
  REQUIRE(mellin_config_init(&config, MELLIN_PROFILE_DESKTOP) == MELLIN_OK);
  CHECK(settings_of(config) == host::list_settings(desktop_profile()));
  REQUIRE(mellin_config_init(&config, MELLIN_PROFILE_MICRO) == MELLIN_OK);
  CHECK(settings_of(config) == host::list_settings(micro_profile()));
  REQUIRE(mellin_config_init(&config, MELLIN_PROFILE_NANO) == MELLIN_OK);
  CHECK(settings_of(config) == host::list_settings(nano_profile()));

  struct Change {
    const char* name;
    std::function<void(mellin_config&)> make;
  };
  const Change changes[] = {
      {"seed", [](auto& c) { ++c.seed; }},
      {"cell_m", [](auto& c) { c.cell_m *= 2; }},
      {"side", [](auto& c) { ++c.side; }},
      {"screening_side", [](auto& c) { ++c.screening_side; }},
      {"registration_side", [](auto& c) { ++c.registration_side; }},
      {"class_side", [](auto& c) { ++c.class_side; }},
      {"remembered_scans", [](auto& c) { ++c.remembered_scans; }},
      {"max_submaps", [](auto& c) { ++c.max_submaps; }},
      {"max_sessions", [](auto& c) { ++c.max_sessions; }},
      {"grid_slots", [](auto& c) { ++c.grid_slots; }},
      {"mapper.particles", [](auto& c) { ++c.particles; }},
      {"mapper.spare_scans", [](auto& c) { ++c.spare_scans; }},
      {"mapper.take_distance_m", [](auto& c) { c.take_distance_m *= 2; }},
      {"mapper.take_angle_rad", [](auto& c) { c.take_angle_rad *= 2; }},
      {"mapper.noise.distance_base_m", [](auto& c) { c.noise.distance_base_m *= 2; }},
      {"mapper.noise.distance_per_m", [](auto& c) { c.noise.distance_per_m *= 2; }},
      {"mapper.noise.distance_per_rad", [](auto& c) { c.noise.distance_per_rad *= 2; }},
      {"mapper.noise.angle_base_rad", [](auto& c) { c.noise.angle_base_rad *= 2; }},
      {"mapper.noise.angle_per_m", [](auto& c) { c.noise.angle_per_m *= 2; }},
      {"mapper.noise.angle_per_rad", [](auto& c) { c.noise.angle_per_rad *= 2; }},
      {"mapper.odometry.learn_bias", [](auto& c) { c.odometry.learn_bias = !c.odometry.learn_bias; }},
      {"mapper.odometry.learn_noise", [](auto& c) { c.odometry.learn_noise = !c.odometry.learn_noise; }},
      {"mapper.odometry.memory_scans", [](auto& c) { ++c.odometry.memory_scans; }},
      {"mapper.odometry.scale_sigma", [](auto& c) { c.odometry.scale_sigma *= 2; }},
      {"mapper.odometry.angle_per_m_sigma", [](auto& c) { c.odometry.angle_per_m_sigma *= 2; }},
      {"mapper.odometry.angle_per_rad_sigma", [](auto& c) { c.odometry.angle_per_rad_sigma *= 2; }},
      {"mapper.odometry.least_noise", [](auto& c) { c.odometry.least_noise *= 2; }},
      {"mapper.odometry.most_noise", [](auto& c) { c.odometry.most_noise *= 2; }},
      {"submaps.every_scans", [](auto& c) { ++c.submap_every_scans; }},
      {"submaps.every_path_m", [](auto& c) { c.submap_every_path_m *= 2; }},
      {"submaps.max_path_m", [](auto& c) { c.submap_max_path_m *= 2; }},
      {"screening.cache_features", [](auto& c) { c.cache_features = !c.cache_features; }},
      {"collection.close_loops", [](auto& c) { c.close_loops = !c.close_loops; }},
      {"collection.candidates", [](auto& c) { ++c.candidates; }},
      {"linker.pending", [](auto& c) { ++c.pending_hypotheses; }},
      {"graph.max_edges", [](auto& c) { ++c.max_edges; }},
      {"graph.max_fill", [](auto& c) { ++c.max_fill; }},
  };
  const auto before = settings_of(config);
  for (const Change& change : changes) {
    CAPTURE(change.name);
    mellin_config changed = config;
    change.make(changed);
    const auto after = settings_of(changed);
    REQUIRE(after.size() == before.size());
    for (std::size_t i = 0; i < after.size(); ++i) {
      CAPTURE(after[i].first);
      CHECK((after[i].second != before[i].second) == (after[i].first == change.name));
    }
  }
  for (std::size_t i = 0; i < MELLIN_MAX_LASERS; ++i) {
    mellin_config changed = config;
    changed.lasers[i] = {360, -1.0F, 0.01F, 0.1F, 12.0F, {0.1, 0.2, 0.3}};
    const LaserConfig laser = config_of(changed).lasers[i];
    CHECK(laser.beams == 360);
    CHECK(laser.angle_min_rad == -1.0F);
    CHECK(laser.angle_increment_rad == 0.01F);
    CHECK(laser.min_range_m == 0.1F);
    CHECK(laser.max_range_m == 12.0F);
    CHECK(laser.base_T_laser.x == 0.1);
    CHECK(laser.base_T_laser.y == 0.2);
    CHECK(laser.base_T_laser.theta == 0.3);
  }
}

TEST_CASE("sizes are known at compile time too, and memory by region and part adds up") {
  const std::size_t all = slam_memory_bytes;
  CHECK(mellin_required_bytes(&slam_config) == all);
  mellin_memory_use required = {};
  REQUIRE(mellin_required_memory(&slam_config, &required) == MELLIN_OK);
  CHECK(required.bulk + required.fast == all);
  CHECK(required.fast > 0);
  std::size_t sum = 0;
  for (const std::size_t bytes : required.by_part) {
    sum += bytes;
  }
  CHECK(sum == all);

  // In one region, with one byte less, and in two regions.
  std::vector<std::uint64_t> bulk(required.bulk / 8);
  std::vector<std::uint64_t> fast(required.fast / 8);
  mellin_slam* slam = nullptr;
  CHECK(mellin_create(&slam_config, slam_memory, all - 1, nullptr, &slam) == MELLIN_INSUFFICIENT_MEMORY);
  CHECK(mellin_create(&slam_config, slam_memory, all, nullptr, &slam) == MELLIN_OK);
  CHECK(mellin_create_split(&slam_config, bulk.data(), required.bulk - 1, fast.data(), required.fast, nullptr, &slam) ==
        MELLIN_INSUFFICIENT_MEMORY);
  CHECK(mellin_create_split(&slam_config, bulk.data(), required.bulk, fast.data(), required.fast - 1, nullptr, &slam) ==
        MELLIN_INSUFFICIENT_MEMORY);
  REQUIRE(mellin_create_split(&slam_config, bulk.data(), required.bulk, fast.data(), required.fast, nullptr, &slam) ==
          MELLIN_OK);
  mellin_memory_use used = {};
  REQUIRE(mellin_read_memory_use(slam, &used) == MELLIN_OK);
  CHECK(std::memcmp(&used, &required, sizeof used) == 0);
}

TEST_CASE("types have the same size in C and in C++, and enums 32 bits") {
  std::size_t c[C_DRIVE_TYPES] = {};
  REQUIRE(c_drive_sizes(c) == C_DRIVE_TYPES);
  const std::size_t cpp[C_DRIVE_TYPES] = {sizeof(mellin_status),
                                          sizeof(mellin_pose2),
                                          sizeof(mellin_sym3),
                                          sizeof(mellin_profile),
                                          sizeof(mellin_laser),
                                          sizeof(mellin_motion_noise),
                                          sizeof(mellin_odometry_learning),
                                          sizeof(mellin_config),
                                          sizeof(mellin_part),
                                          sizeof(mellin_memory_use),
                                          sizeof(mellin_scan),
                                          sizeof(mellin_scan_use),
                                          sizeof(mellin_scan_outcome),
                                          sizeof(mellin_window),
                                          sizeof(mellin_cell_format),
                                          sizeof(mellin_submap),
                                          sizeof(mellin_edge_kind),
                                          sizeof(mellin_edge),
                                          sizeof(mellin_mapper_statistics),
                                          sizeof(mellin_slam_statistics),
                                          sizeof(mellin_collection_statistics),
                                          sizeof(mellin_statistics),
                                          sizeof(mellin_store_statistics),
                                          sizeof(mellin_port),
                                          offsetof(mellin_config, close_loops)};
  for (std::size_t i = 0; i < C_DRIVE_TYPES; ++i) {
    CAPTURE(i);
    CHECK(c[i] == cpp[i]);
  }
  CHECK(sizeof(mellin_status) == 4);
  CHECK(sizeof(mellin_scan_use) == 4);
}

TEST_CASE("names and versions") {
  for (int value = MELLIN_OK; value <= MELLIN_DEGENERATE; ++value) {
    const std::string name = mellin_status_string(static_cast<mellin_status>(value));
    CHECK(name == to_string(static_cast<Status>(value)));
    CHECK(name != "unknown");
  }
  // One past the last value of each: a new one in C++ has to be given to C.
  CHECK(std::string(to_string(static_cast<Status>(MELLIN_DEGENERATE + 1))) == "unknown");
  CHECK(std::string(mellin_status_string(static_cast<mellin_status>(MELLIN_DEGENERATE + 1))) == "unknown");
  CHECK(std::string(mellin_status_string(static_cast<mellin_status>(256))) == "unknown");
  for (int value = 0; value < MELLIN_PART_COUNT; ++value) {
    CHECK(std::string(mellin_part_string(static_cast<mellin_part>(value))) == to_string(static_cast<Part>(value)));
  }
  CHECK(std::string(mellin_part_string(MELLIN_PART_COUNT)) == "unknown");
  const std::string numbers = std::to_string(MELLIN_VERSION_MAJOR) + "." + std::to_string(MELLIN_VERSION_MINOR) + "." +
                              std::to_string(MELLIN_VERSION_PATCH);
  CHECK(numbers == MELLIN_VERSION_STRING);
  CHECK(numbers == mellin_version());
  CHECK(numbers == MELLIN_PROJECT_VERSION);  // of CMakeLists.txt
}

TEST_CASE("configurations that cannot be are refused") {
  mellin_config config = {};
  std::vector<std::uint64_t> memory(64);
  mellin_slam* slam = reinterpret_cast<mellin_slam*>(memory.data());
  const auto refused = [&] {
    mellin_memory_use use = {};
    CHECK(mellin_required_bytes(&config) == 0);
    CHECK(mellin_required_memory(&config, &use) == MELLIN_INVALID_CONFIG);
    CHECK(mellin_create(&config, memory.data(), memory.size() * 8, nullptr, &slam) == MELLIN_INVALID_CONFIG);
    CHECK(slam == nullptr);
  };
  refused();  // zeros
  REQUIRE(mellin_config_init(&config, MELLIN_PROFILE_NANO) == MELLIN_OK);
  refused();  // no laser
  config.lasers[2].beams = 90;
  CHECK(mellin_required_bytes(&config) > 0);
  config.profile = static_cast<mellin_profile>(3);
  refused();
  CHECK(mellin_config_init(&config, static_cast<mellin_profile>(3)) == MELLIN_INVALID_ARGUMENT);
  REQUIRE(mellin_config_init(&config, MELLIN_PROFILE_NANO) == MELLIN_OK);
  config.lasers[0].beams = 90;
  config.side = 161;
  refused();
}
