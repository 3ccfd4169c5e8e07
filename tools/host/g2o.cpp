#include "host/g2o.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <deque>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace mellin::host {
namespace {

/// A text file, plain or gzipped, a line at a time.
class LineReader {
 public:
  explicit LineReader(const std::string& path) : path_(path), file_(gzopen(path.c_str(), "rb"), gzclose) {
    if (!file_) {
      throw std::runtime_error(path + ": cannot be opened");
    }
  }
  bool next(std::string& line) {
    line.clear();
    std::array<char, 512> piece{};
    while (gzgets(file_.get(), piece.data(), static_cast<int>(piece.size())) != nullptr) {
      line += piece.data();
      if (line.back() == '\n') {
        break;
      }
    }
    int error = Z_OK;
    const char* const text = gzerror(file_.get(), &error);
    if (error != Z_OK && error != Z_STREAM_END) {
      throw std::runtime_error(path_ + ":" + std::to_string(number_ + 1) + ": expected gzip data, found: " + text);
    }
    ++number_;
    const bool any = !line.empty();
    while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) {
      line.pop_back();
    }
    return any;
  }
  [[noreturn]] void fail(const std::string& expected, const std::string& found) const {
    throw std::runtime_error(path_ + ":" + std::to_string(number_) + ": expected " + expected + ", found: " + found);
  }

 private:
  std::string path_;
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file_;
  std::size_t number_ = 0;
};

struct RawEdge {
  std::int64_t a;
  std::int64_t b;
  Pose2 a_T_b;
  Sym3 information;
};

using Vertices = std::map<std::int64_t, std::optional<Pose2>>;

template <std::size_t N>
std::array<double, N> read_numbers(std::istringstream& fields, const LineReader& reader, const std::string& line,
                                   const std::string& what) {
  std::array<double, N> values{};
  for (double& value : values) {
    std::string word;
    std::size_t used = 0;
    try {
      if (fields >> word) {
        value = std::stod(word, &used);
      }
    } catch (const std::exception&) {
      used = 0;
    }
    if (used == 0 || used != word.size() || !std::isfinite(value)) {
      reader.fail(what, line);
    }
  }
  return values;
}

std::int64_t read_id(std::istringstream& fields, const LineReader& reader, const std::string& line,
                     const std::string& what) {
  std::int64_t id = 0;
  if (!(fields >> id)) {
    reader.fail(what, line);
  }
  return id;
}

void read_vertex(std::istringstream& fields, const LineReader& reader, const std::string& line, Vertices& vertices) {
  const std::string what = "a vertex's id and 3 finite numbers";
  const std::int64_t id = read_id(fields, reader, line, what);
  const std::array<double, 3> v = read_numbers<3>(fields, reader, line, what);
  std::optional<Pose2>& vertex = vertices[id];
  if (vertex) {
    reader.fail("each vertex once", line);
  }
  vertex = Pose2{v[0], v[1], v[2]};
}

RawEdge read_edge(std::istringstream& fields, const LineReader& reader, const std::string& line, bool toro) {
  const std::string what = "an edge's two different ids and 9 finite numbers";
  RawEdge edge{};
  edge.a = read_id(fields, reader, line, what);
  edge.b = read_id(fields, reader, line, what);
  const std::array<double, 9> v = read_numbers<9>(fields, reader, line, what);
  if (edge.a == edge.b) {
    reader.fail(what, line);
  }
  edge.a_T_b = {v[0], v[1], v[2]};
  // g2o: I11 I12 I13 I22 I23 I33; TORO: I11 I12 I22 I33 I13 I23.
  edge.information = toro ? Sym3{v[3], v[4], v[7], v[5], v[8], v[6]} : Sym3{v[3], v[4], v[5], v[6], v[7], v[8]};
  return edge;
}

