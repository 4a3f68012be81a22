// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "roslam/common/stage_times.hpp"
#include "roslam/dynamic_objects/dynamic_object_detector.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/map/keyframe_pose.hpp"
#include "roslam/options/options.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/workers/keyframe_jobs.hpp"
#include "roslam/workers/keyframe_worker.hpp"
#include "roslam/workers/load_control.hpp"
#include "roslam/workers/restored_keyframe.hpp"

namespace roslam {

/// Restores keyframes as they come, from those before them, on a thread of its own: the tracker never waits,
/// of more keyframes than there is time for the oldest are dropped and counted, and what goes wrong costs a
/// restored keyframe and nothing else. In deterministic mode each is restored at once.
class RestorationWorker {
 public:
  /// Told of a keyframe that was dropped or could not be restored, on whatever thread that shows. It must not
  /// throw.
  using OnLeft = std::function<void(KeyframeId)>;

  /// inpainter: as StaticSceneRestorer. keyframe_poses: called on the worker's thread. load: null, or what
  /// may make it wait. Throws as StaticSceneRestorer does.
  RestorationWorker(const Camera& camera, const Options& options, Mode mode,
                    std::shared_ptr<Inpainter> inpainter, PoseLookup keyframe_poses, OnRestored on_restored,
                    OnLeft on_left = {}, LoadControl* load = nullptr);

  /// The images of the frame must not be changed afterwards.
  void submit(KeyframeId keyframe, const Frame& frame, const DynamicObjects& dynamic_objects);

  /// Waits until all that were not dropped are restored.
  void drain() { worker_.drain(); }

  /// Discards the keyframes that wait.
  void cancel() { worker_.cancel(); }

  std::size_t dropped() const { return jobs_.dropped(); }

  /// What went wrong so far, in words, and how often.
  std::map<std::string, std::size_t> faults() const {
    auto faults = jobs_.faults();
    for (const auto& [fault, count] : worker_.faults()) faults[fault] += count;
    return faults;
  }

  StageTimes times() const { return worker_.times(); }

 private:
  struct Job {
    Frame frame;
    DynamicObjects dynamic_objects;
  };

  void leave(KeyframeId keyframe) const;
  void work(KeyframeId keyframe, StageTimes& times);
  void restore(KeyframeId keyframe, const Job& job);
  std::vector<const SourceImage*> move_sources(const std::vector<KeyframeId>& ids,
                                               const std::vector<KeyframePose>& poses);

  RestorationOptions options_;
  Mode mode_;
  std::size_t most_sources_;
  StaticSceneRestorer restorer_;
  PoseLookup pose_lookup_;
  OnRestored on_restored_;
  OnLeft on_left_;
  LoadControl* load_;
  std::map<KeyframeId, SourceImage> sources_;  // by the worker's thread

  KeyframeJobs<Job> jobs_;

  KeyframeWorker worker_;  // last, so that its thread stops before what it uses goes away
};

}  // namespace roslam
