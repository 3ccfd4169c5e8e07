#include "host/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "host/file.hpp"
#include "host/html_page.hpp"
#include "host/png_image.hpp"

namespace mellin::host {
namespace {

/// 1234567 as 1 234 567.
Html count(std::uint64_t value) {
  std::string digits = std::to_string(value);
  for (std::size_t i = digits.size(); i > 3;) {
    i -= 3;
    digits.insert(i, "&#8239;");
  }
  return digits;
}

Html bytes(std::uint64_t value) {
  const auto v = static_cast<double>(value);
  if (value < 10'240) {
    return count(value) + " B";
  }
  return value < 10'485'760 ? number(v / 1024.0, 1) + " KiB" : number(v / 1048576.0, 1) + " MiB";
}

Html tile(const Html& value, std::string_view name) {
  return "<div class=\"tile\"><b>" + value + "</b><span>" + std::string(name) + "</span></div>\n";
}

struct Share {
  std::string name;
  double value = 0.0;
  Html text;
};

/// Rows with a bar in proportion to the largest.
Html share_table(std::string_view what, const std::vector<Share>& rows) {
  double largest = 0.0;
  for (const Share& row : rows) {
    largest = std::max(largest, row.value);
  }
  Html html = "<table><tr><th>" + std::string(what) + "</th><th class=\"n\"></th><th></th></tr>\n";
  for (const Share& row : rows) {
    const double percent = largest > 0.0 ? 100.0 * std::max(row.value, 0.0) / largest : 0.0;
    html += "<tr><td>" + escape_html(row.name) + "</td><td class=\"n\">" + row.text +
            "</td><td class=\"bar\"><i style=\"width:" + number(std::isfinite(percent) ? percent : 0.0, 1) +
            "%\"></i></td></tr>\n";
  }
  return html + "</table>\n";
}

Html figure_table(const std::vector<std::pair<std::string_view, Html>>& rows) {
  Html html = "<table>\n";
  for (const auto& [name, value] : rows) {
    html += "<tr><td>" + std::string(name) + "</td><td class=\"n\">" + value + "</td></tr>\n";
  }
  return html + "</table>\n";
}

Html tiles(const Summary& s) {
  std::uint64_t scans = 0;
  std::uint64_t submaps = 0;
  for (const SessionSummary& session : s.sessions) {
    scans += session.scans;
    submaps += session.submaps;
  }
  return "<div class=\"tiles\">\n" + tile(count(s.sessions.size()), "sessions") +
         tile(count(s.components), "components") + tile(count(scans), "scans") + tile(count(submaps), "submaps") +
         tile(count(s.edges.loop), "loop edges") + tile(count(s.edges.merge), "merge edges") +
         tile(number(s.seconds.total, 2) + " s", "computing time") +
         tile(bytes(s.memory.arena_used_bytes), "of memory used") + "</div>\n";
}

Html sessions(const Summary& s) {
  Html html =
      "<table><tr><th>log</th><th>session</th><th class=\"n\">scans</th><th class=\"n\">submaps</th>"
      "<th class=\"n\">component</th><th class=\"n\">lost</th></tr>\n";
  for (const SessionSummary& session : s.sessions) {
    html += "<tr><td>" + escape_html(session.log) + "</td><td><code>" + escape_html(session.id) +
            "</code></td><td class=\"n\">" + count(session.scans) + "</td><td class=\"n\">" + count(session.submaps) +
            "</td><td class=\"n\">" + count(session.component) + "</td><td class=\"n\">" + count(session.lost) +
            "</td></tr>\n";
  }
  return html + "</table>\n";
}

Html timings(const StageSeconds& s) {
  const double rest = s.total - s.local_mapping - s.screening - s.registration - s.optimisation - s.store;
  std::vector<Share> rows{
      {"local mapping", s.local_mapping, {}}, {"screening", s.screening, {}}, {"registration", s.registration, {}},
      {"optimisation", s.optimisation, {}},   {"store", s.store, {}},         {"the rest", std::max(rest, 0.0), {}}};
  for (Share& row : rows) {
    row.text = number(row.value, 3) + " s";
  }
  return share_table("stage", rows);
}

Html memory(const ReportData& data) {
  const MemoryFigures& m = data.summary.memory;
  Html html = figure_table({{"arena given", bytes(m.arena_bytes)},
                            {"arena used", bytes(m.arena_used_bytes)},
                            {"heap allocations after initialisation", count(m.heap_allocations_after_init)},
                            {"peak resident set of the program", bytes(m.peak_rss_bytes)}});
  std::vector<Share> rows;
  rows.reserve(data.memory_parts.size());
  for (const auto& [name, size] : data.memory_parts) {
    rows.push_back({name, static_cast<double>(size), bytes(size)});
  }
  return rows.empty() ? html : html + share_table("part of the arena", rows);
}

Html store(const StoreFigures& s) {
  std::vector<std::pair<std::string_view, Html>> rows{{"submaps", count(s.submaps)},
                                                      {"logical size", bytes(s.logical_bytes)},
                                                      {"programmed", bytes(s.programmed_bytes)},
                                                      {"block erases", count(s.erases)},
                                                      {"erases of the most erased block", count(s.max_block_erases)}};
  if (s.logical_bytes > 0) {
    rows.emplace_back("write amplification",
                      number(static_cast<double>(s.programmed_bytes) / static_cast<double>(s.logical_bytes), 2));
  }
  return figure_table(rows);
}

Html pairs(const Summary& s) {
  const std::vector<std::pair<std::string, std::uint64_t>> counts{{"possible", s.pairs.possible},
                                                                  {"screened", s.pairs.screened},
                                                                  {"registered", s.pairs.registered},
                                                                  {"accepted", s.pairs.accepted}};
  std::vector<Share> rows;
  rows.reserve(counts.size());
  for (const auto& [name, value] : counts) {
    rows.push_back({name, static_cast<double>(value), count(value)});
  }
  return share_table("pairs of submaps", rows) + figure_table({{"odometry edges", count(s.edges.odometry)},
                                                               {"loop edges", count(s.edges.loop)},
                                                               {"merge edges", count(s.edges.merge)},
                                                               {"rejected", count(s.edges.rejected)}});
}

/// From red (0) over yellow to green (1).
Html score_colour(double score) {
  const double hue = 130.0 * (std::isfinite(score) ? std::clamp(score, 0.0, 1.0) : 0.0);
  return "hsl(" + number(hue, 0) + ",75%,42%)";
}

/// The graph in a drawing of kWidth units; y points up in the map and down in SVG.
class GraphDrawing {
 public:
  explicit GraphDrawing(const ReportData& data) : data_(data) {
    for (const ReportNode& node : data.nodes) {
      if (is_finite(node.map_T_submap)) {
        bounds_.include(node.map_T_submap.x, node.map_T_submap.y);
      }
    }
  }

