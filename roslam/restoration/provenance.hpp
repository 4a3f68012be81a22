// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace roslam {

/// Where a pixel of a restored picture, or a point of a dense map, comes from; values of images of
/// provenance.
enum class Provenance : std::uint8_t {
  kMeasured = 0,       ///< the camera saw it in this frame
  kReprojected = 128,  ///< the camera saw it at another time
  kInvented = 255      ///< nobody saw it
};

/// In pictures of where things come from (BGR): measured grey, reprojected green, invented magenta.
inline cv::Vec3b provenance_colour(Provenance provenance) {
  if (provenance == Provenance::kMeasured) return {200, 200, 200};
  return provenance == Provenance::kReprojected ? cv::Vec3b(80, 200, 70) : cv::Vec3b(210, 50, 220);
}

}  // namespace roslam
