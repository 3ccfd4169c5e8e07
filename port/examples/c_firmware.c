/* Firmware in C99: memory given once, then a scan, a slice of work, a pose, over and over. */
#include "example.h"
#include "ram_flash.h"
#include "simulated_robot.h"

/* What the configuration below needs is printed; where this is less, mellin_create() says what it lacks. */
static uint64_t memory[704 * 1024 / sizeof(uint64_t)];

static ram_flash flash;
static simulated_robot robot;
static mellin_slam* slam;
static const char* failure;

enum { ROUNDS = 3, SLICES_PER_SCAN = 60 };

/* Whether a condition holds; if not, it is why the example fails. */
static bool must(bool condition, const char* otherwise) {
  if (!condition && failure == NULL) {
    failure = otherwise;
  }
  return condition;
}

static bool succeeded(mellin_status status) { return must(status == MELLIN_OK, mellin_status_string(status)); }

/* Prints "label: value unit". */
static void print_number(const char* label, uint64_t value, const char* unit) {
  char line[80];
  char digits[20];
  size_t size = 0;
  size_t count = 0;
  for (; *label != '\0' && size < 40; ++label) {
    line[size++] = *label;
  }
  line[size++] = ':';
  line[size++] = ' ';
  do {
    digits[count++] = (char)('0' + value % 10);
    value /= 10;
  } while (value != 0);
  while (count > 0) {
    line[size++] = digits[--count];
  }
  for (; *unit != '\0' && size < sizeof line - 1; ++unit) {
    line[size++] = *unit;
  }
  line[size] = '\0';
  example_print(line);
}

static void print_log(void* context, mellin_log_level level, const char* line) {
  (void)context;
  (void)level;
  example_print(line);
}

/* The micro profile, made smaller for a small room, and a laser. */
static bool configure(mellin_config* config) {
  if (!succeeded(mellin_config_init(config, MELLIN_PROFILE_MICRO))) {
    return false;
  }
  config->lasers[0] = simulated_laser();
  config->side = 160;
  config->registration_side = 40;
  config->class_side = 80;
  config->max_submaps = 24;
  config->take_distance_m = 0.35F;
  print_number("memory required", mellin_required_bytes(config), " bytes");
  return true;
}

/* A flash and a log; neither clock nor entropy. */
static bool create(void) {
  mellin_config config;
  mellin_port port = {0};
  port.flash = ram_flash_create(&flash);
  port.log.write = print_log;
  return configure(&config) && succeeded(mellin_create(&config, memory, sizeof memory, &port, &slam));
}

/* The robot goes round; after each scan there is time for some background work. */
static bool map_the_room(void) {
  int i;
  simulated_start(&robot);
  for (i = 0; i < ROUNDS * SIMULATED_STEPS_PER_ROUND; ++i) {
    mellin_scan scan;
    mellin_scan_outcome outcome;
    mellin_status working;
    if (i > 0) {
      simulated_drive(&robot);
    }
    scan = simulated_scan(&robot);
    if (!succeeded(mellin_add(slam, &scan, &outcome))) {
      return false;
    }
    must(i == 0 || outcome.use != MELLIN_SCAN_ODOMETRY, "a scan did not match");
    working = mellin_work(slam, SLICES_PER_SCAN);
    if (working != MELLIN_BUSY && !succeeded(working)) {
      return false;
    }
  }
  return true;
}

/* Before the power goes. */
static bool finish(void) {
  if (!succeeded(mellin_begin_flush(slam))) {
    return false;
  }
  while (mellin_work(slam, 1) == MELLIN_BUSY) {
  }
  return true;
}

/* The live map, a character for 4 x 4 cells: the darkest of them. */
static bool print_live_map(void) {
  enum { CELLS_A_CHARACTER = 4, MOST = 160 };
  mellin_window window;
  int32_t row;
  if (!succeeded(mellin_live_window(slam, &window)) || !must(window.side <= MOST, "the window is too wide")) {
    return false;
  }
  for (row = window.row_end - CELLS_A_CHARACTER; row >= window.row_min; row -= CELLS_A_CHARACTER) {
    uint8_t cells[MOST];
    char line[MOST / CELLS_A_CHARACTER + 1] = {0};
    int32_t i;
    size_t j;
    for (i = 0; i < CELLS_A_CHARACTER; ++i) {
      if (!succeeded(mellin_read_live_row(slam, row + i, MELLIN_CELLS_ROS, cells, window.side))) {
        return false;
      }
      for (j = 0; j < window.side; ++j) {
        char* const character = &line[j / CELLS_A_CHARACTER];
        if (cells[j] != MELLIN_UNOBSERVED && cells[j] >= 50) {
          *character = '#';
        } else if (*character != '#' && cells[j] != MELLIN_UNOBSERVED) {
          *character = '.';
        } else if (*character == '\0') {
          *character = ' ';
        }
      }
    }
    example_print(line);
  }
  return true;
}

static uint32_t loops(void) {
  uint32_t count = 0;
  uint32_t i;
  for (i = 0; i < mellin_edge_count(slam); ++i) {
    mellin_edge edge;
    if (mellin_read_edge(slam, i, &edge) == MELLIN_OK && edge.enabled && edge.kind == MELLIN_EDGE_LOOP) {
      ++count;
    }
  }
  return count;
}

static bool report(void) {
  mellin_pose2 session_T_base;
  mellin_pose2 map_T_base;
  mellin_pose2 believed;
  mellin_statistics statistics;
  mellin_store_statistics store;
  uint32_t component;
  double live_m;
  double map_m;
  if (!succeeded(mellin_pose(slam, &session_T_base, NULL)) ||
      !succeeded(mellin_map_pose(slam, &map_T_base, &component)) ||
      !succeeded(mellin_read_statistics(slam, &statistics)) || !succeeded(mellin_read_store_statistics(slam, &store))) {
    return false;
  }
  believed.x = robot.odometry.x;
  believed.y = robot.odometry.y;
  believed.theta = robot.odometry.theta;
  live_m = simulated_error_m(&robot, &session_T_base);
  map_m = simulated_error_m(&robot, &map_T_base);
  print_number("scans", statistics.mapper.scans, "");
  print_number("scans in the map", statistics.mapper.taken, "");
  print_number("submaps", mellin_submap_count(slam), "");
  print_number("loops closed", loops(), "");
  print_number("flash in use", store.logical_bytes, " bytes");
  print_number("error of the odometry", (uint64_t)(simulated_error_m(&robot, &believed) * 1000.0), " mm");
  print_number("error of the live pose", (uint64_t)(live_m * 1000.0), " mm");
  print_number("error of the pose in the map", (uint64_t)(map_m * 1000.0), " mm");
  must(component == 0, "the session is not in the map");
  must(loops() > 0, "no loop was closed");
  must(statistics.slam.submaps_lost == 0, "submaps were lost");
  must(store.submaps == mellin_submap_count(slam), "a submap is not in the flash");
  must(live_m < 0.1, "the live pose is off by more than a cell");
  must(map_m < 0.1, "the pose in the map is off by more than a cell");
  return true;
}

int main(void) {
  if (create() && map_the_room() && finish() && print_live_map()) {
    (void)report();
  }
  if (failure != NULL) {
    char line[80] = "failed: ";
    size_t i;
    for (i = 0; failure[i] != '\0' && i < sizeof line - 9; ++i) {
      line[8 + i] = failure[i];
    }
    example_print(line);
    return 1;
  }
  example_print("passed");
  return 0;
}
