// SPDX-License-Identifier: BSD-3-Clause
// What is made of keyframes beside the map: restored pictures and the dense map.
#include <algorithm>

#include "roslam/pipeline/slam.hpp"

namespace roslam {

void Slam::restore_keyframes(std::shared_ptr<Inpainter> inpainter,
                             RestorationWorker::OnRestored on_restored) {
  restoration_.emplace(
      camera_, options_, mode_, std::move(inpainter),
      [this](const auto& keyframes) { return places_of(keyframes); },
      [this, on_restored = std::move(on_restored)](const RestoredKeyframe& restored) {
        if (dense_) dense_->restored(restored.keyframe, &restored.view);
        if (on_restored) on_restored(restored);
      },
      [this](KeyframeId keyframe) {
        if (dense_) dense_->restored(keyframe, nullptr);
      });
}

void Slam::map_densely() {
  dense_.emplace(camera_, options_, mode_, [this](const auto& keyframes) { return places_of(keyframes); });
}

std::vector<KeyframePlace> Slam::places_of(const std::vector<KeyframeId>& keyframes) {
  const std::scoped_lock lock(map_mutex_);
  std::vector<KeyframePlace> places;
  for (const KeyframeId id : keyframes)
    places.push_back({map_.world_of(id), map_.T_camera_world(id).inverse()});
  return places;
}

// To those who make pictures and dense maps of keyframes.
void Slam::hand_out(KeyframeId keyframe, const Frame& frame, const Removal& removal) {
  if (dense_) {
    DenseKeyframe input;
    input.frame = frame;
    input.removal = removal;
    input.is_restored = restoration_ && options_.dense.restore && options_.dense.remove;
    if (const auto T_labelled_camera = labelled_from(keyframe)) {
      input.labels = labels_;
      input.has_older_labels = labelled_index_ != frame.index;
      input.T_labelled_camera = *T_labelled_camera;
    }
    dense_->submit(keyframe, std::move(input));
  }
  if (restoration_) restoration_->submit(keyframe, frame, removal);
}

// Where a keyframe was, as seen from the frame that was labelled last. Nothing if that is not known or too
// long ago.
std::optional<SE3> Slam::labelled_from(KeyframeId keyframe) {
  const auto labelled = std::find_if(records_.rbegin(), records_.rend(),
                                     [&](const Record& record) { return record.index <= labelled_index_; });
  constexpr double kLastFor = 1.0;  // seconds
  const bool is_known = !labels_.empty() && labelled != records_.rend() &&
                        labelled->index == labelled_index_ && labelled->reference.is_valid() &&
                        records_.back().timestamp - labelled->timestamp <= kLastFor;
  if (!is_known) return std::nullopt;
  const std::scoped_lock lock(map_mutex_);
  if (map_.world_of(labelled->reference) != map_.world_of(keyframe)) return std::nullopt;
  return labelled->T_camera_reference * map_.T_camera_world(labelled->reference) *
         map_.T_camera_world(keyframe).inverse();
}

}  // namespace roslam
