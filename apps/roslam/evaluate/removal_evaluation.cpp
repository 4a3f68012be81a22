// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/evaluate/removal_evaluation.hpp"

#include <opencv2/imgproc.hpp>
#include <string>

#include "apps/roslam/evaluate/removal_truth.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "recording/recorded_removal.hpp"
#include "roslam/common/error.hpp"
#include "roslam/sensors/frame_images.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::app {

using namespace evaluation;
using namespace recording;

namespace {
namespace fs = std::filesystem;

constexpr const char* kOtherSource = "; give the SOURCE, --camera, --traffic and --seed it was made from";

// Nothing if the mask was dropped or cannot be read.
std::optional<RemovedThings> removal_of(const RecordedFrame& frame, const cv::Size& image) {
  RemovedThings removed;
  removed.points = frame.points;
  if (frame.mask.empty()) return frame.has_objects ? std::nullopt : std::make_optional(removed);
  removed.mask = read_label_image(frame.mask).image;
  if (removed.mask.empty()) return std::nullopt;
  if (removed.mask.size() != image) {
    throw InputError(frame.mask.string() + ": is " + size_in_words(removed.mask.size()) +
                     " but the image of that time " + size_in_words(image) + " pixels" + kOtherSource);
  }
  for (const std::size_t value : frame.resting) {
    if (removed.resting.empty()) removed.resting = cv::Mat::zeros(image, CV_8UC1);
    removed.resting.setTo(255, removed.mask == static_cast<double>(value));
  }
  return removed;
}

// Compares frames and counts those that are left out.
class Evaluation {
 public:
  explicit Evaluation(const fs::path& run_folder)
      : run_(run_folder), comparison_(run_.options().orb, run_.options().dynamic_objects.margin) {}

  void add(const RemovalTruthFrame& frame) {
    const RecordedFrame* recorded = run_.find(frame.timestamp);
    if (run_.has_frames() && recorded == nullptr) {
      ++left_out_.not_in_run;
      return;
    }
    const auto run = recorded ? removal_of(*recorded, frame.colour.size()) : RemovedThings{};
    if (!frame.truth) {
      ++left_out_.without_truth;
    } else if (!run) {
      ++left_out_.without_mask;
    } else {
      cv::Mat grey;
      cv::cvtColor(frame.colour, grey, cv::COLOR_BGR2GRAY);
      comparison_.add(grey, *frame.truth, *run);
    }
  }

  RemovalError error() const {
    RemovalError error = comparison_.error();
    error.without_truth = left_out_.without_truth;
    error.without_mask = left_out_.without_mask;
    error.not_in_run = left_out_.not_in_run;
    return error;
  }

 private:
  RecordedRemoval run_;
  RemovalComparison comparison_;
  RemovalError left_out_;
};

// Throws InputError if no frame could be compared or the run is of another source.
void require_comparable(const RemovalError& error, const RemovalTruth& truth, const std::string& source,
                        const fs::path& run_folder) {
  if (error.frames == 0) {
    auto reasons = truth.skipped();
    if (error.not_in_run > 0) reasons["not in the run"] = error.not_in_run;
    if (error.without_truth > 0) reasons["true mask missing or unusable"] = error.without_truth;
    if (error.without_mask > 0) reasons["mask of the run missing or unusable"] = error.without_mask;
    const bool is_truth_bad = error.without_truth > 0 && error.not_in_run + error.without_mask == 0;
    throw InputError(
        run_folder.string() + ": no frame can be compared with " + source + in_words(reasons) +
        (is_truth_bad ? "; instances/ must hold 16-bit images, labels/ 8-bit ones" : kOtherSource));
  }
  // Without masks most images have orb.features points whatever they show, which does not tell runs apart.
  const bool has_masks = error.with_mask > 0;
  const std::size_t compared = has_masks ? error.with_mask : error.frames;
  const std::size_t unlike = has_masks ? error.unlike_with_mask : error.unlike_run;
  if (2 * unlike > compared) {
    throw InputError(run_folder.string() + ": " + std::to_string(unlike) + " of " + std::to_string(compared) +
                     " frames of " + source + " have another number of points than the run counted" +
                     kOtherSource);
  }
}
}  // namespace

std::optional<RemovalError> evaluate_removal_of_run(const SourceArguments& source, const fs::path& run_folder,
                                                    const RemovalEvaluationSettings& settings) {
  Evaluation evaluation(run_folder);
  const auto truth = open_removal_truth(source);
  if (!truth) return std::nullopt;
  bool interrupted = false;
  {
    Progress progress(truth->size(), settings.quiet);
    std::size_t done = 0;
    while (!(interrupted = settings.stop.stop_requested())) {
      const auto frame = truth->next();
      if (!frame) break;
      evaluation.add(*frame);
      progress.show(++done, "compared");
    }
  }
  RemovalError error = evaluation.error();
  error.interrupted = interrupted;
  if (!interrupted) require_comparable(error, *truth, source.name, run_folder);
  return error;
}

}  // namespace roslam::app