  Html html() const {
    if (bounds_.empty()) {
      return "";
    }
    constexpr double kMost_m = 1e7;  // a graph that diverged is not worth a drawing
    if (bounds_.max_x - bounds_.min_x > kMost_m || bounds_.max_y - bounds_.min_y > kMost_m) {
      return "";
    }
    Html svg = "<svg viewBox=\"0 0 " + number(kWidth, 0) + " " + number(height(), 0) +
               "\" role=\"img\" aria-label=\"pose graph\">\n";
    for (const EdgeKind kind : {EdgeKind::odometry, EdgeKind::loop, EdgeKind::merge}) {
      for (const ReportEdge& edge : data_.edges) {
        svg += edge.kind == kind ? line(edge) : "";
      }
    }
    for (const ReportNode& node : data_.nodes) {
      svg += circle(node);
    }
    return svg + "</svg>\n" + key();
  }

 private:
  static constexpr double kWidth = 1000.0;
  static constexpr double kMargin = 20.0;

  double scale() const {
    return (kWidth - 2.0 * kMargin) / std::max({bounds_.max_x - bounds_.min_x, bounds_.max_y - bounds_.min_y, 1.0});
  }
  double height() const { return (bounds_.max_y - bounds_.min_y) * scale() + 2.0 * kMargin; }
  Html x(const Pose2& p) const { return number(kMargin + (p.x - bounds_.min_x) * scale(), 1); }
  Html y(const Pose2& p) const { return number(kMargin + (bounds_.max_y - p.y) * scale(), 1); }

