#include "host/summary.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host/file.hpp"

namespace mellin::host {
namespace {

using Json = nlohmann::ordered_json;

double finite(double value, const std::string& name) {
  if (!std::isfinite(value)) {
    throw std::invalid_argument("summary.json: expected a finite number as " + name + ", found " +
                                std::to_string(value));
  }
  return value;
}

Json config_json(const Summary& summary) {
  Json json = Json::object();
  for (const auto& [name, value] : summary.config) {
    if (const double* number = std::get_if<double>(&value)) {
      finite(*number, "config." + name);
    }
    std::visit([&json, &key = name](const auto& v) { json[key] = v; }, value);
  }
  return json;
}

Json sessions_json(const Summary& summary) {
  Json json = Json::array();
  for (const SessionSummary& s : summary.sessions) {
    json.push_back({{"log", s.log},
                    {"id", s.id},
                    {"scans", s.scans},
                    {"submaps", s.submaps},
                    {"component", s.component},
                    {"lost", s.lost}});
  }
  return json;
}

Json seconds_json(const StageSeconds& s) {
  return {{"total", finite(s.total, "seconds.total")},
          {"local_mapping", finite(s.local_mapping, "seconds.local_mapping")},
          {"screening", finite(s.screening, "seconds.screening")},
          {"registration", finite(s.registration, "seconds.registration")},
          {"optimisation", finite(s.optimisation, "seconds.optimisation")},
          {"store", finite(s.store, "seconds.store")}};
}

}  // namespace

std::string to_json(const Summary& s) {
  Json json;
  json["version"] = s.version;
  json["config"] = config_json(s);
  json["sessions"] = sessions_json(s);
  json["components"] = s.components;
  json["edges"] = {
      {"odometry", s.edges.odometry}, {"loop", s.edges.loop}, {"merge", s.edges.merge}, {"rejected", s.edges.rejected}};
  json["pairs"] = {{"possible", s.pairs.possible},
                   {"screened", s.pairs.screened},
                   {"dropped_coarse", s.pairs.dropped_coarse},
                   {"dropped_rotation", s.pairs.dropped_rotation},
                   {"cut_short", s.pairs.cut_short},
                   {"registered", s.pairs.registered},
                   {"accepted", s.pairs.accepted}};
  json["seconds"] = seconds_json(s.seconds);
  json["memory"] = {{"arena_bytes", s.memory.arena_bytes},
                    {"arena_used_bytes", s.memory.arena_used_bytes},
                    {"heap_allocations_after_init", s.memory.heap_allocations_after_init},
                    {"peak_rss_bytes", s.memory.peak_rss_bytes}};
  json["store"] = {{"submaps", s.store.submaps},
                   {"logical_bytes", s.store.logical_bytes},
                   {"programmed_bytes", s.store.programmed_bytes},
                   {"erases", s.store.erases},
                   {"max_block_erases", s.store.max_block_erases}};
  // Paths of logs are bytes, not always UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string submaps_csv(const std::vector<SubmapRow>& rows) {
  std::string csv = "id,session,component,scans,timestamp,x,y,theta\n";
  char text[256];
  for (const SubmapRow& r : rows) {
    (void)std::snprintf(text, sizeof(text), ",%llu,%llu,%.6f,%.6f,%.6f,%.9f\n",
                        static_cast<unsigned long long>(r.component), static_cast<unsigned long long>(r.scans),
                        r.timestamp_s, r.map_T_submap.x, r.map_T_submap.y, r.map_T_submap.theta);
    csv += std::to_string(r.id) + "," + csv_field(r.session) + text;
  }
  return csv;
}

std::string matches_csv(const std::vector<MatchRow>& rows) {
  std::string csv = "a,b,kind,stage,score,agreement,x,y,theta,accepted,why\n";
  char text[256];
  for (const MatchRow& r : rows) {
    (void)std::snprintf(text, sizeof(text), ",%.6g,%.6g,%.6f,%.6f,%.9f,%d,", r.score, r.agreement, r.a_T_b.x, r.a_T_b.y,
                        r.a_T_b.theta, r.accepted ? 1 : 0);
    csv += std::to_string(r.a) + "," + std::to_string(r.b) + "," + csv_field(r.kind) + "," + csv_field(r.stage) + text +
           csv_field(r.why) + "\n";
  }
  return csv;
}

std::string to_text(const SessionId& id) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (std::size_t i = 0; i < sizeof(id.bytes); ++i) {
    text += (i == 4 || i == 6 || i == 8 || i == 10) ? "-" : "";
    text += kDigits[id.bytes[i] >> 4U];
    text += kDigits[id.bytes[i] & 15U];
  }
  return text;
}

}  // namespace mellin::host
