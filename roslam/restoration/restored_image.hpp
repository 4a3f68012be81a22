// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>

#include "roslam/common/export.hpp"
#include "roslam/restoration/provenance.hpp"

namespace roslam {

/// A restored image of the static scene; all images of the input's size.
struct ROSLAM_EXPORT RestoredImage {
  cv::Mat colour;      ///< CV_8UC3, BGR
  cv::Mat depth;       ///< CV_32FC1 metres, 0 = unknown; empty if the input has no depth
  cv::Mat provenance;  ///< CV_8UC1, values of Provenance
  cv::Mat certainty;   ///< CV_32FC1: 1 where measured, of ReprojectedArea where reprojected, else 0
  cv::Mat age;         ///< CV_32FC1 seconds to the observation of reprojected pixels (past or future), else 0

  std::size_t pixels_of(Provenance provenance) const;
};

}  // namespace roslam
