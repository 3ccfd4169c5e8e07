#include "host/map_output.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "host/file.hpp"
#include "host/g2o.hpp"
#include "host/map_picture.hpp"
#include "host/png_image.hpp"
#include "host/report.hpp"
#include "host/settings.hpp"
#include "host/tum.hpp"
#include "mellin/mellin.h"

namespace mellin::host {
namespace {

constexpr const char* kVersion = MELLIN_VERSION_STRING;

std::uint64_t peak_rss_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024U;
}

/// Components, largest first; each with its submaps in order.
std::vector<std::vector<SubmapId>> components_of(const MapCollection& map) {
  std::map<SubmapId, std::vector<SubmapId>> by_name;
  for (SubmapId id = 0; id < map.size(); ++id) {
    by_name[map.component(id)].push_back(id);
  }
  std::vector<std::vector<SubmapId>> out;
  out.reserve(by_name.size());
  for (auto& [name, members] : by_name) {
    out.push_back(std::move(members));
  }
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return out;
}

EdgeKind picture_kind(mellin::EdgeKind kind) {
  switch (kind) {
    case mellin::EdgeKind::odometry:
      return EdgeKind::odometry;
    case mellin::EdgeKind::loop:
      return EdgeKind::loop;
    default:
      return EdgeKind::merge;
  }
}

Summary summarise(const MappingRun& run, const std::vector<std::vector<SubmapId>>& components,
                  const OutputFigures& figures) {
  const Slam& slam = run.slam();
  const MapCollection& map = slam.collection();
  Summary s;
  s.version = kVersion;
  s.config = list_settings(slam.config());
  s.components = components.size();
  std::map<SubmapId, std::uint64_t> component_number;
  for (std::size_t c = 0; c < components.size(); ++c) {
    component_number[map.component(components[c].front())] = c;
  }
  for (const MappedSession& session : run.sessions()) {
    SessionSummary out;
    out.log = session.log;
    out.id = to_text(map.session(session.session));
    out.scans = session.scans.size();
    out.submaps = session.submaps.size();
    out.component = session.submaps.empty() ? 0 : component_number[map.component(session.submaps.front())];
    out.lost = session.lost;
    s.sessions.push_back(out);
  }
  for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
    const Edge& edge = map.graph().edge(id);
    if (edge.enabled) {
      ++(edge.kind == mellin::EdgeKind::odometry ? s.edges.odometry
         : edge.kind == mellin::EdgeKind::loop   ? s.edges.loop
                                                 : s.edges.merge);
    }
  }
  const CollectionStatistics& c = map.statistics();
  s.edges.rejected = c.edges_rejected;
  s.pairs = {c.pairs_possible,  c.pairs_screened,   c.pairs_dropped_coarse, c.pairs_dropped_rotation,
             c.pairs_cut_short, c.pairs_registered, c.pairs_accepted};
  const auto seconds = [](std::uint64_t us) { return static_cast<double>(us) * 1e-6; };
  s.seconds.total = figures.total_seconds;
  s.seconds.local_mapping = seconds(slam.statistics().mapping_us + slam.statistics().rendering_us);
  s.seconds.screening = seconds(c.screening_us);
  s.seconds.registration = seconds(c.registration_us);
  s.seconds.optimisation = seconds(c.optimisation_us);
  s.seconds.store = seconds(c.store_us);
  s.memory.arena_bytes = required_bytes(slam.config());
  s.memory.arena_used_bytes = slam.arena_use().total();
  s.memory.heap_allocations_after_init = figures.heap_allocations;
  s.memory.peak_rss_bytes = peak_rss_bytes();
  const StoreStatistics store = slam.store().statistics();
  s.store = {store.submaps, store.logical_bytes, store.programmed_bytes, store.erases, store.max_block_erases};
  return s;
}

struct ComponentPictures {
  std::string map_png;
  std::string overlay_png;
};

