// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "roslam/removal/flow_check.hpp"
#include "roslam/removal/movable_object.hpp"
#include "roslam/removal/optical_flow.hpp"
#include "roslam/removal/removal_options.hpp"

namespace roslam {

/// Objects of one frame as they should appear in another: each follows the flow of the corners on it (shift,
/// turn and scale), or, where too few can be followed, the motion of the camera at its depth. What leaves the
/// picture is left out.
std::vector<MovableObject> carried(const std::vector<MovableObject>& objects, const PastFrame& from,
                                   const PastFrame& to, const FlowCheck& flow);

/// Remembers things from frame to frame: which is which, and those that the labels miss for a moment.
class ObjectMemory {
 public:
  explicit ObjectMemory(const RemovalOptions& options) : options_(options) {}

  /// Moves what is remembered to the current frame.
  void carry(const PastFrame& last, const PastFrame& current, const FlowCheck& flow);

  /// Joins new labels, already in the current frame of that time (seconds), with what is remembered: things
  /// keep their numbers, and what the labels miss is kept for a while. A thing once labelled surely is not
  /// doubted at the first label that is less sure.
  void join(std::vector<MovableObject> labelled, double timestamp);

  /// Joins what geometry alone found in the current frame. Gives the number of each; 0 where a labelled thing
  /// explains it.
  std::vector<int> join_unlabelled(std::vector<MovableObject> found, double timestamp);

  std::vector<MovableObject>& objects() { return objects_; }
  const std::vector<MovableObject>& objects() const { return objects_; }
  void clear() { objects_.clear(); }

  /// Labels so far that missed a thing which those before and after them have.
  std::size_t flickers() const { return flickers_; }

 private:
  MovableObject* best_match(const MovableObject& object, const std::vector<bool>& taken);

  RemovalOptions options_;
  std::vector<MovableObject> objects_;
  int last_id_ = 0;
  std::size_t flickers_ = 0;
};

}  // namespace roslam
