// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace roslam {

/// Where a pixel of a restored picture, or a point of a dense map, comes from; values of images of
/// provenance.
enum class Provenance : std::uint8_t {
  kMeasured = 0,       ///< the camera saw it in this frame
  kReprojected = 128,  ///< the camera saw it at another time
  kInvented = 255      ///< nobody saw it
};

}  // namespace roslam
