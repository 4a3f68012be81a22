// SPDX-License-Identifier: BSD-3-Clause
// Camera files of other programs, written by hand from the documentation of their formats.
#pragma once

#include <string>

namespace roslam {

inline const std::string kCamera = R"(  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.8e-05]
  distortion_model: radtan
  intrinsics: [458.5, 457.25, 367.5, 248.75]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
)";

inline const std::string kKalibr = "cam0:\n  cam_overlaps: [1]\n" + kCamera + R"(cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [0.0034, 0.0007, -0.002, 0.0002]
  distortion_model: equidistant
  intrinsics: [190.5, 190.25, 254.5, 256.75]
  resolution: [512, 512]
  rostopic: /cam1/image_raw
)";

// A camera that looks along the x axis of its inertial unit, which is y left, z up, and 0.1 m behind it:
// x_camera = -y, y_camera = -z, z_camera = x + 0.1.
inline const std::string kCameraOfUnit = R"(  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.0]
  - [0.0, 0.0, -1.0, 0.0]
  - [1.0, 0.0, 0.0, 0.1]
  - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: 0.0045
)";

inline const std::string kRos = R"(image_width: 640
image_height: 480
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [520.5, 0.0, 319.25, 0.0, 521.5, 241.75, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.25, -0.75, -0.003, 0.002, 0.9]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [500, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0]
)";

inline const std::string kAsl = R"(# General sensor definitions.
sensor_type: camera
comment: a camera
T_BS:
  cols: 4
  rows: 4
  data: [0.0, 0.0, 1.0, -0.1,
         -1.0, 0.0, 0.0, 0.0,
         0.0, -1.0, 0.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.5, 457.25, 367.5, 248.75] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0002, 1.8e-05]
)";

inline const std::string kOpenCv = R"(%YAML:1.0
---
calibration_time: "Mon 01 Jan 2024"
image_width: 1280
image_height: 720
flags: 16384
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 605.5, 0., 639.25, 0., 604.5,
       365.75, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 8
   cols: 1
   dt: d
   data: [ 4.5e-01, -2.5, 5.6e-04, -3.3e-04, 1.5, 3.25e-01,
       -2.25, 1.375 ]
avg_reprojection_error: 2.5e-01
)";

inline const std::string kOpenCvXml = R"(<?xml version="1.0"?>
<opencv_storage>
<!-- <camera_matrix> in a comment -->
<image_Width>640</image_Width>
<image_Height>480</image_Height>
<Camera_Matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    520.5 0. 319.25 0. 521.5
    241.75 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix">
  <rows>5</rows><cols>1</cols><dt>d</dt>
  <data>2.5e-01 -7.5e-01 -3e-03 2e-03 9e-01</data></Distortion_Coefficients>
<image_points/>
</opencv_storage>
)";

inline const std::string kStereo = R"(%YAML:1.0
---
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data:[ 500., 0., 320., 0., 501., 240., 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0.1, 0., 0., 0., 0. ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 510., 0., 322., 0., 511., 242., 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 14
   dt: d
   data: [ -0.1, 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0. ]
)";

inline const std::string kOrbSlam2 = R"(%YAML:1.0

#---- Camera Parameters
Camera.fx: 517.5
Camera.fy: 516.5
Camera.cx: 318.5
Camera.cy: 255.25

Camera.k1: 0.25
Camera.k2: -0.95
Camera.p1: -0.005
Camera.p2: 0.0025
Camera.k3: 1.125

Camera.width: 640
Camera.height: 480
Camera.fps: 25.0
Camera.bf: 40.0
Camera.RGB: 1
ThDepth: 40.0
DepthMapFactor: 5000.0
ORBextractor.nFeatures: 1000
)";

inline const std::string kOrbSlam3 = R"(%YAML:1.0

File.version: "1.0"
Camera.type: "KannalaBrandt8"
Camera1.fx: 190.5
Camera1.fy: 190.25
Camera1.cx: 254.5
Camera1.cy: 256.75
Camera1.k1: 0.0034
Camera1.k2: 0.0007
Camera1.k3: -0.002
Camera1.k4: 0.0002
Camera2.fx: 191.5
Camera2.fy: 191.25
Camera2.cx: 255.5
Camera2.cy: 255.75
Camera2.k1: 0.0035
Camera2.k2: 0.0008
Camera2.k3: -0.003
Camera2.k4: 0.0003
Camera.width: 512
Camera.height: 512
Camera.fps: 20
RGBD.DepthMapFactor: 1000.0
IMU.T_b_c1: !!opencv-matrix
  rows: 4
  cols: 4
  dt: f
  data: [0.0, 0.0, 1.0, -0.1, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
IMU.NoiseGyro: 0.00016
IMU.NoiseAcc: 0.0028
IMU.GyroWalk: 0.000022
IMU.Frequency: 200.0
)";

}  // namespace roslam
