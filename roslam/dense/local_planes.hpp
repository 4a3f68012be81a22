// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/geometry/camera.hpp"

namespace roslam {

/// The local plane of each pixel, fitted to neighbours of similar depth: CV_32FC4, the unit normal n (camera
/// frame, away from the camera) and the distance d from the camera (metres), so that n . X = d for points X
/// of the plane; 0 where depth is unknown. Linear least squares, as the inverse depth of a plane is linear in
/// the pixel. depth: CV_32FC1 metres, 0 = unknown; camera: without distortion.
cv::Mat local_planes(const cv::Mat& depth, const Camera& camera);

}  // namespace roslam
