/// The C interface: the facade of slam.hpp for firmware in C99. Scans in, the robot's pose and the building's map out,
/// in memory that the caller gives once.
///
///   mellin_config config;
///   mellin_slam* slam;
///   static uint64_t memory[2 * 1024 * 1024 / 8];
///   (void)mellin_config_init(&config, MELLIN_PROFILE_MICRO);
///   config.lasers[0].beams = 180;
///   if (mellin_create(&config, memory, sizeof memory, &port, &slam) != MELLIN_OK) { … }
///   for (;;) {
///     if (scan_has_come(&scan)) { (void)mellin_add(slam, &scan, &outcome); }
///     else { (void)mellin_work(slam, 1); }
///   }
///
/// Nothing here allocates, throws or waits. Calls on one mellin_slam must not overlap; different ones are independent.
/// Every function that takes pointers requires them, unless it says that NULL means something: a null pointer is a bug
/// of the caller, an assert in debug builds and MELLIN_INVALID_ARGUMENT in release builds. Where a function does not
/// return MELLIN_OK, what its pointers lead to is as it was, unless it says otherwise.
///
/// Each enum ends with a …_WIDTH, which is no value: it makes the type 32 bits wide and lets it hold any number, so
/// that a wrong one is refused and code compiled with other options for enums agrees with the library.
///
/// Angles are radians, distances metres, times microseconds. a_T_b takes coordinates in frame b to coordinates in frame
/// a. Frames follow REP-105: `session` is the smooth live frame of one mapping session, `map` the corrected one.
#ifndef MELLIN_MELLIN_H
#define MELLIN_MELLIN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "mellin/port.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Version of this header; mellin_version() is that of the library linked.
#define MELLIN_VERSION_MAJOR 0
#define MELLIN_VERSION_MINOR 1
#define MELLIN_VERSION_PATCH 0
#define MELLIN_VERSION_STRING "0.1.0"

/// What the memory given to mellin_create() has to be aligned to: an array of uint64_t is.
#define MELLIN_ARENA_ALIGNMENT 8

/// Scanners that a configuration can name.
#define MELLIN_MAX_LASERS 4

/// The id of no submap, and the component of a session that has none.
#define MELLIN_NO_SUBMAP 0xFFFFFFFFU

/// A cell that no beam has crossed, in both of mellin_cell_format: 255, which is -1 when read as int8_t.
#define MELLIN_UNOBSERVED 255U

/// The outcome of a call; the values of mellin::Status. Each function lists those that it returns.
typedef enum mellin_status {
  MELLIN_OK = 0,
  MELLIN_INVALID_ARGUMENT = 1,     ///< the caller passed something that the contract excludes
  MELLIN_INVALID_CONFIG = 2,       ///< a configuration that contradicts itself or a stated limit
  MELLIN_INSUFFICIENT_MEMORY = 3,  ///< the memory given is smaller than mellin_required_bytes()
  MELLIN_BAD_DATA = 4,             ///< sensor or flash content that cannot be what it claims to be
  MELLIN_NOT_FOUND = 5,            ///< no such submap, edge or cell
  MELLIN_FULL = 6,                 ///< a fixed capacity is used up
  MELLIN_BUSY = 7,                 ///< work is pending; the call can be repeated later
  MELLIN_DEVICE_ERROR = 8,         ///< the port's device reported an error
  MELLIN_VERSION_MISMATCH = 9,     ///< stored by a newer major version or under another configuration
  MELLIN_LOST = 10,                ///< the record existed, but its checksum fails
  MELLIN_DEGENERATE = 11,          ///< the mathematics has no (unique) answer for this input
  MELLIN_STATUS_WIDTH = 0x7FFFFFFF
} mellin_status;

/// A short English name of a status, for logs; "unknown" for any other number. Never NULL.
const char* mellin_status_string(mellin_status status);

/// Version of the library linked, as MELLIN_VERSION_STRING. A program that is linked against what it was compiled for
/// finds them equal.
const char* mellin_version(void);

/// A pose: x and y in metres, theta in radians.
typedef struct mellin_pose2 {
  double x;
  double y;
  double theta;
} mellin_pose2;

