// SPDX-License-Identifier: BSD-3-Clause
// Camera files of OpenCV's FileStorage and of programs that use it or its matrices: ROS camera_info and
// ORB-SLAM.
#include <string>

#include "roslam/geometry/camera_formats.hpp"

namespace roslam {

namespace {
using Keys = std::vector<std::string>;

int pixels(const CalibrationPart& file, const Keys& keys) {
  for (const std::string& key : keys)
    if (file.has(key)) return file.pixels(key);
  return 0;  // not told
}

bool has_any(const CalibrationPart& file, const Keys& keys) {
  for (const std::string& key : keys)
    if (file.has(key)) return true;
  return false;
}

ImuCalibration orb_slam_unit(const CalibrationPart& file) {
  ImuCalibration imu{file.transform(file.key_of({"IMU.T_b_c1", "Tbc"})).inverse()};
  imu.gyroscope_noise = file.number("IMU.NoiseGyro", imu.gyroscope_noise);
  imu.gyroscope_walk = file.number("IMU.GyroWalk", imu.gyroscope_walk);
  return imu;
}
}  // namespace

ImportedCamera read_opencv(const CalibrationPart& file, int number) {
  const bool is_stereo = file.has("M1");
  if (number > 1 || (number == 1 && !is_stereo))
    file.fail("has no camera cam" + std::to_string(number) +
              (is_stereo ? "; it has cam0 cam1" : "; it has one"));
  const std::string side = std::to_string(number + 1);
  const Keys matrices =
      is_stereo ? Keys{"M" + side}
                : Keys{"camera_matrix", "Camera_Matrix", "camera_Matrix", "cameraMatrix", "K", "k"};
  const Keys lenses = is_stereo ? Keys{"D" + side} : Keys{"distortion_coefficients",
                                                          "Distortion_Coefficients",
                                                          "distortion_Coefficients",
                                                          "distCoeffs",
                                                          "D",
                                                          "d"};
  ImportedCamera imported;
  Camera& camera = imported.camera;
  const auto K = file.numbers(file.key_of(matrices), 9);
  if (K[1] != 0.0) file.fail("has skew in its camera matrix, which is not supported");
  camera.fx = K[0];
  camera.fy = K[4];
  camera.cx = K[2];
  camera.cy = K[5];
  const bool has_lens = has_any(file, lenses);
  const std::string usual = file.number("fisheye_model", 0.0) != 0.0 ? "fisheye" : "plumb_bob";
  set_lens(camera, file, file.text("distortion_model", has_lens ? usual : "none"),
           has_lens ? file.numbers(file.key_of(lenses)) : std::vector<double>{});
  camera.width = pixels(file, {"image_width", "image_Width", "width"});
  camera.height = pixels(file, {"image_height", "image_Height", "height"});
  if (is_stereo) imported.notes.push_back("the file has two cameras; this is cam" + std::to_string(number));
  return imported;
}

ImportedCamera read_orb_slam(const CalibrationPart& file, int number) {
  const bool is_new = file.has("Camera1.fx");
  if (number > 1 || (number == 1 && !file.has("Camera2.fx")))
    file.fail("has no camera cam" + std::to_string(number));
  const std::string key = is_new ? "Camera" + std::to_string(number + 1) + "." : "Camera.";
  ImportedCamera imported;
  Camera& camera = imported.camera;
  camera.fx = file.number(key + "fx");
  camera.fy = file.number(key + "fy");
  camera.cx = file.number(key + "cx");
  camera.cy = file.number(key + "cy");
  const std::string type = file.text("Camera.type", "PinHole");
  std::vector<double> coefficients;
  const Keys names =
      type == "KannalaBrandt8" ? Keys{"k1", "k2", "k3", "k4"} : Keys{"k1", "k2", "p1", "p2", "k3"};
  if (type != "Rectified")
    for (const std::string& name : names)
      coefficients.push_back(file.number(
          key + name, name == "k1" && names.size() == 4 ? std::nullopt : std::make_optional(0.0)));
  set_lens(camera, file, type == "Rectified" ? "none" : type, coefficients);
  camera.width = pixels(file, {"Camera.width"});
  camera.height = pixels(file, {"Camera.height"});
  camera.fps = file.number("Camera.fps", camera.fps);
  camera.depth_units_per_metre = file.number("RGBD.DepthMapFactor", file.number("DepthMapFactor", 0.0));
  if (number == 0 && has_any(file, {"IMU.T_b_c1", "Tbc"})) camera.imu = orb_slam_unit(file);
  return imported;
}

}  // namespace roslam
