// The map collection's records in the store: nodes and edges, little-endian by definition. The submaps' headers and
// grids are the store's own; digests are kept as the digest matcher gives them.
#pragma once

#include <cstdint>

#include "mellin/core/span.hpp"
#include "mellin/graph/pose_graph.hpp"
#include "mellin/grid/submap.hpp"

namespace mellin {

/// Kinds of blobs in the store.
inline constexpr std::uint8_t kDigestRecord = 1;  ///< id: submap
inline constexpr std::uint8_t kNodeRecord = 2;    ///< id: submap
/// An odometry edge has the id of its newer submap, of which it is the only one; loop and merge edges are counted from
/// kFirstLoopRecord on. The graph's own numbers would not do: loop edges lie between the odometry edges and are stored
/// later, so that after a power cut the graph counts otherwise than the records.
inline constexpr std::uint8_t kEdgeRecord = 3;
inline constexpr std::uint32_t kFirstLoopRecord = 0x80000000U;

struct NodeRecord {
  Pose2 map_T_submap;
  std::uint16_t stretch = 0;  ///< of its session
};
/// 26 bytes: x, y, theta as IEEE 754 doubles, then the stretch. Records without it, of 24 bytes, are of stretch 0.
inline constexpr std::size_t kNodeRecordBytes = 26;
std::size_t write_node_record(const NodeRecord& node, Span<std::uint8_t> out);
/// False where the record has no finite pose.
bool read_node_record(Span<const std::uint8_t> bytes, NodeRecord& node);

/// 84 bytes: a, b (32 bits each), kind, enabled (8 bits each), two zero bytes, x, y, theta, then the information
/// xx, xy, xt, yy, yt, tt as doubles.
inline constexpr std::size_t kEdgeRecordBytes = 84;
std::size_t write_edge_record(const Edge& edge, Span<std::uint8_t> out);
/// False where the record is not an edge; whether its nodes exist is for the graph to say.
bool read_edge_record(Span<const std::uint8_t> bytes, Edge& edge);

}  // namespace mellin
