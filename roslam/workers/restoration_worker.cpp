// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/restoration_worker.hpp"

#include <exception>
#include <utility>

#include "roslam/common/stopwatch.hpp"
#include "roslam/common/thread_priority.hpp"
#include "roslam/options/settings.hpp"

namespace roslam {

RestorationWorker::RestorationWorker(const Camera& camera, const Options& options, Mode mode,
                                     std::shared_ptr<Inpainter> inpainter, PoseLookup keyframe_poses,
                                     OnRestored on_restored, OnLeft on_left, LoadControl* load)
    : options_(options.restoration),
      mode_(mode),
      most_sources_(sources_that_fit(options.restoration.recent_sources, camera)),
      restorer_(camera, restorer_settings(options), std::move(inpainter)),
      pose_lookup_(std::move(keyframe_poses)),
      on_restored_(std::move(on_restored)),
      on_left_(std::move(on_left)),
      load_(load),
      jobs_(options_.queue),
      worker_([this](KeyframeId keyframe, const auto&, StageTimes& times) { work(keyframe, times); }, mode, 1,
              KeyframeWorker::OnFailure::kSwitchOff) {}

void RestorationWorker::submit(KeyframeId keyframe, const Frame& frame,
                               const DynamicObjects& dynamic_objects) {
  for (const KeyframeId dropped : jobs_.put(keyframe, Job{frame, dynamic_objects})) leave(dropped);
  worker_.submit(keyframe);
}

void RestorationWorker::leave(KeyframeId keyframe) const {
  if (on_left_) on_left_(keyframe);
}

void RestorationWorker::work(KeyframeId keyframe, StageTimes& times) {
  if (mode_ == Mode::kRealTime) lower_thread_priority(ThreadPriority::kLowest);
  if (load_ != nullptr) load_->wait_while(LoadMeasure::kRestorationWaits);
  const auto job = jobs_.take(keyframe);
  if (!job) return;  // dropped
  try {
    const Stopwatch watch;
    restore(keyframe, *job);
    times.add("restoration", watch.seconds());
  } catch (const std::exception& error) {
    jobs_.note_fault(error);
    leave(keyframe);
  }
}

void RestorationWorker::restore(KeyframeId keyframe, const Job& job) {
  std::vector<KeyframeId> ids;
  for (const auto& [id, source] : sources_) ids.push_back(id);
  ids.push_back(keyframe);
  const std::vector<KeyframePose> poses = pose_lookup_(ids);
  const auto sources = move_sources(ids, poses);
  const KeyframePose& pose = poses.back();
  if (!pose.submap.is_valid()) return leave(keyframe);  // withdrawn
  const PosedImage view{job.frame.timestamp, pose.T_world_camera, job.frame.colour, job.frame.depth,
                        removed_area(job.dynamic_objects, job.frame.colour.size(), options_.margin)};
  const auto keep = [&] {
    if (auto source = restorer_.prepare_source(view)) sources_.insert_or_assign(keyframe, std::move(*source));
    while (sources_.size() > most_sources_) sources_.erase(sources_.begin());
  };
  try {
    on_restored_({keyframe, job.frame, pose.T_world_camera, pose.submap,
                  restorer_.restore(view, regions_of(job.dynamic_objects.objects), sources)});
  } catch (...) {
    keep();  // others can be filled from it all the same
    throw;
  }
  keep();
}

// Puts the sources where they are by now. Those in the world of the last place, which is that of the target.
std::vector<const SourceImage*> RestorationWorker::move_sources(const std::vector<KeyframeId>& ids,
                                                                const std::vector<KeyframePose>& poses) {
  std::vector<const SourceImage*> result;
  for (std::size_t i = 0; i + 1 < ids.size(); ++i) {
    if (poses[i].submap != poses.back().submap) continue;
    SourceImage& source = sources_.at(ids[i]);
    source.T_world_camera = poses[i].T_world_camera;
    result.push_back(&source);
  }
  return result;
}

}  // namespace roslam
