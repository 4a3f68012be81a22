// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "roslam/map/ids.hpp"
#include "roslam/map/keyframe_place.hpp"
#include "roslam/pipeline/keyframe_jobs.hpp"
#include "roslam/pipeline/keyframe_worker.hpp"
#include "roslam/pipeline/options.hpp"
#include "roslam/pipeline/statistics.hpp"
#include "roslam/removal/dynamic_removal.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/sources/frame_source.hpp"

namespace roslam {

/// A keyframe without the things that move.
struct RestoredKeyframe {
  KeyframeId keyframe;
  Frame frame;         ///< as taken
  SE3 T_world_camera;  ///< as known when it was restored
  WorldId world;       ///< that the pose is in
  RestoredView view;
};

/// Restores keyframes as they come, from those before them, on a thread of its own: the tracker never waits,
/// of more keyframes than there is time for the oldest are dropped and counted, and what goes wrong costs a
/// restored keyframe and nothing else. In deterministic mode each is restored at once.
class RestorationWorker {
 public:
  /// Takes what was restored, on the worker's thread.
  using OnRestored = std::function<void(const RestoredKeyframe&)>;
  /// Told of a keyframe that was dropped or could not be restored, on whatever thread that shows. It must not
  /// throw.
  using OnLeft = std::function<void(KeyframeId)>;

  /// inpainter: as StaticSceneRestorer. places_of: called on the worker's thread. Throws as
  /// StaticSceneRestorer does.
  RestorationWorker(const Camera& camera, const Options& options, Mode mode,
                    std::shared_ptr<Inpainter> inpainter, PlacesOf places_of, OnRestored on_restored,
                    OnLeft on_left = {});

  /// The images of the frame must not be changed afterwards.
  void submit(KeyframeId keyframe, const Frame& frame, const Removal& removal);

  /// Waits until all that were not dropped are restored.
  void drain() { worker_.drain(); }

  std::size_t dropped() const { return jobs_.dropped(); }

  /// What went wrong so far, in words, and how often.
  std::map<std::string, std::size_t> faults() const { return jobs_.faults(); }

  StageTimes times() const { return worker_.times(); }

 private:
  struct Job {
    Frame frame;
    Removal removal;
  };

  void leave(KeyframeId keyframe) const;
  void work(KeyframeId keyframe, StageTimes& times);
  void restore(KeyframeId keyframe, const Job& job);
  std::vector<const SourceView*> move_sources(const std::vector<KeyframeId>& ids,
                                              const std::vector<KeyframePlace>& places);

  RestorationOptions options_;
  Mode mode_;
  std::size_t most_sources_;
  StaticSceneRestorer restorer_;
  PlacesOf places_of_;
  OnRestored on_restored_;
  OnLeft on_left_;
  std::map<KeyframeId, SourceView> sources_;  // by the worker's thread

  KeyframeJobs<Job> jobs_;

  KeyframeWorker worker_;  // last, so that its thread stops before what it uses goes away
};

}  // namespace roslam
