// SPDX-License-Identifier: BSD-3-Clause
#include "recording/sequence_restorer.hpp"

#include "roslam/common/error.hpp"
#include "roslam/dynamic_objects/mask_refinement.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::recording {

namespace {
// Keyframes, and a frame whenever the interval has passed since the last source; every n-th if too many.
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
      source_times_(times_of_sources(run, options_)) {
  if (run.camera().is_stereo()) stereo_.emplace(run.camera(), StereoOptions());
}

bool SequenceRestorer::is_source(double timestamp) const {
  return source_times_.contains(time_text(timestamp));
}

// Nothing, with the reason, if the removed area of the frame is unknown.
std::optional<PosedImage> SequenceRestorer::posed_image(const Frame& frame, std::string& reason) const {
  const cv::Mat depth = stereo_ ? stereo_->with_depth(frame).depth : frame.depth;
  PosedImage image{frame.timestamp, run_.pose_at(frame.timestamp), frame.colour, depth, {}};
  const RecordedRemoval& removal = run_.removal();
  if (!removal.has_frames()) return image;
  const RecordedFrame* recorded = removal.find(frame.timestamp);
  if (recorded == nullptr) {
    reason = "not in the run";
    return std::nullopt;
  }
  if (!recorded->has_objects) return image;
  const cv::Mat objects = recorded->mask.empty() ? cv::Mat() : read_label_image(recorded->mask).image;
  if (objects.empty()) {
    reason = "mask missing or unusable";
    return std::nullopt;
  }
  if (objects.size() != frame.colour.size())
    throw InputError(recorded->mask.string() +
                     ": is not of the size of its frame; was the folder of the run's "
                     "source changed?");
  image.removed = dilated(objects != 0, options_.margin);
  return image;
}

void SequenceRestorer::keep(const Frame& frame) {
  std::string reason;
  const auto image = posed_image(frame, reason);
  if (!image) return;
  if (auto source = restorer_.prepare_source(*image))
    sources_.push_back(std::make_unique<const SourceImage>(std::move(*source)));
}

std::optional<RestoredImage> SequenceRestorer::restore(const Frame& frame) {
  std::string reason;
  const auto image = posed_image(frame, reason);
  if (!image) {
    ++left_out_[reason];
    return std::nullopt;
  }
  const RecordedFrame* recorded = run_.removal().find(frame.timestamp);
  std::vector<const SourceImage*> others;
  for (const auto& source : sources_)
    if (source->timestamp != frame.timestamp) others.push_back(source.get());
  return restorer_.restore(*image, recorded ? recorded->regions : std::vector<RemovedRegion>{}, others);
}

}  // namespace roslam::recording