/// Draws a component's map and writes it; returns it, and with the trajectories and edges over it.
ComponentPictures draw_component(MappingRun& run, const std::vector<SubmapId>& members, const std::string& directory,
                                 const std::string& stem) {
  const Slam& slam = run.slam();
  const MapCollection& map = slam.collection();
  const double side_m = static_cast<double>(slam.config().side) * static_cast<double>(slam.config().cell_m);
  MapBounds bounds;
  for (const SubmapId id : members) {
    bounds.include_submap(side_m, map.map_T_submap(id));
  }
  MapPictureOptions options;
  options.cell_m = static_cast<double>(slam.config().cell_m);
  MapPicture picture(bounds, options);
  for (const SubmapId id : members) {
    run.with_grid(id, [&](const GridView& grid) { picture.add(grid, map.map_T_submap(id)); });
  }
  const MapImage image = picture.finish();
  write_map(image, directory, stem);
  const SubmapId component = map.component(members.front());
  std::vector<std::vector<Pose2>> trajectories;
  for (const MappedSession& session : run.sessions()) {
    if (session.submaps.empty() || map.component(session.submaps.front()) != component) {
      continue;
    }
    trajectories.emplace_back();
    for (const StampedPose& pose : run.final_trajectory(session)) {
      trajectories.back().push_back(pose.pose);
    }
  }
  std::vector<MapEdge> edges;
  for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
    const Edge& edge = map.graph().edge(id);
    if (edge.enabled && map.component(edge.a) == component) {
      edges.push_back({map.map_T_submap(edge.a), map.map_T_submap(edge.b), picture_kind(edge.kind)});
    }
  }
  return {encode_png(image.grey), encode_png(draw_overlay(image, trajectories, edges))};
}

void write_tables(const MappingRun& run, const std::string& directory,
                  const std::map<SubmapId, std::uint64_t>& component_of) {
  const MapCollection& map = run.slam().collection();
  std::vector<SubmapRow> rows;
  G2oGraph graph;
  for (SubmapId id = 0; id < map.size(); ++id) {
    const SubmapHeader& header = map.header(id);
    rows.push_back({id, to_text(header.session), component_of.at(id), header.scan_count,
                    static_cast<double>(header.stamp_us) * 1e-6, map.map_T_submap(id)});
    graph.ids.push_back(id);
    graph.poses.push_back(map.map_T_submap(id));
  }
  for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
    const Edge& edge = map.graph().edge(id);
    if (edge.enabled) {
      graph.edges.push_back({edge.a, edge.b, edge.a_T_b, edge.information});
    }
  }
  write_file(directory + "/submaps.csv", submaps_csv(rows));
  write_file(directory + "/matches.csv", matches_csv(run.matches()));
  write_g2o(directory + "/graph.g2o", graph);
}

}  // namespace

Summary write_outputs(MappingRun& run, const std::string& directory, const OutputFigures& figures) {
  const MapCollection& map = run.slam().collection();
  const std::vector<std::vector<SubmapId>> components = components_of(map);
  std::map<SubmapId, std::uint64_t> component_of;
  for (std::size_t c = 0; c < components.size(); ++c) {
    for (const SubmapId id : components[c]) {
      component_of[id] = c;
    }
  }
  ReportData report;
  report.title = "Map of";
  for (std::size_t k = 0; k < run.sessions().size(); ++k) {
    const MappedSession& session = run.sessions()[k];
    report.title += " " + std::filesystem::path(session.log).filename().string();
    write_tum(directory + "/live-" + std::to_string(k) + ".tum", run.live_trajectory(session));
    write_tum(directory + "/trajectory-" + std::to_string(k) + ".tum", run.final_trajectory(session));
  }
  write_tables(run, directory, component_of);
  for (std::size_t c = 0; c < components.size(); ++c) {
    const std::string stem = c == 0 ? "map" : "map-" + std::to_string(c);
    const ComponentPictures pictures = draw_component(run, components[c], directory, stem);
    write_file(directory + "/" + stem + "-graph.png", pictures.overlay_png);
    report.pictures.emplace_back(c == 0 ? "The map" : "Component " + std::to_string(c), pictures.map_png);
    report.pictures.emplace_back("Trajectory (blue), odometry edges (grey), loops (green)", pictures.overlay_png);
  }
  report.summary = summarise(run, components, figures);
  report.remarks = figures.remarks;
  for (SubmapId id = 0; id < map.size(); ++id) {
    report.nodes.push_back({id, map.session_of(id), component_of[id], map.map_T_submap(id)});
  }
  std::map<std::pair<SubmapId, SubmapId>, double> scores;
  for (const MatchRow& row : run.matches()) {
    if (row.stage == "decided" && row.accepted) {
      scores[{row.a, row.b}] = row.agreement;
    }
  }
  for (EdgeId id = 0; id < map.graph().edge_count(); ++id) {
    const Edge& edge = map.graph().edge(id);
    if (edge.enabled) {
      const auto score = scores.find({edge.a, edge.b});
      report.edges.push_back({edge.a, edge.b, picture_kind(edge.kind), score == scores.end() ? 0.0 : score->second});
    }
  }
  for (std::size_t part = 0; part < kPartCount; ++part) {
    report.memory_parts.emplace_back(to_string(static_cast<Part>(part)), run.slam().arena_use().by_part[part]);
  }
  write_file(directory + "/summary.json", to_json(report.summary) + "\n");
  write_file(directory + "/report.html", report_html(report));
  return report.summary;
}

}  // namespace mellin::host
