// SPDX-License-Identifier: BSD-3-Clause
// Camera files of the calibration program Kalibr and of data sets in the ASL format, such as EuRoC.
#include <algorithm>
#include <filesystem>

#include "roslam/common/error.hpp"
#include "roslam/geometry/camera_formats.hpp"

namespace roslam {

namespace {
namespace fs = std::filesystem;

// What both formats share: camera_model, intrinsics, distortion_model, resolution.
Camera pinhole_of(const CalibrationPart& file, const std::string& coefficients) {
  Camera camera;
  if (const auto model = file.text("camera_model", "pinhole"); model != "pinhole")
    file.fail("has the camera_model '" + model +
              "'; only pinhole is supported, calibrate with pinhole-radtan " + "or pinhole-equi");
  const auto intrinsics = file.numbers("intrinsics", 4);
  camera.fx = intrinsics[0];
  camera.fy = intrinsics[1];
  camera.cx = intrinsics[2];
  camera.cy = intrinsics[3];
  const std::string model = file.text("distortion_model", "none");
  set_lens(camera, file, model, model == "none" ? std::vector<double>{} : file.numbers(coefficients));
  const auto size = file.has("resolution") ? file.numbers("resolution", 2) : std::vector<double>{0.0, 0.0};
  constexpr double kMost = 1e6;  // pixels
  if (!(size[0] >= 0.0 && size[0] < kMost && size[1] >= 0.0 && size[1] < kMost))
    file.fail("has no size in pixels in 'resolution'");
  camera.width = static_cast<int>(size[0]);
  camera.height = static_cast<int>(size[1]);
  return camera;
}

std::string cameras_in(const YAML::Node& chain) {
  std::string names;
  for (const auto& entry : chain)
    if (entry.first.IsScalar() && entry.first.Scalar().starts_with("cam") && entry.second.IsMap())
      names += " " + entry.first.Scalar();
  return names;
}

// imu0/sensor.yaml beside the folder of the camera.
std::optional<CalibrationPart> unit_beside(const CalibrationPart& camera) {
  const fs::path file = fs::path(camera.name()).parent_path() / ".." / "imu0" / "sensor.yaml";
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  return CalibrationPart(file.string(), camera.format(), load_calibration(file, "is missing"));
}
}  // namespace

AslCamera read_asl_camera(const CalibrationPart& file) {
  AslCamera sensor{pinhole_of(file, "distortion_coefficients"), std::nullopt};
  sensor.camera.fps = file.number("rate_hz", sensor.camera.fps);
  if (file.has("T_BS")) sensor.T_body_sensor = file.transform("T_BS");
  return sensor;
}

ImuCalibration read_asl_unit(const CalibrationPart& file, const SE3& T_camera_body) {
  ImuCalibration imu{T_camera_body};
  imu.gyroscope_noise = file.number("gyroscope_noise_density", imu.gyroscope_noise);
  imu.gyroscope_walk = file.number("gyroscope_random_walk", imu.gyroscope_walk);
  if (file.has("T_BS")) imu.T_camera_imu = T_camera_body * file.transform("T_BS");
  return imu;
}

ImportedCamera read_kalibr(const CalibrationPart& file, int number) {
  const std::string name = "cam" + std::to_string(number);
  if (!file.has(name)) file.fail("has no " + name + "; it has" + cameras_in(file.node()));
  const CalibrationPart part = file.part(name);
  ImportedCamera imported{pinhole_of(part, "distortion_coeffs"), {}, {}};
  if (part.has("T_cam_imu")) {
    imported.camera.imu = ImuCalibration{part.transform("T_cam_imu")};
    imported.notes.emplace_back(
        "the noise of the gyroscope is not in a camera chain; typical values are assumed");
  }
  if (const double shift = part.number("timeshift_cam_imu", 0.0); shift != 0.0)
    imported.notes.push_back("timeshift_cam_imu (" + std::to_string(shift) +
                             " s) is not applied; correct the times of the inertial samples by it");
  if (cameras_in(file.node()).find(" cam", 1) != std::string::npos)
    imported.notes.push_back("the file has several cameras; this is " + name);
  return imported;
}

ImportedCamera read_asl(const CalibrationPart& file) {
  if (const auto type = file.text("sensor_type", "camera"); type != "camera")
    file.fail("is of a sensor of the type " + type + "; give that of a camera, such as cam0/sensor.yaml");
  const AslCamera sensor = read_asl_camera(file);
  ImportedCamera imported{sensor.camera, {}, {}};
  if (sensor.T_body_sensor) {
    // The body of these data sets is the inertial measurement unit; how it is turned in the vehicle is not
    // told, so T_body_camera keeps its default.
    const SE3 T_camera_body = sensor.T_body_sensor->inverse();
    const auto unit = unit_beside(file);
    imported.camera.imu = unit ? read_asl_unit(*unit, T_camera_body) : ImuCalibration{T_camera_body};
    imported.notes.emplace_back("T_BS is taken as the pose of the camera in the frame of the inertial unit");
  }
  return imported;
}

void set_lens(Camera& camera, const CalibrationPart& file, std::string_view model,
              std::vector<double> coefficients) {
  const auto is_one_of = [&](std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), model) != names.end();
  };
  const bool is_fisheye = is_one_of({"equidistant", "fisheye", "KannalaBrandt8"});
  const bool is_pinhole =
      is_one_of({"radtan", "radial-tangential", "plumb_bob", "rational_polynomial", "PinHole"});
  if (is_one_of({"none", ""}) &&
      std::all_of(coefficients.begin(), coefficients.end(), [](double k) { return k == 0.0; })) {
    coefficients.clear();
  } else if (!is_fisheye && !is_pinhole) {
    file.fail("has the distortion model '" + std::string(model) +
              "'; supported: radtan (plumb_bob, rational_polynomial), equidistant, none");
  }
  // OpenCV's thin prism and tilt follow the eight coefficients of the rational model.
  constexpr std::size_t kRational = 8;
  while (!is_fisheye && coefficients.size() > kRational && coefficients.back() == 0.0)
    coefficients.pop_back();
  if (coefficients.size() > kRational)
    file.fail("has a thin prism or tilt model; calibrate with 5 or 8 coefficients");
  try {
    camera.set_lens(lens_model_name(is_fisheye ? LensModel::kFisheye : LensModel::kPinhole), coefficients);
  } catch (const InputError& error) {
    file.fail(error.what());
  }
}

}  // namespace roslam
