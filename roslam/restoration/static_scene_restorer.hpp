// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/restoration/background_reprojection.hpp"
#include "roslam/restoration/depth_completion.hpp"
#include "roslam/restoration/hole_inpainting.hpp"
#include "roslam/restoration/inpainter.hpp"
#include "roslam/restoration/provenance.hpp"
#include "roslam/restoration/removed_region.hpp"
#include "roslam/restoration/restoration_options.hpp"
#include "roslam/restoration/restored_image.hpp"
#include "roslam/restoration/source_image.hpp"

namespace roslam {

/// Number of source images in the memory of `allowed` ones at 640x480: 1 to `allowed`.
std::size_t sources_that_fit(int allowed, const Camera& camera);

/// Static scene restoration (section 3.3): fills the area of removed dynamic objects by reprojection of
/// source images, then inpaints with a network what no source shows. Not thread-safe.
class StaticSceneRestorer {
 public:
  struct Settings {
    RestorationOptions restoration;
    ReprojectionOptions reprojection;
    InpaintingOptions inpainting;
    DepthCompletionOptions depth_completion;
    DepthOptions depth;
  };

  /// inpainter: null: inpaints by InpaintingOptions::classic. Throws CalibrationError or OptionsError.
  StaticSceneRestorer(const Camera& camera, const Settings& settings,
                      std::shared_ptr<Inpainter> inpainter = nullptr);

  /// Restores the removed area of the target. regions: of its auxiliary descriptor, with the classes of the
  /// removed objects. sources: images from before and after, without the target itself. Throws InputError if
  /// the target's images do not match the camera or each other, ModelError if the network fails.
  RestoredImage restore(const PosedImage& target, const std::vector<RemovedRegion>& regions,
                        std::span<const SourceImage* const> sources);

  const Settings& settings() const { return settings_; }

  /// As roslam::prepare_source, with this restorer's depth limits.
  std::optional<SourceImage> prepare_source(const PosedImage& image) const;

 private:
  void check(const PosedImage& target) const;

  Camera camera_;
  Settings settings_;
  BackgroundReprojection reprojection_;
  std::shared_ptr<Inpainter> inpainter_;
};

}  // namespace roslam
