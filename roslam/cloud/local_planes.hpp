// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/geometry/camera.hpp"

namespace roslam {

/// The plane that each pixel lies on, fitted to its neighbours of about the same depth: CV_32FC4, the unit
/// normal n (camera frame, away from the camera) and the distance d from the camera (metres), so that n . X =
/// d for points X of the plane; 0 where depth is unknown. On a plane the inverse depth is linear in the
/// pixel, so that the fit is one of three numbers. depth: CV_32FC1 metres; camera: without distortion.
cv::Mat local_planes(const cv::Mat& depth, const Camera& camera);

}  // namespace roslam
