// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/static_scene_restorer.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/error.hpp"
#include "roslam/restoration/seam.hpp"

namespace roslam {

namespace {
const Camera& validated(const Camera& camera) {
  camera.validate();
  return camera;
}

const StaticSceneRestorer::Settings& validated(const StaticSceneRestorer::Settings& settings) {
  settings.restoration.validate();
  settings.reprojection.validate();
  settings.invention.validate();
  settings.depth_completion.validate();
  settings.depth.validate();
  return settings;
}

std::string in_words(const cv::Mat& image) {
  return std::to_string(image.cols) + "x" + std::to_string(image.rows) + " pixels";
}

cv::Scalar value_of(Provenance provenance) { return cv::Scalar(static_cast<double>(provenance)); }

// As taken, with nothing known in the hole.
RestoredView begun(const View& target, const cv::Mat& hole) {
  RestoredView view;
  view.colour = target.colour.clone();
  view.colour.setTo(0, hole);
  if (!target.depth.empty()) {
    view.depth = target.depth.clone();
    view.depth.setTo(0, hole);
  }
  view.provenance = cv::Mat(hole.size(), CV_8UC1, value_of(Provenance::kMeasured));
  view.certainty = cv::Mat(hole.size(), CV_32FC1, cv::Scalar(1));
  view.certainty.setTo(0, hole);
  view.age = cv::Mat::zeros(hole.size(), CV_32FC1);
  return view;
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
  constexpr double kUsualPixels = 640.0 * 480.0;
  const double share = std::min(1.0, kUsualPixels / (static_cast<double>(camera.width) * camera.height));
  return std::max<std::size_t>(1, static_cast<std::size_t>(allowed * share));
}

std::size_t RestoredView::pixels_of(Provenance from) const {
  return static_cast<std::size_t>(cv::countNonZero(provenance == static_cast<double>(from)));
}

StaticSceneRestorer::StaticSceneRestorer(const Camera& camera, const Settings& settings,
                                         std::shared_ptr<Inpainter> inpainter)
    : camera_(validated(camera)),
      settings_(validated(settings)),
      reprojection_(camera, settings.reprojection),
      inpainter_(std::move(inpainter)) {}

std::optional<SourceView> StaticSceneRestorer::source_view(const View& view) const {
  check(view);
  return roslam::source_view(view, settings_.depth);
}

void StaticSceneRestorer::check(const View& target) const {
  const cv::Size size(camera_.width, camera_.height);
  if (target.colour.type() != CV_8UC3 || target.colour.size() != size)
    throw InputError("the picture to restore is no 8-bit BGR image of the camera's size but has " +
                     in_words(target.colour));
  if (!target.depth.empty() && (target.depth.type() != CV_32FC1 || target.depth.size() != size))
    throw InputError("the depth to restore is not in metres (CV_32FC1) and of the camera's size; it has " +
                     in_words(target.depth));
  if (!target.removed.empty() && (target.removed.type() != CV_8UC1 || target.removed.size() != size))
    throw InputError("the mask of what was removed is no 8-bit image of the camera's size but has " +
                     in_words(target.removed));
}

RestoredView StaticSceneRestorer::restore(const View& target, const std::vector<RemovedRegion>& regions,
                                          std::span<const SourceView* const> sources) {
  check(target);
  const cv::Mat hole =
      target.removed.empty() ? cv::Mat::zeros(target.colour.size(), CV_8UC1) : cv::Mat(target.removed != 0);
  RestoredView view = begun(target, hole);
  if (cv::countNonZero(hole) == 0) return view;

  cv::Mat open = hole.clone();
  if (settings_.restoration.reproject) {
    cv::Mat area;
    cv::dilate(hole, area,
               cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * kSeamRim + 1, 2 * kSeamRim + 1}));
    const ReprojectedArea seen = reprojection_.fill(target, area, sources);
    const cv::Mat filled = seen.filled & hole & (seen.certainty >= settings_.restoration.min_certainty);
    matched_to_rim(target.colour, seen.colour, seen.filled, hole).copyTo(view.colour, filled);
    if (!view.depth.empty()) seen.depth.copyTo(view.depth, filled);
    seen.certainty.copyTo(view.certainty, filled);
    seen.age.copyTo(view.age, filled);
    view.provenance.setTo(value_of(Provenance::kReprojected), filled);
    open.setTo(0, filled);
  }
  view.provenance.setTo(value_of(Provenance::kInvented), open);
  if (!settings_.restoration.invent || cv::countNonZero(open) == 0) return view;
  view.colour = invent(view.colour, open, regions, inpainter_.get(), settings_.invention);
  if (!view.depth.empty())
    completed_depth(view.depth, open, settings_.depth_completion).copyTo(view.depth, open);
  return view;
}

}  // namespace roslam
