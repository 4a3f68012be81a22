// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "roslam/map/keyframe_pose.hpp"
#include "roslam/map/map.hpp"

namespace roslam {

/// The pose of a keyframe, also of one that was removed or withdrawn. The caller holds the map's mutex.
KeyframePose keyframe_pose(const Map& map, KeyframeId keyframe);

/// Poses of all keyframes as they were published last. Threads of lower priority read them here and not in
/// the map: a thread that is preempted while it holds the map's mutex would keep the tracker waiting
/// (priority inversion). The mutex here is held to copy a pointer only. May be used from any thread.
class KeyframePoseTable {
 public:
  /// Publishes all poses. The caller holds the map's mutex.
  void publish(const Map& map);

  /// Publishes a keyframe that was just added; the others stay as they are unless the map was corrected
  /// meanwhile. The caller holds the map's mutex.
  void add(const Map& map, KeyframeId keyframe);

  /// Poses of keyframes, removed ones included. Throws UsageError for one that was never published.
  std::vector<KeyframePose> find(const std::vector<KeyframeId>& keyframes) const;

 private:
  using Poses = std::vector<KeyframePose>;  // by keyframe id
  void replace(std::shared_ptr<const Poses> poses);
  std::shared_ptr<const Poses> current() const;

  std::size_t corrections_ = 0;  // of the map when all poses were published last; guarded by the map's mutex
  mutable std::mutex mutex_;
  std::shared_ptr<const Poses> poses_ = std::make_shared<const Poses>();
};

}  // namespace roslam
