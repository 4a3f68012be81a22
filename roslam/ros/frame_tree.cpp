// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/ros/frame_tree.hpp"

namespace roslam {

namespace {
std::string plain(const std::string& name) { return name.starts_with('/') ? name.substr(1) : name; }
}  // namespace

void FrameTree::add(const std::string& parent, const std::string& child, const SE3& T_parent_child) {
  frames_.insert_or_assign(plain(child), Placed{plain(parent), T_parent_child});
}

// Both frames are followed up to every frame above them; the tree may be damaged and hold a circle.
std::optional<SE3> FrameTree::transform(const std::string& a, const std::string& b) const {
  std::map<std::string, SE3> above_a;  // T_above_a
  std::string at = plain(a);
  SE3 T_at_a;
  while (above_a.emplace(at, T_at_a).second) {
    const auto found = frames_.find(at);
    if (found == frames_.end()) break;
    T_at_a = found->second.T_parent_child * T_at_a;
    at = found->second.parent;
  }
  at = plain(b);
  SE3 T_at_b;
  for (std::size_t i = 0; i <= frames_.size(); ++i) {
    if (const auto common = above_a.find(at); common != above_a.end())
      return common->second.inverse() * T_at_b;
    const auto found = frames_.find(at);
    if (found == frames_.end()) break;
    T_at_b = found->second.T_parent_child * T_at_b;
    at = found->second.parent;
  }
  return std::nullopt;
}

}  // namespace roslam
