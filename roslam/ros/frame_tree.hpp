// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>

#include "roslam/geometry/se3.hpp"

namespace roslam {

/// The name of a frame without a leading slash, which old recordings have.
inline std::string plain_frame(const std::string& name) {
  return name.starts_with('/') ? name.substr(1) : name;
}

/// Coordinate frames by name, each placed in its parent, as ROS tells of them (tf).
class FrameTree {
 public:
  /// Places a frame. One that is placed again elsewhere, unless it is fixed, moves, and is no mount: no
  /// transform leads over it. Names are taken without a leading slash. Of more than 10000 frames the rest is
  /// ignored.
  void add(const std::string& parent, const std::string& child, const SE3& T_parent_child,
           bool is_fixed = true);

  /// T_a_b, or nothing if the two frames are not connected, or by one that moves only. A frame to itself is
  /// the identity, known or not.
  std::optional<SE3> transform(const std::string& a, const std::string& b) const;

 private:
  struct Placed {
    std::string parent;
    SE3 T_parent_child;
    bool is_fixed = false, moves = false;
  };
  std::map<std::string, Placed> frames_;  // by the child
};

}  // namespace roslam
