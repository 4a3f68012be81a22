// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/sequence_restorer.hpp"

#include "roslam/error.hpp"
#include "roslam/removal/mask_refinement.hpp"
#include "roslam/sources/image_file.hpp"

namespace roslam {

namespace {
// Keyframes, and between them what leaves no longer gap than the interval; thinned if they are too many.
std::set<std::string> times_of_sources(const RecordedRun& run, const RestorationOptions& options) {
  std::set<std::string> keyframes;
  for (const StampedPose& pose : run.keyframes()) keyframes.insert(time_text(pose.timestamp));
  std::vector<double> times;
  for (const StampedPose& pose : run.trajectory()) {
    const bool is_due = times.empty() || pose.timestamp - times.back() >= options.source_interval;
    if (is_due || keyframes.contains(time_text(pose.timestamp))) times.push_back(pose.timestamp);
  }
  const std::size_t limit = sources_that_fit(options.max_sources, run.camera());
  const std::size_t stride = (times.size() + limit - 1) / limit;
  std::set<std::string> result;
  for (std::size_t i = 0; i < times.size(); i += stride) result.insert(time_text(times[i]));
  return result;
}
}  // namespace

SequenceRestorer::SequenceRestorer(const RecordedRun& run, StaticSceneRestorer& restorer)
    : run_(run),
      restorer_(restorer),
      options_(restorer.settings().restoration),
      source_times_(times_of_sources(run, options_)) {}

bool SequenceRestorer::is_source(double timestamp) const {
  return source_times_.contains(time_text(timestamp));
}

// Nothing, and why, if it is not known what was removed from the frame.
std::optional<View> SequenceRestorer::view_of(const Frame& frame, std::string& reason) const {
  View view{frame.timestamp, run_.pose_at(frame.timestamp), frame.colour, frame.depth, {}};
  const RecordedRemoval& removal = run_.removal();
  if (!removal.has_frames()) return view;
  const RecordedFrame* recorded = removal.find(frame.timestamp);
  if (recorded == nullptr) {
    reason = "not in the run";
    return std::nullopt;
  }
  if (!recorded->has_objects) return view;
  const cv::Mat objects = recorded->mask.empty() ? cv::Mat() : read_label_image(recorded->mask).image;
  if (objects.empty()) {
    reason = "mask missing or unusable";
    return std::nullopt;
  }
  if (objects.size() != frame.colour.size())
    throw InputError(recorded->mask.string() +
                     ": is not of the size of the frame of that time; was the folder of the run's "
                     "source changed?");
  view.removed = dilated(objects != 0, options_.margin);
  return view;
}

void SequenceRestorer::keep(const Frame& frame) {
  std::string reason;
  const auto view = view_of(frame, reason);
  if (!view) return;
  if (auto source = restorer_.source_view(*view))
    sources_.push_back(std::make_unique<const SourceView>(std::move(*source)));
}

std::optional<RestoredView> SequenceRestorer::restore(const Frame& frame) {
  std::string reason;
  const auto view = view_of(frame, reason);
  if (!view) {
    ++left_out_[reason];
    return std::nullopt;
  }
  const RecordedFrame* recorded = run_.removal().find(frame.timestamp);
  std::vector<const SourceView*> others;
  for (const auto& source : sources_)
    if (source->timestamp != frame.timestamp) others.push_back(source.get());
  return restorer_.restore(*view, recorded ? recorded->regions : std::vector<RemovedRegion>{}, others);
}

}  // namespace roslam
