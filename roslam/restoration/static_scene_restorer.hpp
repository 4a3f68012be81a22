// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/restoration/depth_completion.hpp"
#include "roslam/restoration/inpainter.hpp"
#include "roslam/restoration/invention.hpp"
#include "roslam/restoration/provenance.hpp"
#include "roslam/restoration/removed_region.hpp"
#include "roslam/restoration/reprojection.hpp"
#include "roslam/restoration/view.hpp"

namespace roslam {

struct RestorationOptions {
  bool reproject = true;         ///< fill from other views
  bool invent = true;            ///< paint the rest; false: it is left black and without depth
  double min_certainty = 0.004;  ///< of a reprojected pixel, 0 to 1; what is less sure is painted
  int margin = 8;                ///< pixels by which what was removed is dilated: outlines are blurred

  // Which frames others are filled from; each takes 2.9 MB at 640x480. Of larger pictures accordingly fewer
  // are kept.
  double source_interval = 0.5;  ///< seconds; of a recorded run, beside keyframes, a frame as often
  int max_sources = 200;         ///< of a recorded run; of more every n-th is used
  int recent_sources = 40;       ///< keyframes, in flight the newest

  int queue = 4;  ///< keyframes that may wait to be restored in flight; older ones are dropped

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// How many frames of a camera to keep where so many are allowed at 640x480; at least 1.
std::size_t sources_that_fit(int allowed, const Camera& camera);

/// A picture of the static scene; all images of the size of the picture taken.
struct RestoredView {
  cv::Mat colour;      ///< CV_8UC3, BGR
  cv::Mat depth;       ///< CV_32FC1 metres, 0 = unknown, as a camera leaves it unknown; empty where none came
  cv::Mat provenance;  ///< CV_8UC1, values of Provenance
  cv::Mat certainty;   ///< CV_32FC1: 1 where measured, as ReprojectedArea says, 0 where invented
  cv::Mat age;         ///< CV_32FC1 seconds since or until the pixel was seen, 0 where measured or invented

  std::size_t pixels_of(Provenance provenance) const;
};

/// Fills what the removal of moving things leaves open (section 3.3): first with what the camera saw at other
/// times, then, where nobody ever looked, with what a network makes of the surroundings. Not safe to call
/// from several threads at once.
class StaticSceneRestorer {
 public:
  struct Settings {
    RestorationOptions restoration;
    ReprojectionOptions reprojection;
    InventionOptions invention;
    DepthCompletionOptions depth_completion;
    DepthOptions depth;
  };

  /// inpainter: null, a classic method paints in its place. Throws CalibrationError or OptionsError.
  StaticSceneRestorer(const Camera& camera, const Settings& settings,
                      std::shared_ptr<Inpainter> inpainter = nullptr);

  /// What is removed from the target is restored. regions: of its auxiliary descriptor, which say what it
  /// was. sources: views from before and after, the target not among them. Throws InputError if the target's
  /// images do not fit the camera or each other, ModelError if the network fails.
  RestoredView restore(const View& target, const std::vector<RemovedRegion>& regions,
                       std::span<const SourceView* const> sources);

  const Settings& settings() const { return settings_; }

  /// As roslam::source_view, with this restorer's depth limits.
  std::optional<SourceView> source_view(const View& view) const;

 private:
  void check(const View& target) const;

  Camera camera_;
  Settings settings_;
  BackgroundReprojection reprojection_;
  std::shared_ptr<Inpainter> inpainter_;
};

}  // namespace roslam
