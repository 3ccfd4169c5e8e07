#include "mellin/c_interface.hpp"

#include <cassert>

namespace mellin {
namespace {

// The values of the C enums are those of the C++ ones; a value that is added to one of them has to be added here.
constexpr bool same(mellin_status c, Status cpp) { return c == static_cast<int>(cpp); }
static_assert(same(MELLIN_OK, Status::ok) && same(MELLIN_INVALID_ARGUMENT, Status::invalid_argument) &&
              same(MELLIN_INVALID_CONFIG, Status::invalid_config) &&
              same(MELLIN_INSUFFICIENT_MEMORY, Status::insufficient_memory) &&
              same(MELLIN_BAD_DATA, Status::bad_data) && same(MELLIN_NOT_FOUND, Status::not_found) &&
              same(MELLIN_FULL, Status::full) && same(MELLIN_BUSY, Status::busy) &&
              same(MELLIN_DEVICE_ERROR, Status::device_error) &&
              same(MELLIN_VERSION_MISMATCH, Status::version_mismatch) && same(MELLIN_LOST, Status::lost) &&
              same(MELLIN_DEGENERATE, Status::degenerate));

constexpr bool same(mellin_part c, Part cpp) { return c == static_cast<int>(cpp); }
static_assert(same(MELLIN_PART_GRID, Part::grid) && same(MELLIN_PART_SCANS, Part::scans) &&
              same(MELLIN_PART_MAPPER, Part::mapper) && same(MELLIN_PART_SUBMAPS, Part::submaps) &&
              same(MELLIN_PART_SPECTRAL, Part::spectral) && same(MELLIN_PART_DIGESTS, Part::digests) &&
              same(MELLIN_PART_STORE, Part::store) && same(MELLIN_PART_GRAPH, Part::graph) &&
              same(MELLIN_PART_COLLECTION, Part::collection) && same(MELLIN_PART_WORKSPACE, Part::workspace) &&
              same(MELLIN_PART_SLAM, Part::slam) && same(MELLIN_PART_COUNT, Part::count));

constexpr bool same(mellin_scan_use c, ScanUse cpp) { return c == static_cast<int>(cpp); }
static_assert(same(MELLIN_SCAN_TAKEN, ScanUse::taken) && same(MELLIN_SCAN_MATCHED, ScanUse::matched) &&
              same(MELLIN_SCAN_ODOMETRY, ScanUse::odometry) && same(MELLIN_SCAN_DOUBTED, ScanUse::doubted) &&
              same(MELLIN_SCAN_LOST, ScanUse::lost));

constexpr bool same(mellin_edge_kind c, EdgeKind cpp) { return c == static_cast<int>(cpp); }
static_assert(same(MELLIN_EDGE_ODOMETRY, EdgeKind::odometry) && same(MELLIN_EDGE_LOOP, EdgeKind::loop) &&
              same(MELLIN_EDGE_MERGE, EdgeKind::merge));

static_assert(MELLIN_ARENA_ALIGNMENT == kArenaAlignment && MELLIN_MAX_LASERS == kMaxLasers);
static_assert(MELLIN_NO_SUBMAP == kNoSubmap && MELLIN_UNOBSERVED == kUnobserved);

mellin_status c_status(Status status) { return static_cast<mellin_status>(status); }

mellin_sym3 c_sym3(const Sym3& m) { return {m.xx, m.xy, m.xt, m.yy, m.yt, m.tt}; }

/// Whether none of the pointers is null: a bug of the caller.
template <class... T>
bool given(const T*... pointers) {
  const bool all = (... && (pointers != nullptr));
  assert(all && "a null pointer given to the C interface");
  return all;
}

bool is_format(mellin_cell_format format) { return format == MELLIN_CELLS_SUBMAP || format == MELLIN_CELLS_ROS; }

/// The byte of a cell's counts. Counts have 16 bits, so that nothing here overflows.
std::uint8_t cell_byte(const CellCount& cell, mellin_cell_format format) {
  if (format == MELLIN_CELLS_SUBMAP) {
    return submap_cell(cell);
  }
  if (cell.observations == 0) {
    return MELLIN_UNOBSERVED;
  }
  return static_cast<std::uint8_t>((100U * 2U * cell.hits + cell.observations) / (2U * cell.observations));
}

mellin_memory_use c_memory_use(const ArenaUse& use) {
  mellin_memory_use out = {};
  for (std::size_t part = 0; part < kPartCount; ++part) {
    out.by_part[part] = use.by_part[part];
  }
  out.bulk = use.bulk;
  out.fast = use.fast;
  return out;
}

mellin_mapper_statistics c_statistics(const MapperStatistics& s) {
  return {s.scans, s.taken, s.unmatched, s.refused, s.resampled, s.recovered, s.doubted, s.lost};
}

mellin_slam_statistics c_statistics(const SlamStatistics& s) {
  return {s.submaps_due, s.submaps_delayed, s.submaps_lost, s.mapping_us, s.rendering_us};
}

mellin_collection_statistics c_statistics(const CollectionStatistics& s) {
  return {s.pairs_possible,  s.pairs_screened,  s.pairs_registered, s.pairs_accepted, s.edges_rejected,
          s.fetches_failed,  s.stored,          s.not_stored,       s.optimisations,  s.screening_us,
          s.registration_us, s.optimisation_us, s.store_us};
}

mellin_store_statistics c_statistics(const StoreStatistics& s) {
  return {s.submaps,          s.blobs,      s.logical_bytes, s.programmed_bytes, s.erases,
          s.max_block_erases, s.free_bytes, s.lost_records,  s.damaged_blocks};
}

Span<std::byte> bytes_at(void* memory, std::size_t size) { return {static_cast<std::byte*>(memory), size}; }

mellin_status create(const mellin_config& config, Span<std::byte> bulk, Span<std::byte> fast, const mellin_port* port,
                     mellin_slam*& slam) {
  slam = nullptr;
  const Result<Slam*> made = Slam::create(config_of(config), bulk, port != nullptr ? *port : mellin_port{}, fast);
  if (made.ok()) {
    slam = handle_of(*made.value());
  }
  return c_status(made.status());
}

}  // namespace
}  // namespace mellin

