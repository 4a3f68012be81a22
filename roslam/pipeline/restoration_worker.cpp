// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/restoration_worker.hpp"

#include <exception>
#include <utility>

#include "roslam/geometry/stopwatch.hpp"
#include "roslam/pipeline/thread_priority.hpp"

namespace roslam {

RestorationWorker::RestorationWorker(const Camera& camera, const Options& options, Mode mode,
                                     std::shared_ptr<Inpainter> inpainter, PlacesOf places_of,
                                     OnRestored on_restored, OnLeft on_left)
    : options_(options.restoration),
      mode_(mode),
      most_sources_(sources_that_fit(options.restoration.recent_sources, camera)),
      restorer_(camera, options.restorer_settings(), std::move(inpainter)),
      places_of_(std::move(places_of)),
      on_restored_(std::move(on_restored)),
      on_left_(std::move(on_left)),
      jobs_(options_.queue),
      worker_([this](KeyframeId keyframe, const auto&, StageTimes& times) { work(keyframe, times); }, mode,
              1) {}

void RestorationWorker::submit(KeyframeId keyframe, const Frame& frame, const Removal& removal) {
  for (const KeyframeId dropped : jobs_.put(keyframe, Job{frame, removal})) leave(dropped);
  worker_.submit(keyframe);
}

void RestorationWorker::leave(KeyframeId keyframe) const {
  if (on_left_) on_left_(keyframe);
}

void RestorationWorker::work(KeyframeId keyframe, StageTimes& times) {
  if (mode_ == Mode::kRealTime) give_way_to_others();
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
  const std::vector<KeyframePlace> places = places_of_(ids);
  const auto sources = move_sources(ids, places);
  const KeyframePlace& placed = places.back();
  const View view{job.frame.timestamp, placed.T_world_camera, job.frame.colour, job.frame.depth,
                  removed_area(job.removal, job.frame.colour.size(), options_.margin)};
  const auto keep = [&] {
    if (auto source = restorer_.source_view(view)) sources_.insert_or_assign(keyframe, std::move(*source));
    while (sources_.size() > most_sources_) sources_.erase(sources_.begin());
  };
  try {
    on_restored_({keyframe, job.frame, placed.T_world_camera, placed.world,
                  restorer_.restore(view, regions_of(job.removal.objects), sources)});
  } catch (...) {
    keep();  // others can be filled from it all the same
    throw;
  }
  keep();
}

// Puts the sources where they are by now. Those in the world of the last place, which is that of the target.
std::vector<const SourceView*> RestorationWorker::move_sources(const std::vector<KeyframeId>& ids,
                                                               const std::vector<KeyframePlace>& places) {
  std::vector<const SourceView*> result;
  for (std::size_t i = 0; i + 1 < ids.size(); ++i) {
    if (places[i].world != places.back().world) continue;
    SourceView& source = sources_.at(ids[i]);
    source.T_world_camera = places[i].T_world_camera;
    result.push_back(&source);
  }
  return result;
}

}  // namespace roslam