  Html line(const ReportEdge& edge) const {
    if (edge.a >= data_.nodes.size() || edge.b >= data_.nodes.size()) {
      return "";
    }
    const ReportNode& a = data_.nodes[edge.a];
    const ReportNode& b = data_.nodes[edge.b];
    if (!is_finite(a.map_T_submap) || !is_finite(b.map_T_submap)) {
      return "";
    }
    const bool odometry = edge.kind == EdgeKind::odometry;
    const Html style = odometry ? "stroke=\"var(--odometry)\" stroke-width=\"2\""
                                : "stroke=\"" + score_colour(edge.score) + "\" stroke-width=\"2.5\"" +
                                      (edge.kind == EdgeKind::merge ? " stroke-dasharray=\"7 4\"" : "");
    const Html title = std::string(odometry                      ? "odometry "
                                   : edge.kind == EdgeKind::loop ? "loop "
                                                                 : "merge ") +
                       std::to_string(a.id) + " to " + std::to_string(b.id) +
                       (odometry ? "" : ", score " + number(edge.score, 3));
    return "<line x1=\"" + x(a.map_T_submap) + "\" y1=\"" + y(a.map_T_submap) + "\" x2=\"" + x(b.map_T_submap) +
           "\" y2=\"" + y(b.map_T_submap) + "\" " + style + "><title>" + title + "</title></line>\n";
  }

  Html circle(const ReportNode& node) const {
    if (!is_finite(node.map_T_submap)) {
      return "";
    }
    constexpr std::uint64_t kGoldenAngle = 137;  // neighbouring sessions get distant hues
    const Html hue = std::to_string((210 + node.session * kGoldenAngle) % 360);
    return "<circle cx=\"" + x(node.map_T_submap) + "\" cy=\"" + y(node.map_T_submap) + "\" r=\"4\" fill=\"hsl(" + hue +
           ",70%,50%)\"><title>submap " + std::to_string(node.id) + ", session " + std::to_string(node.session) +
           ", component " + std::to_string(node.component) + "</title></circle>\n";
  }

  static Html key() {
    return "<p class=\"key\"><i style=\"background:var(--odometry)\"></i>odometry<i style=\"background:" +
           score_colour(0.0) + "\"></i>loop, score 0<i style=\"background:" + score_colour(0.5) +
           "\"></i>0.5<i style=\"background:" + score_colour(1.0) +
           "\"></i>1; merge edges are dashed; a node's colour is its session</p>\n";
  }

  const ReportData& data_;
  MapBounds bounds_;
};

Html pictures(const ReportData& data) {
  Html html;
  for (const auto& [caption, png] : data.pictures) {
    html += "<figure><img alt=\"" + escape_html(caption) + "\" src=\"data:image/png;base64," + encode_base64(png) +
            "\"><figcaption>" + escape_html(caption) + "</figcaption></figure>\n";
  }
  return html;
}

Html configuration(const Summary& s) {
  Html html;
  for (const auto& [name, value] : s.config) {
    Html text;
    if (const bool* yes = std::get_if<bool>(&value)) {
      text = *yes ? "yes" : "no";
    } else if (const std::int64_t* whole = std::get_if<std::int64_t>(&value)) {
      text = std::to_string(*whole);
    } else if (const double* real = std::get_if<double>(&value)) {
      char digits[64];
      (void)std::snprintf(digits, sizeof(digits), "%.9g", *real);
      text = digits;
    } else {
      text = escape_html(std::get<std::string>(value));
    }
    html += "<tr><td><code>" + escape_html(name) + "</code></td><td class=\"n\">" + text + "</td></tr>\n";
  }
  return html.empty() ? "" : "<table>\n" + html + "</table>\n";
}

Html remarks(const ReportData& data) {
  Html html;
  for (const std::string& remark : data.remarks) {
    html += "<li>" + escape_html(remark) + "</li>\n";
  }
  return html.empty() ? "" : "<ul>\n" + html + "</ul>\n";
}

}  // namespace

std::string report_html(const ReportData& data) {
  const Summary& s = data.summary;
  Html html = tiles(s);
  html += section("Map", pictures(data));
  html += section("Pose graph", GraphDrawing(data).html());
  html += section("Sessions", sessions(s));
  html += "<div class=\"pair\">\n" + section("Time by stage", timings(s.seconds)) +
          section("Pairs and edges", pairs(s)) + section("Memory", memory(data)) + section("Store", store(s.store)) +
          "</div>\n";
  html += section("Remarks", remarks(data));
  html += section("Configuration", configuration(s));
  return html_page(data.title, "Mellin " + s.version, html);
}

}  // namespace mellin::host