/// Symmetric 3 x 3 matrix over (x, y, theta): a covariance (m^2, m rad, rad^2) or an information matrix, its inverse.
typedef struct mellin_sym3 {
  double xx;
  double xy;
  double xt;
  double yy;
  double yt;
  double tt;
} mellin_sym3;

// ---- Configuration

/// Where a configuration starts from: profiles of config.hpp.
typedef enum mellin_profile {
  MELLIN_PROFILE_DESKTOP = 0,  ///< the paper's sizes: 768 x 768 cells of 5 cm
  MELLIN_PROFILE_MICRO = 1,    ///< a board with a few megabytes of RAM
  MELLIN_PROFILE_NANO = 2,     ///< a board with a few hundred kilobytes
  MELLIN_PROFILE_WIDTH = 0x7FFFFFFF
} mellin_profile;

/// A laser scanner: which beams it has, and where it sits on the base.
typedef struct mellin_laser {
  uint16_t beams;             ///< ranges a scan has, 1 to 4096; 0: there is no such laser
  float angle_min_rad;        ///< direction of the first beam in the laser's frame
  float angle_increment_rad;  ///< from beam to beam; a field of view of one turn at most
  float min_range_m;          ///< shorter ranges are no measurement
  float max_range_m;          ///< a range at or over it is a beam that hit nothing; at most 131 m
  mellin_pose2 base_T_laser;  ///< within 10 m of the base
} mellin_laser;

/// Odometry error of one step, as standard deviations: distance driven d [m], turn a [rad].
typedef struct mellin_motion_noise {
  float distance_base_m;   ///< along and across, always; at least 0.00001
  float distance_per_m;    ///< along and across, times d
  float distance_per_rad;  ///< along and across, times a
  float angle_base_rad;    ///< heading, always; at least 0.00001
  float angle_per_m;       ///< heading, times d
  float angle_per_rad;     ///< heading, times a
} mellin_motion_noise;

/// What is learnt of the odometry from the scans, and what is expected of it before.
typedef struct mellin_odometry_learning {
  bool learn_bias;            ///< corrects the odometry by what is known of its bias
  bool learn_noise;           ///< scales mellin_motion_noise by what is left of the odometry's error
  uint16_t memory_scans;      ///< taken scans over which what was seen fades to 1/e; at least 2
  float scale_sigma;          ///< deviation of the bias: share of the way, 0.00001 to 0.3
  float angle_per_m_sigma;    ///< rad of heading a metre driven, 0.00001 to 1
  float angle_per_rad_sigma;  ///< share of the turn, 0.00001 to 0.3
  float least_noise;          ///< the learnt noise is at least so many times the configured one, 0.01 to 1 …
  float most_noise;           ///< … and at most so many times, 1 to 100
} mellin_odometry_learning;

/// What firmware sets. mellin_config_init() fills in every field, so that each holds the value that counts: there is no
/// hidden default, and 0 means 0 (a struct of zeros is refused, for it has no laser). Fields may be added in later
/// versions; whoever starts from mellin_config_init() need not know of them.
///
/// Every setting that is not here has the profile's value. They tune the method rather than fit it to a robot and are
/// all open from C++: one C++ file of the firmware calls config_of() of c_interface.hpp, changes any field of
/// mellin::Config, creates the system and hands the C code its handle.
typedef struct mellin_config {
  mellin_profile profile;                  ///< what the settings that are not here come from
  mellin_laser lasers[MELLIN_MAX_LASERS];  ///< scans name them by index; the profile has none: set `beams` of one
  mellin_motion_noise noise;               ///< how good the odometry is
  mellin_odometry_learning odometry;       ///< what of it is learnt while mapping
  uint64_t seed;                           ///< of all random numbers

  // Sizes of the grids. A cell counts in 16 bits: remembered_scans times the beams of a laser is at most 65535.
  float cell_m;                ///< edge of a cell, 0.005 to 2
  uint16_t side;               ///< cells along the live window and along a submap; a multiple of 32, 64 to 2048
  uint16_t screening_side;     ///< pixels along a digest: side over a power of two, at least 16
  uint16_t registration_side;  ///< pixels along the pictures that are registered: side over a power of two, at least 16
  uint16_t class_side;         ///< cells along the grids on which a registration is verified: divides side, at least 16

  // Local mapping.
  uint16_t particles;           ///< 1 to 1000; each has a live grid of its own, of 5 side^2 bytes
  uint16_t remembered_scans;    ///< scans in the live map, and in a submap at most; at least 2
  uint16_t spare_scans;         ///< kept beyond those, so that a submap can be rendered while scans come in; at least 1
  float take_distance_m;        ///< a scan is taken into the map after so much straight-line distance …
  float take_angle_rad;         ///< … or so much turn since the last taken one
  uint16_t submap_every_scans;  ///< a submap is due after so many newly taken scans, at least 1 …
  float submap_every_path_m;    ///< … or after so much driven path; over 0
  float submap_max_path_m;      ///< path that the scans of one submap may span; over 0

  // The map collection.
  uint32_t max_submaps;         ///< 2 to 65535
  uint32_t max_edges;           ///< of the pose graph: max_submaps of odometry, the rest loops and merges
  uint32_t max_fill;            ///< blocks of the optimiser's factor, 76 bytes each; at least max_submaps
  uint16_t max_sessions;        ///< that have submaps in the store, and the present one; at least 1
  uint16_t grid_slots;          ///< full submaps in RAM, side^2 bytes each; at least 2
  uint16_t pending_hypotheses;  ///< that wait for more evidence; 1 to 64
  uint8_t candidates;           ///< of a new submap that are registered, best first
  bool cache_features;          ///< keeps digests' spectra in RAM: twice as fast, some 8 screening_side^2 bytes each
  bool close_loops;             ///< false: submaps are stored and linked by odometry only
} mellin_config;

