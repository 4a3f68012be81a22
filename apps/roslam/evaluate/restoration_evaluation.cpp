// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/evaluate/restoration_evaluation.hpp"

#include <map>
#include <string>

#include "apps/roslam/evaluate/restoration_images.hpp"
#include "apps/roslam/support/progress.hpp"
#include "roslam/common/error.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/semantics/label_set.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;

cv::Mat required_image(const fs::path& file) {
  const ImageFile read = read_colour_image(file);
  if (read.image.empty()) throw InputError(file.string() + ": " + read.error);
  return read.image;
}

// Masks may have 8 or 16 bits, such as images of actor numbers.
cv::Mat required_mask(const fs::path& file) {
  const ImageFile bytes = read_label_image(file);
  const cv::Mat mask = bytes.image.empty() ? read_depth_image(file).image : bytes.image;
  if (mask.empty())
    throw InputError(file.string() + ": is no mask of 8 or 16 bits of the restored pixels; it " +
                     bytes.error);
  return mask != 0;
}

fs::path folder_of_masks(const RestorationEvaluationSettings& settings) {
  if (settings.masks.empty()) return settings.estimate / "provenance";
  std::error_code error;
  return fs::is_directory(settings.masks / "provenance", error) ? settings.masks / "provenance"
                                                                : settings.masks;
}

// Depth that cannot be read, or has unknown units, is not compared.
cv::Mat depth_of(const SequenceImage& image, const std::optional<double>& units) {
  if (image.depth.empty() || !units) return {};
  const cv::Mat raw = read_depth_image(image.depth).image;
  return raw.empty() ? raw : depth_to_metres(raw, *units);
}

class TruthIndex {
 public:
  explicit TruthIndex(std::vector<SequenceImage> images) : images_(std::move(images)) {
    for (const auto& image : images_) {
      by_name_[image.name] = &image;
      if (image.timestamp) by_time_[time_text(*image.timestamp)] = &image;
    }
  }

  const SequenceImage* find(const SequenceImage& estimate) const {
    if (estimate.timestamp && !by_time_.empty()) {
      const auto found = by_time_.find(time_text(*estimate.timestamp));
      return found == by_time_.end() ? nullptr : found->second;
    }
    const auto found = by_name_.find(estimate.name);
    return found == by_name_.end() ? nullptr : found->second;
  }

 private:
  std::vector<SequenceImage> images_;
  std::map<std::string, const SequenceImage*> by_name_;
  std::map<std::string, const SequenceImage*> by_time_;
};

cv::Mat movable_in(const cv::Mat& image, Segmenter* segmenter) {
  return segmenter ? movable_mask(segmenter->segment(image).labels) : cv::Mat();
}
}  // namespace

RestorationError evaluate_restoration(const RestorationEvaluationSettings& settings) {
  const TruthIndex truth(background_of(settings.truth));
  const auto estimates = images_of(settings.estimate);
  const fs::path masks = folder_of_masks(settings);
  const auto truth_units =
      settings.truth_depth_units ? settings.truth_depth_units : depth_units_beside(settings.truth);
  const auto estimate_units = depth_units_beside(settings.estimate);
  RestorationComparison comparison;
  Progress progress(estimates.size(), settings.quiet);
  for (std::size_t i = 0; i < estimates.size() && !settings.stop.stop_requested(); i += settings.every) {
    const SequenceImage& estimate = estimates[i];
    const SequenceImage* match = truth.find(estimate);
    const fs::path mask = masks / (estimate.name + ".png");
    if (match == nullptr) continue;
    EvaluatedImage image{required_image(match->colour),
                         required_image(estimate.colour),
                         required_mask(mask),
                         {},
                         depth_of(*match, truth_units),
                         depth_of(estimate, estimate_units),
                         {}};
    image.provenance = read_label_image(settings.estimate / "provenance" / (estimate.name + ".png")).image;
    image.movable = movable_in(image.estimate, settings.segmenter);
    try {
      comparison.add(image);
    } catch (const InputError& error) {
      throw InputError(estimate.colour.string() + ": " + error.what());
    }
    progress.show(i + 1, "compared");
  }
  RestorationError error = comparison.error();
  error.interrupted = settings.stop.stop_requested();
  if (error.interrupted) return error;
  if (error.images == 0)
    throw InputError(settings.truth.string() + ": has no image of the time or name of one in " +
                     settings.estimate.string());
  if (error.with_hole == 0)
    throw InputError(masks.string() +
                     ": no mask has a hole; masks must be nonzero where the image was restored");
  if (error.hole_pixels == error.pixels)
    throw InputError(masks.string() +
                     ": the masks cover all of every image; they must be 0 where nothing was restored");
  return error;
}

}  // namespace roslam::app
