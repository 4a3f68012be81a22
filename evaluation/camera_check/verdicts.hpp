// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/camera_check/camera_check.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam::evaluation {

// Each judges what was measured and words it.
CameraFinding judge_timing(const CameraCheck& check);
CameraFinding judge_registration(const CameraCheck& check, const Camera& camera);
CameraFinding judge_distortion(const CameraCheck& check, const Camera& camera);
CameraFinding judge_depth_scale(const CameraCheck& check, const Camera& camera);

}  // namespace roslam::evaluation
