// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/static_scene_restorer.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/restoration/diffusion_inpainting.hpp"
#include "roslam/restoration/disc_dilation.hpp"
#include "roslam/restoration/seam_blending.hpp"

namespace roslam {

namespace {
const Camera& validated(const Camera& camera) {
  camera.validate();
  return camera;
}

const StaticSceneRestorer::Settings& validated(const StaticSceneRestorer::Settings& settings) {
  settings.restoration.validate();
  settings.reprojection.validate();
  settings.inpainting.validate();
  settings.depth_completion.validate();
  settings.depth.validate();
  return settings;
}

std::string size_text(const cv::Mat& image) {
  return std::to_string(image.cols) + "x" + std::to_string(image.rows) + " pixels";
}

cv::Scalar value_of(Provenance provenance) { return cv::Scalar(static_cast<double>(provenance)); }

// The input with the hole cleared.
RestoredImage with_hole(const PosedImage& target, const cv::Mat& hole) {
  RestoredImage result;
  result.colour = target.colour.clone();
  result.colour.setTo(0, hole);
  if (!target.depth.empty()) {
    result.depth = target.depth.clone();
    result.depth.setTo(0, hole);
  }
  result.provenance = cv::Mat(hole.size(), CV_8UC1, value_of(Provenance::kMeasured));
  result.certainty = cv::Mat(hole.size(), CV_32FC1, cv::Scalar(1));
  result.certainty.setTo(0, hole);
  result.age = cv::Mat::zeros(hole.size(), CV_32FC1);
  return result;
}
}  // namespace

void RestorationOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("restoration.") + message);
  };
  require(min_certainty >= 0.0 && min_certainty <= 1.0, "min_certainty must be 0 to 1");
  require(margin >= 0 && margin <= 200, "margin must be 0 to 200 pixels");
  require(source_interval > 0.0 && source_interval <= 3600.0,
          "source_interval must be above 0 and at most 3600 seconds");
  require(max_sources >= 1 && max_sources <= 10000, "max_sources must be 1 to 10000");
  require(recent_sources >= 1 && recent_sources <= 10000, "recent_sources must be 1 to 10000");
  require(queue >= 1 && queue <= 1000, "queue must be 1 to 1000");
}

std::size_t sources_that_fit(int allowed, const Camera& camera) {
  constexpr double kReferencePixels = 640.0 * 480.0;
  const double share = std::min(1.0, kReferencePixels / (static_cast<double>(camera.width) * camera.height));
  return std::max<std::size_t>(1, static_cast<std::size_t>(allowed * share));
}

std::size_t RestoredImage::pixels_of(Provenance from) const {
  return static_cast<std::size_t>(cv::countNonZero(provenance == static_cast<double>(from)));
}

StaticSceneRestorer::StaticSceneRestorer(const Camera& camera, const Settings& settings,
                                         std::shared_ptr<Inpainter> inpainter)
    : camera_(validated(camera)),
      settings_(validated(settings)),
      reprojection_(camera, settings.reprojection),
      inpainter_(std::move(inpainter)) {}

std::optional<SourceImage> StaticSceneRestorer::prepare_source(const PosedImage& image) const {
  check(image);
  return roslam::prepare_source(image, settings_.depth);
}

void StaticSceneRestorer::check(const PosedImage& target) const {
  const cv::Size size(camera_.width, camera_.height);
  if (target.colour.type() != CV_8UC3 || target.colour.size() != size)
    throw InputError(
        "the image to restore is not an 8-bit BGR image (CV_8UC3) of the camera's size; it has " +
        size_text(target.colour));
  if (!target.depth.empty() && (target.depth.type() != CV_32FC1 || target.depth.size() != size))
    throw InputError(
        "the depth to restore is not a depth image in metres (CV_32FC1) of the camera's size; it has " +
        size_text(target.depth));
  if (!target.removed.empty() && (target.removed.type() != CV_8UC1 || target.removed.size() != size))
    throw InputError(
        "the mask of removed objects is not an 8-bit image (CV_8UC1) of the camera's size; it has " +
        size_text(target.removed));
}

RestoredImage StaticSceneRestorer::restore(const PosedImage& target,
                                           const std::vector<RemovedRegion>& regions,
                                           std::span<const SourceImage* const> sources) {
  check(target);
  const cv::Mat hole =
      target.removed.empty() ? cv::Mat::zeros(target.colour.size(), CV_8UC1) : cv::Mat(target.removed != 0);
  RestoredImage result = with_hole(target, hole);
  if (cv::countNonZero(hole) == 0) return result;

  cv::Mat unfilled = hole.clone();
  if (settings_.restoration.reproject) {
    const ReprojectedArea reprojected =
        reprojection_.fill(target, dilated_by_disc(hole, 2 * kSeamRim + 1), sources);
    const cv::Mat filled =
        reprojected.filled & hole & (reprojected.certainty >= settings_.restoration.min_certainty);
    matched_to_rim(target.colour, reprojected.colour, reprojected.filled, hole).copyTo(result.colour, filled);
    if (!result.depth.empty()) reprojected.depth.copyTo(result.depth, filled);
    reprojected.certainty.copyTo(result.certainty, filled);
    reprojected.age.copyTo(result.age, filled);
    result.provenance.setTo(value_of(Provenance::kReprojected), filled);
    unfilled.setTo(0, filled);
  }
  result.provenance.setTo(value_of(Provenance::kInpainted), unfilled);
  if (!settings_.restoration.inpaint || !(inpainter_ || has_diffusion_inpainting()) ||
      cv::countNonZero(unfilled) == 0)
    return result;
  result.colour = inpaint_hole(result.colour, unfilled, regions, inpainter_.get(), settings_.inpainting);
  if (!result.depth.empty())
    completed_depth(result.depth, unfilled, settings_.depth_completion).copyTo(result.depth, unfilled);
  return result;
}

}  // namespace roslam
