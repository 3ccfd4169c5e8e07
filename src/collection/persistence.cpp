#include "mellin/collection/persistence.hpp"

#include <cstring>

namespace mellin {
namespace {

std::uint8_t* put_bytes(std::uint8_t* at, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) {
    *at++ = static_cast<std::uint8_t>(value >> (8 * i));
  }
  return at;
}

std::uint8_t* put_double(std::uint8_t* at, double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return put_bytes(at, bits, 8);
}

std::uint64_t get_bytes(const std::uint8_t* at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) {
    value |= std::uint64_t{at[i]} << (8 * i);
  }
  return value;
}

double get_double(const std::uint8_t* at) {
  const std::uint64_t bits = get_bytes(at, 8);
  double value = 0.0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

}  // namespace

std::size_t write_node_record(const NodeRecord& node, Span<std::uint8_t> out) {
  assert(out.size() >= kNodeRecordBytes);
  std::uint8_t* at = put_double(out.data(), node.map_T_submap.x);
  at = put_double(at, node.map_T_submap.y);
  at = put_double(at, node.map_T_submap.theta);
  (void)put_bytes(at, node.stretch, 2);
  return kNodeRecordBytes;
}

bool read_node_record(Span<const std::uint8_t> bytes, NodeRecord& node) {
  constexpr std::size_t kPoseBytes = 24;
  if (bytes.size() != kNodeRecordBytes && bytes.size() != kPoseBytes) {
    return false;
  }
  node.map_T_submap = {get_double(bytes.data()), get_double(bytes.data() + 8), get_double(bytes.data() + 16)};
  node.stretch = bytes.size() == kPoseBytes ? std::uint16_t{0}
                                            : static_cast<std::uint16_t>(get_bytes(bytes.data() + kPoseBytes, 2));
  return is_finite(node.map_T_submap);
}

std::size_t write_edge_record(const Edge& edge, Span<std::uint8_t> out) {
  assert(out.size() >= kEdgeRecordBytes);
  std::uint8_t* at = put_bytes(out.data(), edge.a, 4);
  at = put_bytes(at, edge.b, 4);
  at = put_bytes(at, static_cast<std::uint64_t>(edge.kind), 1);
  at = put_bytes(at, edge.enabled ? 1 : 0, 1);
  at = put_bytes(at, 0, 2);
  const Sym3& m = edge.information;
  for (const double value : {edge.a_T_b.x, edge.a_T_b.y, edge.a_T_b.theta, m.xx, m.xy, m.xt, m.yy, m.yt, m.tt}) {
    at = put_double(at, value);
  }
  return kEdgeRecordBytes;
}

bool read_edge_record(Span<const std::uint8_t> bytes, Edge& edge) {
  if (bytes.size() != kEdgeRecordBytes) {
    return false;
  }
  const std::uint8_t* at = bytes.data();
  edge = Edge{};
  edge.a = static_cast<NodeId>(get_bytes(at, 4));
  edge.b = static_cast<NodeId>(get_bytes(at + 4, 4));
  if (at[8] > static_cast<std::uint8_t>(EdgeKind::merge) || at[9] > 1) {
    return false;
  }
  edge.kind = static_cast<EdgeKind>(at[8]);
  edge.enabled = at[9] != 0;
  edge.a_T_b = {get_double(at + 12), get_double(at + 20), get_double(at + 28)};
  edge.information = {get_double(at + 36), get_double(at + 44), get_double(at + 52),
                      get_double(at + 60), get_double(at + 68), get_double(at + 76)};
  const Sym3& m = edge.information;
  bool finite = is_finite(edge.a_T_b);
  for (const double value : {m.xx, m.xy, m.xt, m.yy, m.yt, m.tt}) {
    finite = finite && is_finite(value);
  }
  return finite;
}

}  // namespace mellin
