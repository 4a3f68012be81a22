// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop_closing/essential_graph.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>

namespace roslam {

namespace {
// The edges from a node to older ones rest on the same landmarks, so together they count as one, and drift
// grows with the keyframes between. Otherwise the many edges would make the graph too stiff for any loop.
void set_weights(std::span<PoseGraph::Edge> edges) {
  constexpr std::size_t kMaxSpan = 20;  // keyframes; longer spans are constrained by a loop as well
  for (auto& edge : edges) {
    const std::size_t between = std::min(edge.to - edge.from, kMaxSpan);
    edge.weight = 1.0 / std::sqrt(static_cast<double>(edges.size() * between));
  }
}
}  // namespace

std::optional<EssentialGraph> EssentialGraph::of(const Map& map, MapMutex& map_mutex, int min_shared,
                                                 const LoopClosure& closing) {
  constexpr std::size_t kPerLock = 10;  // keyframes read under one lock
  constexpr std::size_t kNone = ~std::size_t{0};
  EssentialGraph result;
  std::vector<std::size_t> node_of;
  std::vector<SubmapId> submaps;
  std::vector<LoopClosure> loops;
  {
    const MapLock lock(map_mutex, "reading for the pose graph");
    if (map.find(closing.from) == nullptr || map.find(closing.to) == nullptr) return std::nullopt;
    result.keyframes = map.keyframe_ids();
    node_of.resize(map.keyframe_slots(), kNone);
    const std::set<KeyframeId> origins = map.origins();
    for (const KeyframeId id : result.keyframes) {
      node_of[id.index()] = result.graph.nodes.size();
      result.graph.nodes.push_back({map.find(id)->T_camera_world, 1.0, origins.count(id) > 0});
      submaps.push_back(map.find(id)->submap);
    }
    loops = map.loops();
    loops.push_back(closing);
  }
  std::vector<PoseGraph::Node>& nodes = result.graph.nodes;
  std::vector<PoseGraph::Edge>& edges = result.graph.edges;
  // Poses are those read with the nodes: the mapper may move keyframes meanwhile.
  const auto add_edge = [&](std::size_t from, std::size_t to) {
    edges.push_back({from, to, nodes[to].T_node_world * nodes[from].T_node_world.inverse(), 1.0, 1.0, false});
  };
  std::map<SubmapId, std::size_t> newest;  // node of each submap so far
  for (std::size_t begin = 0; begin < nodes.size(); begin += kPerLock) {
    const MapLock lock(map_mutex, "reading for the pose graph");
    for (std::size_t node = begin; node < std::min(begin + kPerLock, nodes.size()); ++node) {
      const std::size_t first_edge = edges.size();
      bool has_parent = false;
      for (const auto& [neighbour, shared] : map.covisible(result.keyframes[node])) {  // most first
        const std::size_t other = neighbour.index() < node_of.size() ? node_of[neighbour.index()] : kNone;
        if (other >= node || (has_parent && shared < min_shared)) continue;
        add_edge(other, node);
        has_parent = true;
      }
      const auto before = newest.find(submaps[node]);
      if (!has_parent && before != newest.end()) add_edge(before->second, node);
      newest[submaps[node]] = node;
      set_weights(std::span(edges).subspan(first_edge));
    }
  }
  for (const auto& [from, to, T_to_from] : loops)
    edges.push_back({node_of[from.index()], node_of[to.index()], T_to_from, 1.0, 1.0, true});
  return result;
}

MapCorrection EssentialGraph::correction(const PoseGraph& before) const {
  MapCorrection result;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    result.T_old_new[keyframes[i]] = before.nodes[i].T_node_world.inverse() * graph.nodes[i].T_node_world;
  }
  return result;
}

}  // namespace roslam
