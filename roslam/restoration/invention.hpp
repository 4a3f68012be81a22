// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/restoration/inpainter.hpp"
#include "roslam/restoration/removed_region.hpp"

namespace roslam {

/// OpenCV's methods, which need no network.
enum class ClassicMethod {
  kTelea,        ///< Telea: "An Image Inpainting Technique Based on the Fast Marching Method", JGT 2004
  kNavierStokes  ///< Bertalmio, Bertozzi, Sapiro: "Navier-Stokes, Fluid Dynamics, and Image and Video
                 ///< Inpainting", CVPR 2001; at the border of the picture it leaves what was there
};

struct InventionOptions {
  ClassicMethod classic = ClassicMethod::kTelea;  ///< what fills in where the network does not
  int max_crops = 4;  ///< holes of a picture that the network paints, the largest; a classic method the rest
  int min_width = 8;  ///< pixels; what is nowhere as wide a classic method fills as well
  int joined_within = 24;  ///< pixels between holes that are painted together
  double context = 1.8;    ///< side of the crop over that of the hole
  int min_crop = 160;      ///< pixels, side of the smallest crop

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Paints the pixels that nobody saw: crops around each hole with the inpainter, pasted back in the light of
/// their surroundings; without one (null), and for what is small, with a classic method. picture: CV_8UC3,
/// whose content in the hole is ignored. hole: CV_8UC1. A picture that is all hole becomes grey. Returns the
/// picture filled. Throws ModelError.
cv::Mat invent(const cv::Mat& picture, const cv::Mat& hole, const std::vector<RemovedRegion>& regions,
               Inpainter* inpainter, const InventionOptions& options = {});

}  // namespace roslam
