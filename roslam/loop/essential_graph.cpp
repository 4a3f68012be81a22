// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop/essential_graph.hpp"

#include <map>
#include <set>
#include <utility>

namespace roslam {

EssentialGraph EssentialGraph::of(const Map& map, int min_shared, const std::optional<LoopClosure>& closing) {
  EssentialGraph result;
  result.keyframes = map.keyframe_ids();
  std::vector<std::size_t> node_of(map.keyframe_slots());
  const std::set<KeyframeId> origins = map.origins();
  for (const KeyframeId id : result.keyframes) {
    node_of[id.index()] = result.graph.nodes.size();
    result.graph.nodes.push_back({map.find(id)->T_camera_world, 1.0, origins.count(id) > 0});
  }
  const auto add_edge = [&](KeyframeId from, KeyframeId to, const SE3& T_to_from, bool is_loop) {
    result.graph.edges.push_back({node_of[from.index()], node_of[to.index()], T_to_from, 1.0, 1.0, is_loop});
  };
  const auto T_as_is = [&](KeyframeId from, KeyframeId to) {
    return map.find(to)->T_camera_world * map.find(from)->T_camera_world.inverse();
  };
  std::map<WorldId, KeyframeId> newest;  // keyframe of each world so far
  for (const KeyframeId id : result.keyframes) {
    const KeyframeId before = std::exchange(newest[map.find(id)->world], id);
    bool has_parent = false;
    for (const auto& [neighbour, shared] : map.covisible(id)) {  // most first
      if (neighbour > id || (has_parent && shared < min_shared)) continue;
      add_edge(neighbour, id, T_as_is(neighbour, id), false);
      has_parent = true;
    }
    if (!has_parent && before.is_valid()) add_edge(before, id, T_as_is(before, id), false);
  }
  for (const auto& loop : map.loops()) add_edge(loop.from, loop.to, loop.T_to_from, true);
  if (closing) add_edge(closing->from, closing->to, closing->T_to_from, true);
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