using namespace mellin;

const char* mellin_status_string(mellin_status status) {
  return status > MELLIN_DEGENERATE ? "unknown" : to_string(static_cast<Status>(status));
}

const char* mellin_part_string(mellin_part part) {
  return part >= MELLIN_PART_COUNT ? "unknown" : to_string(static_cast<Part>(part));
}

const char* mellin_version(void) { return MELLIN_VERSION_STRING; }

mellin_status mellin_config_init(mellin_config* config, mellin_profile profile) {
  if (!given(config) || !is_profile(profile)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  *config = c_config(profile);
  return MELLIN_OK;
}

std::size_t mellin_required_bytes(const mellin_config* config) {
  mellin_memory_use required = {};
  return mellin_required_memory(config, &required) == MELLIN_OK ? required.bulk + required.fast : 0;
}

mellin_status mellin_required_memory(const mellin_config* config, mellin_memory_use* required) {
  if (!given(config, required)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const Config settings = config_of(*config);
  const Status valid = validate(settings);
  if (valid == Status::ok) {
    *required = c_memory_use(required_memory(settings));
  }
  return c_status(valid);
}

mellin_status mellin_create(const mellin_config* config, void* memory, std::size_t bytes, const mellin_port* port,
                            mellin_slam** slam) {
  if (!given(config, memory, slam)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  return create(*config, bytes_at(memory, bytes), {}, port, *slam);
}

mellin_status mellin_create_split(const mellin_config* config, void* bulk, std::size_t bulk_bytes, void* fast,
                                  std::size_t fast_bytes, const mellin_port* port, mellin_slam** slam) {
  if (!given(config, bulk, fast, slam)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  return create(*config, bytes_at(bulk, bulk_bytes), bytes_at(fast, fast_bytes), port, *slam);
}

mellin_status mellin_add(mellin_slam* slam, const mellin_scan* scan, mellin_scan_outcome* outcome) {
  if (!given(slam, scan) || !given(scan->ranges_m)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const Span<const float> ranges_m(scan->ranges_m, scan->range_count);
  const Result<ScanOutcome> added =
      slam_of(*slam).add({scan->stamp_us, ranges_m, pose_of(scan->odom_T_base), scan->laser});
  if (added.ok() && outcome != nullptr) {
    const ScanOutcome& o = added.value();
    *outcome = {static_cast<mellin_scan_use>(o.use), o.taken, c_pose(o.session_T_base), o.anchor_scan,
                c_pose(o.anchor_T_base)};
  }
  return c_status(added.status());
}

mellin_status mellin_work(mellin_slam* slam, std::uint32_t budget) {
  if (!given(slam)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  return slam_of(*slam).work(budget) ? MELLIN_BUSY : MELLIN_OK;
}

mellin_status mellin_begin_flush(mellin_slam* slam) {
  return given(slam) ? c_status(slam_of(*slam).begin_flush()) : MELLIN_INVALID_ARGUMENT;
}

mellin_status mellin_new_session(mellin_slam* slam, const mellin_pose2* session_T_base) {
  if (!given(slam)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  return c_status(slam_of(*slam).new_session(session_T_base != nullptr ? pose_of(*session_T_base) : Pose2{}));
}

mellin_status mellin_pose(const mellin_slam* slam, mellin_pose2* session_T_base, mellin_sym3* covariance) {
  if (!given(slam, session_T_base)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  *session_T_base = c_pose(slam_of(*slam).pose());
  if (covariance != nullptr) {
    *covariance = c_sym3(slam_of(*slam).covariance());
  }
  return MELLIN_OK;
}

mellin_status mellin_map_pose(const mellin_slam* slam, mellin_pose2* map_T_base, std::uint32_t* component) {
  if (!given(slam, map_T_base)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const MapPose pose = slam_of(*slam).map_pose();
  *map_T_base = c_pose(pose.map_T_base);
  if (component != nullptr) {
    *component = pose.linked ? pose.component : MELLIN_NO_SUBMAP;
  }
  return MELLIN_OK;
}

mellin_status mellin_live_window(const mellin_slam* slam, mellin_window* window) {
  if (!given(slam, window)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const LocalMapper& mapper = slam_of(*slam).mapper();
  const CellRect rect = mapper.live_map().window();
  *window = {rect.column_min, rect.row_min, rect.column_end, rect.row_end, mapper.live_map().side(), mapper.cell_m()};
  return MELLIN_OK;
}

mellin_status mellin_live_cell(const mellin_slam* slam, std::int32_t column, std::int32_t row,
                               mellin_cell_format format, std::uint8_t* cell) {
  if (!given(slam, cell) || !is_format(format)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const CountingGrid& map = slam_of(*slam).live_map();
  if (!map.window().contains(column, row)) {
    return MELLIN_NOT_FOUND;
  }
  *cell = cell_byte(map.at(column, row), format);
  return MELLIN_OK;
}

mellin_status mellin_live_cell_at(const mellin_slam* slam, double x_m, double y_m, mellin_cell_format format,
                                  std::uint8_t* cell) {
  if (!given(slam, cell) || !is_finite(x_m) || !is_finite(y_m) || !is_format(format)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  if (!ParticleMapper::within_reach({x_m, y_m, 0.0})) {
    return MELLIN_NOT_FOUND;  // farther than cells are counted
  }
  const float cell_m = slam_of(*slam).mapper().cell_m();
  return mellin_live_cell(slam, cell_of(x_m, cell_m), cell_of(y_m, cell_m), format, cell);
}

mellin_status mellin_read_live_row(const mellin_slam* slam, std::int32_t row, mellin_cell_format format,
                                   std::uint8_t* cells, std::size_t count) {
  if (!given(slam, cells) || !is_format(format)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const CountingGrid& map = slam_of(*slam).live_map();
  const CellRect window = map.window();
  if (count != map.side()) {
    return MELLIN_INVALID_ARGUMENT;
  }
  if (!window.contains(window.column_min, row)) {
    return MELLIN_NOT_FOUND;
  }
  for (std::int32_t column = window.column_min; column < window.column_end; ++column) {
    cells[column - window.column_min] = cell_byte(map.at(column, row), format);
  }
  return MELLIN_OK;
}

std::uint32_t mellin_submap_count(const mellin_slam* slam) {
  return given(slam) ? slam_of(*slam).collection().size() : 0;
}

std::uint32_t mellin_edge_count(const mellin_slam* slam) {
  return given(slam) ? slam_of(*slam).collection().graph().edge_count() : 0;
}

mellin_status mellin_read_submap(const mellin_slam* slam, std::uint32_t id, mellin_submap* submap) {
  if (!given(slam, submap)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const MapCollection& map = slam_of(*slam).collection();
  if (id >= map.size()) {
    return MELLIN_NOT_FOUND;
  }
  const SubmapHeader& header = map.header(id);
  *submap = {id,
             map.component(id),
             map.session_of(id),
             header.stamp_us,
             header.first_scan,
             header.scan_count,
             c_pose(map.map_T_submap(id)),
             c_pose(header.session_T_submap)};
  return MELLIN_OK;
}

mellin_status mellin_read_edge(const mellin_slam* slam, std::uint32_t index, mellin_edge* edge) {
  if (!given(slam, edge)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const PoseGraph& graph = slam_of(*slam).collection().graph();
  if (index >= graph.edge_count()) {
    return MELLIN_NOT_FOUND;
  }
  const Edge& e = graph.edge(index);
  *edge = {e.a, e.b, static_cast<mellin_edge_kind>(e.kind), e.enabled, c_pose(e.a_T_b), c_sym3(e.information)};
  return MELLIN_OK;
}

mellin_status mellin_read_statistics(const mellin_slam* slam, mellin_statistics* statistics) {
  if (!given(slam, statistics)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  const Slam& s = slam_of(*slam);
  *statistics = {c_statistics(s.mapper().statistics()), c_statistics(s.statistics()),
                 c_statistics(s.collection().statistics())};
  return MELLIN_OK;
}

mellin_status mellin_read_store_statistics(const mellin_slam* slam, mellin_store_statistics* statistics) {
  if (!given(slam, statistics)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  *statistics = c_statistics(slam_of(*slam).store().statistics());
  return MELLIN_OK;
}

mellin_status mellin_read_memory_use(const mellin_slam* slam, mellin_memory_use* use) {
  if (!given(slam, use)) {
    return MELLIN_INVALID_ARGUMENT;
  }
  *use = c_memory_use(slam_of(*slam).arena_use());
  return MELLIN_OK;
}
