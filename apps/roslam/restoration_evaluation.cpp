// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/restoration_evaluation.hpp"

#include <map>
#include <string>

#include "apps/roslam/progress.hpp"
#include "apps/roslam/restoration_pictures.hpp"
#include "roslam/error.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/semantics/label_set.hpp"
#include "roslam/sources/image_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

cv::Mat required_picture(const fs::path& file) {
  const ImageFile read = read_colour_image(file);
  if (read.image.empty()) throw InputError(file.string() + ": " + read.error);
  return read.image;
}

// Images of masks may have 8 or 16 bits: numbers of actors are masks too.
cv::Mat required_mask(const fs::path& file) {
  const ImageFile bytes = read_label_image(file);
  const cv::Mat mask = bytes.image.empty() ? read_depth_image(file).image : bytes.image;
  if (mask.empty())
    throw InputError(file.string() +
                     ": no image of 8 or 16 bits that tells where the picture was restored; it " +
                     bytes.error);
  return mask != 0;
}

fs::path folder_of_masks(const RestorationEvaluationSettings& settings) {
  if (settings.masks.empty()) return settings.estimate / "provenance";
  std::error_code error;
  return fs::is_directory(settings.masks / "provenance", error) ? settings.masks / "provenance"
                                                                : settings.masks;
}

// Depth that cannot be read, or whose units nobody knows, is not compared.
cv::Mat depth_of(const SequencePicture& picture, const std::optional<double>& units) {
  if (picture.depth.empty() || !units) return {};
  const cv::Mat raw = read_depth_image(picture.depth).image;
  return raw.empty() ? raw : depth_to_metres(raw, *units);
}

class TruthIndex {
 public:
  explicit TruthIndex(std::vector<SequencePicture> pictures) : pictures_(std::move(pictures)) {
    for (const auto& picture : pictures_) {
      by_name_[picture.name] = &picture;
      if (picture.timestamp) by_time_[time_text(*picture.timestamp)] = &picture;
    }
  }

  const SequencePicture* find(const SequencePicture& estimate) const {
    if (estimate.timestamp && !by_time_.empty()) {
      const auto found = by_time_.find(time_text(*estimate.timestamp));
      return found == by_time_.end() ? nullptr : found->second;
    }
    const auto found = by_name_.find(estimate.name);
    return found == by_name_.end() ? nullptr : found->second;
  }

 private:
  std::vector<SequencePicture> pictures_;
  std::map<std::string, const SequencePicture*> by_name_;
  std::map<std::string, const SequencePicture*> by_time_;
};

cv::Mat movable_in(const cv::Mat& picture, Segmenter* segmenter) {
  return segmenter ? movable_mask(segmenter->segment(picture).labels) : cv::Mat();
}
}  // namespace

RestorationError evaluate_restoration(const RestorationEvaluationSettings& settings) {
  const TruthIndex truth(background_of(settings.truth));
  const auto estimates = pictures_of(settings.estimate);
  const fs::path masks = folder_of_masks(settings);
  const auto truth_units =
      settings.truth_depth_units ? settings.truth_depth_units : depth_units_beside(settings.truth);
  const auto estimate_units = depth_units_beside(settings.estimate);
  RestorationComparison comparison;
  Progress progress(estimates.size(), settings.quiet);
  for (std::size_t i = 0; i < estimates.size() && !settings.stop.stop_requested(); i += settings.every) {
    const SequencePicture& estimate = estimates[i];
    const SequencePicture* match = truth.find(estimate);
    const fs::path mask = masks / (estimate.name + ".png");
    if (match == nullptr) continue;
    RestoredPicture picture{required_picture(match->colour),
                            required_picture(estimate.colour),
                            required_mask(mask),
                            {},
                            depth_of(*match, truth_units),
                            depth_of(estimate, estimate_units),
                            {}};
    picture.provenance = read_label_image(settings.estimate / "provenance" / (estimate.name + ".png")).image;
    picture.movable = movable_in(picture.estimate, settings.segmenter);
    try {
      comparison.add(picture);
    } catch (const InputError& error) {
      throw InputError(estimate.colour.string() + ": " + error.what());
    }
    progress.show(i + 1, "compared");
  }
  RestorationError error = comparison.error();
  error.interrupted = settings.stop.stop_requested();
  if (error.interrupted) return error;
  if (error.pictures == 0)
    throw InputError(settings.truth.string() + ": has no picture of the time or name of one in " +
                     settings.estimate.string());
  if (error.with_hole == 0)
    throw InputError(masks.string() +
                     ": no mask has a hole; masks must be nonzero where the picture was restored");
  if (error.hole_pixels == error.pixels)
    throw InputError(masks.string() +
                     ": the masks cover all of every picture; they must be 0 where nothing was restored");
  return error;
}

}  // namespace roslam::app
