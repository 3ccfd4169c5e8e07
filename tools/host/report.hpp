// report.html: one page that needs nothing else, for people.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "host/map_picture.hpp"
#include "host/summary.hpp"

namespace mellin::host {

struct ReportNode {
  SubmapId id = kNoSubmap;
  std::uint64_t session = 0;  ///< index into Summary::sessions
  std::uint64_t component = 0;
  Pose2 map_T_submap;
};

struct ReportEdge {
  std::size_t a = 0;  ///< index into ReportData::nodes
  std::size_t b = 0;
  EdgeKind kind = EdgeKind::odometry;
  double score = 0.0;  ///< 0 to 1; colours loop and merge edges
};

struct ReportData {
  std::string title;
  Summary summary;
  std::vector<ReportNode> nodes;
  std::vector<ReportEdge> edges;
  std::vector<std::pair<std::string, std::uint64_t>> memory_parts;  ///< bytes of the arena by part
  std::vector<std::pair<std::string, std::string>> pictures;        ///< caption, PNG file; shown in this order
  std::vector<std::string> remarks;                                 ///< e.g. bad lines of a log
};

/// The page. Every text in the data is escaped; edges that name no node and nodes that are not finite are left out.
std::string report_html(const ReportData& data);

}  // namespace mellin::host
