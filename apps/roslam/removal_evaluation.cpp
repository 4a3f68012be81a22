// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/removal_evaluation.hpp"

#include <opencv2/imgproc.hpp>
#include <string>

#include "apps/roslam/output.hpp"
#include "apps/roslam/progress.hpp"
#include "apps/roslam/removal_truth.hpp"
#include "roslam/error.hpp"
#include "roslam/pipeline/recorded_removal.hpp"
#include "roslam/sources/image_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

constexpr const char* kOtherSource = "; give the SOURCE, --camera, --traffic and --seed it was made from";

std::string size_in_words(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

// Nothing if the mask is lost.
std::optional<RemovedThings> removed_things(const RecordedFrame& frame, const cv::Size& picture) {
  RemovedThings things;
  things.points = frame.points;
  if (frame.mask.empty()) return frame.has_objects ? std::nullopt : std::make_optional(things);
  things.mask = read_label_image(frame.mask).image;
  if (things.mask.empty()) return std::nullopt;
  if (things.mask.size() != picture) {
    throw InputError(frame.mask.string() + ": is " + size_in_words(things.mask.size()) +
                     " but the picture of that time " + size_in_words(picture) + " pixels" + kOtherSource);
  }
  for (const std::size_t value : frame.resting) {
    if (things.resting.empty()) things.resting = cv::Mat::zeros(picture, CV_8UC1);
    things.resting.setTo(255, things.mask == static_cast<double>(value));
  }
  return things;
}

// Counts the frames that are left out.
class Evaluation {
 public:
  explicit Evaluation(const fs::path& run_folder)
      : run_(run_folder), comparison_(run_.options().orb, run_.options().removal.margin) {}

  void add(const RemovalTruthFrame& frame) {
    const RecordedFrame* recorded = run_.find(frame.timestamp);
    if (run_.has_frames() && recorded == nullptr) {
      ++left_out_.not_in_run;
      return;
    }
    const auto run = recorded ? removed_things(*recorded, frame.colour.size()) : RemovedThings{};
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

// Throws InputError for what tells nothing of the run, or of another one.
void require_sense(const RemovalError& error, const RemovalTruth& truth, const std::string& source,
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
  // Where nothing was removed most pictures have as many points as are wanted, whatever they show.
  const bool has_masks = error.with_mask > 0;
  const std::size_t telling = has_masks ? error.with_mask : error.frames;
  const std::size_t unlike = has_masks ? error.unlike_with_mask : error.unlike_run;
  if (2 * unlike > telling) {
    throw InputError(run_folder.string() + ": " + std::to_string(unlike) + " of " + std::to_string(telling) +
                     " frames of " + source + " have not as many points as the run counted" + kOtherSource);
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
  if (!interrupted) require_sense(error, *truth, source.name, run_folder);
  return error;
}

}  // namespace roslam::app
