// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace roslam {

/// Origin of a pixel of a restored image or a point of a dense map; the values of provenance images.
enum class Provenance : std::uint8_t {
  kMeasured = 0,       ///< observed in this frame
  kReprojected = 128,  ///< observed in another frame
  kInpainted = 255     ///< never observed, generated
};

/// Colour in provenance visualisations (BGR): measured grey, reprojected green, inpainted magenta.
inline cv::Vec3b provenance_colour(Provenance provenance) {
  if (provenance == Provenance::kMeasured) return {200, 200, 200};
  return provenance == Provenance::kReprojected ? cv::Vec3b(80, 200, 70) : cv::Vec3b(210, 50, 220);
}

}  // namespace roslam
