// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/frame_tree.hpp"

namespace roslam {

namespace {
constexpr std::size_t kMostFrames = 10000;
}  // namespace

void FrameTree::add(const std::string& parent, const std::string& child, const SE3& T_parent_child,
                    bool is_fixed) {
  constexpr double kSame = 1e-6;  // metres, radians
  if (frames_.size() >= kMostFrames) return;
  const auto [found, is_new] =
      frames_.try_emplace(plain_frame(child), Placed{plain_frame(parent), T_parent_child, is_fixed, false});
  Placed& placed = found->second;
  if (is_new || (placed.is_fixed && !is_fixed)) return;
  if (is_fixed) {
    placed = {plain_frame(parent), T_parent_child, true, false};
    return;
  }
  const SE3 moved = placed.T_parent_child.inverse() * T_parent_child;
  placed.moves |=
      placed.parent != plain_frame(parent) || moved.translation().norm() > kSame || moved.angle() > kSame;
}

// Both frames are followed up to every frame above them; the tree may be damaged and hold a circle.
std::optional<SE3> FrameTree::transform(const std::string& a, const std::string& b) const {
  std::map<std::string, SE3> above_a;  // T_above_a
  std::string at = plain_frame(a);
  SE3 T_at_a;
  while (above_a.emplace(at, T_at_a).second) {
    const auto found = frames_.find(at);
    if (found == frames_.end() || found->second.moves) break;
    T_at_a = found->second.T_parent_child * T_at_a;
    at = found->second.parent;
  }
  at = plain_frame(b);
  SE3 T_at_b;
  for (std::size_t i = 0; i <= frames_.size(); ++i) {
    if (const auto common = above_a.find(at); common != above_a.end())
      return common->second.inverse() * T_at_b;
    const auto found = frames_.find(at);
    if (found == frames_.end() || found->second.moves) break;
    T_at_b = found->second.T_parent_child * T_at_b;
    at = found->second.parent;
  }
  return std::nullopt;
}

}  // namespace roslam