/// Fills in a whole configuration: a profile's values and no laser, the other fields of which are set to a half circle
/// of one degree between beams and 30 m. Cost: none. MELLIN_INVALID_ARGUMENT: there is no such profile.
mellin_status mellin_config_init(mellin_config* config, mellin_profile profile);

/// Whose bytes they are; the values of mellin::Part.
typedef enum mellin_part {
  MELLIN_PART_GRID = 0,
  MELLIN_PART_SCANS = 1,
  MELLIN_PART_MAPPER = 2,
  MELLIN_PART_SUBMAPS = 3,
  MELLIN_PART_SPECTRAL = 4,
  MELLIN_PART_DIGESTS = 5,
  MELLIN_PART_STORE = 6,
  MELLIN_PART_GRAPH = 7,
  MELLIN_PART_COLLECTION = 8,
  MELLIN_PART_WORKSPACE = 9,
  MELLIN_PART_SLAM = 10,
  MELLIN_PART_COUNT = 11,
  MELLIN_PART_WIDTH = 0x7FFFFFFF
} mellin_part;

/// A short English name of a part; "unknown" for any other number. Never NULL.
const char* mellin_part_string(mellin_part part);

/// Bytes of memory.
typedef struct mellin_memory_use {
  size_t by_part[MELLIN_PART_COUNT];  ///< indexed by mellin_part; they sum to bulk + fast
  size_t bulk;                        ///< in the large memory
  size_t fast;                        ///< in the small one where there is one, else in the large one too
} mellin_memory_use;

/// Bytes that mellin_create() needs, exactly; 0 for a configuration that it would refuse. Cost: some hundred
/// operations.
///
/// It is computed at run time, from the configuration and the width of a pointer. For a constant, to size an array
/// with, c_interface.hpp shows the few lines of C++ that it takes. Or the array is sized by hand: where it is too
/// small, mellin_create() refuses it and says in the port's log how many bytes it lacks.
size_t mellin_required_bytes(const mellin_config* config);

/// The same by region and by part. MELLIN_INVALID_CONFIG: mellin_create() would refuse it.
mellin_status mellin_required_memory(const mellin_config* config, mellin_memory_use* required);

// ---- The system

/// The system; it lies in the memory that was given for it. There is nothing to destroy: forget it, and the memory is
/// free again.
typedef struct mellin_slam mellin_slam;