/// Gives a pose to the vertices without one, walking along edges from those that have one.
void fill_in(G2oGraph& graph, std::vector<bool>& known) {
  const std::size_t n = graph.ids.size();
  std::vector<std::vector<std::size_t>> edges_at(n);
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    edges_at[graph.edges[i].a].push_back(i);
    edges_at[graph.edges[i].b].push_back(i);
  }
  std::deque<std::size_t> along_odometry;
  std::deque<std::size_t> along_others;
  const auto settle = [&](std::size_t v) {
    known[v] = true;
    for (const std::size_t i : edges_at[v]) {
      const bool consecutive = std::abs(graph.ids[graph.edges[i].a] - graph.ids[graph.edges[i].b]) == 1;
      (consecutive ? along_odometry : along_others).push_back(i);
    }
  };
  for (std::size_t v = 0; v < n; ++v) {
    if (known[v]) {
      settle(v);
    }
  }
  for (std::size_t start = 0; start < n; ++start) {
    while (!along_odometry.empty() || !along_others.empty()) {
      std::deque<std::size_t>& queue = along_odometry.empty() ? along_others : along_odometry;
      const G2oEdge& e = graph.edges[queue.front()];
      queue.pop_front();
      if (known[e.a] && !known[e.b]) {
        graph.poses[e.b] = compose(graph.poses[e.a], e.a_T_b);
        settle(e.b);
      } else if (known[e.b] && !known[e.a]) {
        graph.poses[e.a] = compose(graph.poses[e.b], inverse(e.a_T_b));
        settle(e.a);
      }
    }
    if (!known[start]) {
      settle(start);  // the first of a part without any pose: the origin
    }
  }
}

G2oGraph assemble(const Vertices& vertices, const std::vector<RawEdge>& edges) {
  G2oGraph graph;
  std::vector<bool> known;
  std::map<std::int64_t, std::size_t> index;
  for (const auto& [id, pose] : vertices) {
    index[id] = graph.ids.size();
    graph.ids.push_back(id);
    graph.poses.push_back(pose.value_or(Pose2{}));
    known.push_back(pose.has_value());
  }
  for (const RawEdge& e : edges) {
    graph.edges.push_back({index.at(e.a), index.at(e.b), e.a_T_b, e.information});
  }
  fill_in(graph, known);
  return graph;
}

}  // namespace

G2oGraph read_g2o(const std::string& path) {
  LineReader reader(path);
  Vertices vertices;
  std::vector<RawEdge> edges;
  std::string line;
  while (reader.next(line)) {
    std::istringstream fields(line);
    std::string tag;
    if (!(fields >> tag) || tag[0] == '#' || tag == "FIX" || tag.rfind("PARAMS", 0) == 0) {
      continue;
    }
    if (tag == "VERTEX_SE2" || tag == "VERTEX2" || tag == "VERTEX") {
      read_vertex(fields, reader, line, vertices);
    } else if (tag == "EDGE_SE2" || tag == "EDGE2" || tag == "EDGE") {
      edges.push_back(read_edge(fields, reader, line, tag != "EDGE_SE2"));
      vertices.try_emplace(edges.back().a);
      vertices.try_emplace(edges.back().b);
    } else {
      reader.fail("VERTEX_SE2, EDGE_SE2, VERTEX2 or EDGE2", line);
    }
  }
  if (vertices.empty()) {
    reader.fail("a vertex or an edge", "the end of the file");
  }
  return assemble(vertices, edges);
}

void write_g2o(const std::string& path, const G2oGraph& graph) {
  std::ofstream out(path);
  std::array<char, 320> text{};
  for (std::size_t i = 0; i < graph.ids.size(); ++i) {
    const Pose2& p = graph.poses[i];
    (void)std::snprintf(text.data(), text.size(), "VERTEX_SE2 %lld %.12g %.12g %.12g\n",
                        static_cast<long long>(graph.ids[i]), p.x, p.y, p.theta);
    out << text.data();
  }
  for (const G2oEdge& e : graph.edges) {
    const Sym3& m = e.information;
    (void)std::snprintf(text.data(), text.size(),
                        "EDGE_SE2 %lld %lld %.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g %.12g\n",
                        static_cast<long long>(graph.ids[e.a]), static_cast<long long>(graph.ids[e.b]), e.a_T_b.x,
                        e.a_T_b.y, e.a_T_b.theta, m.xx, m.xy, m.xt, m.yy, m.yt, m.tt);
    out << text.data();
  }
  out.flush();
  if (!out) {
    throw std::runtime_error(path + ": cannot be written");
  }
}

}  // namespace mellin::host
