// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/dynamic_objects/flow_consistency.hpp"
#include "roslam/dynamic_objects/movable_object.hpp"
#include "roslam/dynamic_objects/optical_flow.hpp"

namespace roslam {

/// Propagates the masks of objects from one frame to another: by a similarity transform fitted to the optical
/// flow of the corners on each, or, if too few can be tracked, by the camera's motion at its depth. Objects
/// that leave the image are dropped.
std::vector<MovableObject> predicted_objects(const std::vector<MovableObject>& objects, const PastFrame& from,
                                             const PastFrame& to, const FlowConsistency& flow);

/// Tracks objects from frame to frame: assigns ids, and keeps objects that labels miss for a short time.
class ObjectTracker {
 public:
  explicit ObjectTracker(const DynamicObjectOptions& options) : options_(options) {}

  /// Propagates the tracked objects to the current frame.
  void carry(const PastFrame& last, const PastFrame& current, const FlowConsistency& flow);

  /// Associates labelled objects, already propagated to the current frame of that time (seconds), with the
  /// tracked ones: ids are kept, objects that labels miss are kept for a while, and confidence decays slowly.
  void update_labelled(std::vector<MovableObject> labelled, double timestamp);

  /// Associates unlabelled objects found in the current frame. Returns the id of each; 0 if it is part of a
  /// labelled object.
  std::vector<int> update_unlabelled(std::vector<MovableObject> found, double timestamp);

  std::vector<MovableObject>& objects() { return objects_; }
  const std::vector<MovableObject>& objects() const { return objects_; }
  void clear() { objects_.clear(); }

  /// How many times so far labels missed an object that earlier and later ones show.
  std::size_t flickers() const { return flickers_; }

 private:
  MovableObject* best_match(const MovableObject& object, const std::vector<bool>& taken);

  DynamicObjectOptions options_;
  std::vector<MovableObject> objects_;
  int last_id_ = 0;
  std::size_t flickers_ = 0;
};

}  // namespace roslam