/// Builds the system in `memory`, `bytes` long, aligned to MELLIN_ARENA_ALIGNMENT, at least mellin_required_bytes()
/// long; it stays the caller's and must outlive the system. `port` is copied, what its contexts lead to is not; NULL:
/// no flash, no clock, no entropy, no log. What the port's flash holds is restored before this returns; a blank flash
/// is formatted. A first session begins. Sets `slam`, to NULL where it fails. Cost: bounded by the configuration and
/// the flash's size; the one call that may take seconds. Statuses: MELLIN_OK; MELLIN_INVALID_CONFIG (the port's log
/// says which field); MELLIN_INVALID_ARGUMENT where memory is not aligned; MELLIN_INSUFFICIENT_MEMORY (the log says how
/// many bytes lack); MELLIN_FULL where the flash holds submaps of max_sessions sessions already;
/// MELLIN_VERSION_MISMATCH, MELLIN_BAD_DATA, MELLIN_DEVICE_ERROR of the store: the flash is left as it was.
mellin_status mellin_create(const mellin_config* config, void* memory, size_t bytes, const mellin_port* port,
                            mellin_slam** slam);

/// The same in two regions, for controllers with a small fast memory (tightly coupled) and a large slow one: sizes are
/// those of mellin_required_memory(). Statuses of mellin_create().
mellin_status mellin_create_split(const mellin_config* config, void* bulk, size_t bulk_bytes, void* fast,
                                  size_t fast_bytes, const mellin_port* port, mellin_slam** slam);

/// One scan with the odometry of its moment.
typedef struct mellin_scan {
  int64_t stamp_us;
  const float* ranges_m;     ///< one a beam; NaN, infinite, negative or out of range: no measurement
  size_t range_count;        ///< as many as the laser has beams
  mellin_pose2 odom_T_base;  ///< dead reckoning, in any fixed frame
  uint8_t laser;             ///< index into mellin_config.lasers
} mellin_scan;

/// How a scan's pose came about; the values of mellin::ScanUse.
typedef enum mellin_scan_use {
  MELLIN_SCAN_TAKEN = 0,     ///< matched and added to the live map
  MELLIN_SCAN_MATCHED = 1,   ///< matched to the live map only
  MELLIN_SCAN_ODOMETRY = 2,  ///< matching failed: the pose rides on odometry from the last one
  MELLIN_SCAN_DOUBTED = 3,   ///< contradicts the live map: not added, since the robot may not be where it seems
  MELLIN_SCAN_LOST = 4,      ///< too many did: the live map begins afresh, in a component of its own
  MELLIN_SCAN_USE_WIDTH = 0x7FFFFFFF
} mellin_scan_use;

/// What became of a scan.
typedef struct mellin_scan_outcome {
  mellin_scan_use use;
  bool taken;                   ///< added to the live map, whether matched or not
  mellin_pose2 session_T_base;  ///< the live pose
  uint32_t anchor_scan;         ///< number of the newest taken scan …
  mellin_pose2 anchor_T_base;   ///< … and the pose relative to it, which later corrections leave as it is
} mellin_scan_outcome;

/// Takes the next scan; its ranges are read during the call only. `outcome` may be NULL. Cost: bounded by the
/// configuration; no background work. Statuses: MELLIN_OK; MELLIN_BAD_DATA: the scan is not what the configuration
/// says, or its odometry is not finite or out of reach (1000 km); it is ignored and counted.
mellin_status mellin_add(mellin_slam* slam, const mellin_scan* scan, mellin_scan_outcome* outcome);

/// Does up to `budget` slices of background work, at least one where there is any: rendering submaps, storing,
/// recognising places, closing loops, optimising. Cost: a slice is bounded by the configuration. Statuses: MELLIN_OK:
/// there is no more to do; MELLIN_BUSY: there is.
mellin_status mellin_work(mellin_slam* slam, uint32_t budget);

/// Before a shutdown or a new session: the scans that no submap holds yet become one, and poses and edges go to the
/// flash. The work itself is done by mellin_work(), until it returns MELLIN_OK. Statuses: MELLIN_OK.
mellin_status mellin_begin_flush(mellin_slam* slam);

/// A new mapping session (the robot was carried, or restarted): the live map starts empty, with the robot at the given
/// pose of a frame of its own; NULL: its origin. Flush first. Statuses: MELLIN_OK; MELLIN_INVALID_ARGUMENT: a pose that
/// is not finite, or farther than 1000 km from the origin; MELLIN_BUSY: work is pending; MELLIN_FULL: no room for
/// another session.
mellin_status mellin_new_session(mellin_slam* slam, const mellin_pose2* session_T_base);

/// The live pose: smooth, in the session's frame. `covariance` may be NULL; it is that of the pose against the live
/// map, in the robot's own frame. Statuses: MELLIN_OK.
mellin_status mellin_pose(const mellin_slam* slam, mellin_pose2* session_T_base, mellin_sym3* covariance);

/// The pose in the map; it jumps when a loop closes. `component` (may be NULL) names the part of the map by its
/// smallest submap: poses in different ones cannot be compared. MELLIN_NO_SUBMAP: the session is not linked to the map
/// yet: it has no submap since it began or since the robot was lost; the pose is in the session's frame. Statuses:
/// MELLIN_OK.
mellin_status mellin_map_pose(const mellin_slam* slam, mellin_pose2* map_T_base, uint32_t* component);

// ---- The live map: a square window of cells round the robot, in the session's frame. Cell (column, row) covers x from
// column * cell_m on, for cell_m metres, and y from row * cell_m on; both may be negative.

/// Cells of the window: columns from column_min to before column_end, rows likewise.
typedef struct mellin_window {
  int32_t column_min;
  int32_t row_min;
  int32_t column_end;
  int32_t row_end;
  uint16_t side;  ///< columns, and rows
  float cell_m;   ///< edge of a cell
} mellin_window;

/// What the byte of a cell says of the beams that crossed it or ended in it.
typedef enum mellin_cell_format {
  MELLIN_CELLS_SUBMAP = 0,  ///< round(254 hits / observations), as submaps are stored
  MELLIN_CELLS_ROS = 1,     ///< round(100 hits / observations), nav_msgs/OccupancyGrid; its -1 is MELLIN_UNOBSERVED
  MELLIN_CELLS_WIDTH = 0x7FFFFFFF
} mellin_cell_format;

/// Where the window is now; it moves with the robot in mellin_add() and mellin_new_session(). Statuses: MELLIN_OK.
mellin_status mellin_live_window(const mellin_slam* slam, mellin_window* window);

/// One cell. Statuses: MELLIN_OK; MELLIN_NOT_FOUND: outside the window; MELLIN_INVALID_ARGUMENT: no such format.
mellin_status mellin_live_cell(const mellin_slam* slam, int32_t column, int32_t row, mellin_cell_format format,
                               uint8_t* cell);

/// The cell that holds a point of the session's frame. Statuses: of mellin_live_cell(); MELLIN_INVALID_ARGUMENT also
/// where the point is not finite.
mellin_status mellin_live_cell_at(const mellin_slam* slam, double x_m, double y_m, mellin_cell_format format,
                                  uint8_t* cell);

/// Copies a row of the window, from column_min on, into `cells`. Rows from row_min on, one after the other, make a
/// nav_msgs/OccupancyGrid or a submap's grid. Cost: `side` divisions. Statuses: MELLIN_OK; MELLIN_NOT_FOUND: no such
/// row in the window; MELLIN_INVALID_ARGUMENT: no such format, or count is not the window's side.
mellin_status mellin_read_live_row(const mellin_slam* slam, int32_t row, mellin_cell_format format, uint8_t* cells,
                                   size_t count);

// ---- The map: submaps as the nodes of a pose graph

/// A submap of the map.
typedef struct mellin_submap {
  uint32_t id;
  uint32_t component;             ///< the part of the map that it belongs to, named by its smallest submap
  uint16_t session;               ///< sessions count from 0
  int64_t stamp_us;               ///< of the newest scan in it
  uint32_t first_scan;            ///< numbers, in the session, of the taken scans that it renders: first …
  uint32_t scan_count;            ///< … and how many in a row
  mellin_pose2 map_T_submap;      ///< in the frame of its component; the origin is the centre of its grid
  mellin_pose2 session_T_submap;  ///< as it was when the submap was frozen
} mellin_submap;

/// What an edge rests on; the values of mellin::EdgeKind.
typedef enum mellin_edge_kind {
  MELLIN_EDGE_ODOMETRY = 0,  ///< consecutive submaps of a session
  MELLIN_EDGE_LOOP = 1,      ///< a place was recognised, within one session
  MELLIN_EDGE_MERGE = 2,     ///< a place was recognised, of another session
  MELLIN_EDGE_KIND_WIDTH = 0x7FFFFFFF
} mellin_edge_kind;

/// A measured relative pose of two submaps.
typedef struct mellin_edge {
  uint32_t a;
  uint32_t b;
  mellin_edge_kind kind;
  bool enabled;  ///< false: it was found to be wrong and is out of the graph
  mellin_pose2 a_T_b;
  mellin_sym3 information;  ///< in the frame of b as measured, as g2o's EDGE_SE2 has it
} mellin_edge;

/// Submaps and edges; both are numbered from 0 without a gap. 0 for NULL (an assert in debug builds).
uint32_t mellin_submap_count(const mellin_slam* slam);
uint32_t mellin_edge_count(const mellin_slam* slam);

/// Statuses: MELLIN_OK; MELLIN_NOT_FOUND: there are not so many.
mellin_status mellin_read_submap(const mellin_slam* slam, uint32_t id, mellin_submap* submap);
mellin_status mellin_read_edge(const mellin_slam* slam, uint32_t index, mellin_edge* edge);

// ---- Diagnostics. The counters of mellin_statistics run from mellin_create() on, over all sessions: none is ever set
// back.

/// Of local mapping, mellin::MapperStatistics.
typedef struct mellin_mapper_statistics {
  uint32_t scans;  ///< given, refused ones included
  uint32_t taken;
  uint32_t unmatched;  ///< rode on odometry
  uint32_t refused;    ///< MELLIN_BAD_DATA
  uint32_t resampled;
  uint32_t recovered;  ///< matched by the wider search only
  uint32_t doubted;    ///< due to be taken, and not added
  uint32_t lost;       ///< times that the live map began afresh
} mellin_mapper_statistics;

/// Of rendering, mellin::SlamStatistics. Times are by the port's clock, 0 where it has none.
typedef struct mellin_slam_statistics {
  uint32_t submaps_due;
  uint32_t submaps_delayed;  ///< due while the one before was not finished: started later, with newer scans
  uint32_t submaps_lost;     ///< not kept: no room in the collection, their scans were overwritten, or the robot was
                             ///< lost again after a few scans
  uint64_t mapping_us;       ///< in mellin_add()
  uint64_t rendering_us;
} mellin_slam_statistics;

/// Of the map collection, mellin::CollectionStatistics.
typedef struct mellin_collection_statistics {
  uint64_t pairs_possible;  ///< pairs of submaps that share no scans
  uint64_t pairs_screened;
  uint64_t pairs_registered;
  uint64_t pairs_accepted;  ///< became edges
  uint32_t edges_rejected;  ///< were edges, and then outliers
  uint32_t fetches_failed;
  uint32_t stored;      ///< submaps that are safe in the store
  uint32_t not_stored;  ///< submaps that the store refused
  uint32_t optimisations;
  uint64_t screening_us;
  uint64_t registration_us;
  uint64_t optimisation_us;
  uint64_t store_us;
} mellin_collection_statistics;

typedef struct mellin_statistics {
  mellin_mapper_statistics mapper;
  mellin_slam_statistics slam;
  mellin_collection_statistics collection;
} mellin_statistics;

/// Of the flash, mellin::StoreStatistics: what it holds and what it has been through. Zeros without flash.
typedef struct mellin_store_statistics {
  uint32_t submaps;
  uint32_t blobs;             ///< digests, poses, edges
  uint64_t logical_bytes;     ///< of the live submaps' and blobs' records
  uint64_t programmed_bytes;  ///< since mellin_create(), fill of program units included
  uint64_t erases;            ///< over the device's life
  uint32_t max_block_erases;  ///< the same, of the most erased block
  uint64_t free_bytes;        ///< in blocks that can still be opened
  uint32_t lost_records;      ///< found missing or damaged since mellin_create()
  uint32_t damaged_blocks;
} mellin_store_statistics;

/// Statuses of all three: MELLIN_OK. Cost: mellin_read_store_statistics() looks at each record's entry in RAM, the
/// others copy.
mellin_status mellin_read_statistics(const mellin_slam* slam, mellin_statistics* statistics);
mellin_status mellin_read_store_statistics(const mellin_slam* slam, mellin_store_statistics* statistics);
/// What the system was built with: equal to mellin_required_memory() of its configuration.
mellin_status mellin_read_memory_use(const mellin_slam* slam, mellin_memory_use* use);

#ifdef __cplusplus
}
#endif

#endif
