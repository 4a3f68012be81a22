// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "apps/roslam/camera/camera_check_command.hpp"
#include "apps/roslam/camera/camera_notes.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/live_camera.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/replaces_only.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/geometry/camera_export.hpp"
#include "roslam/geometry/camera_import.hpp"

namespace roslam::app {

namespace {
using Json = nlohmann::ordered_json;

constexpr double kDegrees = 180.0 / std::numbers::pi;

struct CameraArguments {
  std::string camera;
  std::string size;
  double depth_units = 0.0;
  bool json = false;
  std::filesystem::path out;
  std::string format = "roslam";
};

// "640x480"; nothing for an empty text.
std::optional<std::array<int, 2>> size_from(const std::string& text) {
  if (text.empty()) return std::nullopt;
  std::array<int, 2> size{};
  const char* end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size[0]);
  const bool has_x = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = has_x ? std::from_chars(width.ptr + 1, end, size[1]) : width;
  if (!has_x || height.ec != std::errc() || height.ptr != end || size[0] <= 0 || size[1] <= 0)
    throw InputError("--size " + text + ": write WIDTHxHEIGHT in pixels, such as 640x480");
  return size;
}

ImportedCamera camera_of(const CameraArguments& arguments) {
  ImportedCamera imported = import_camera(arguments.camera, size_from(arguments.size));
  Camera& camera = imported.camera;
  if (arguments.depth_units > 0.0) camera.depth_units_per_metre = arguments.depth_units;
  if (camera.depth_units_per_metre == 0.0)
    imported.notes.push_back("depth_units_per_metre is not set, which 16-bit depth images need; " +
                             std::string(usual_depth_units()) + " (--depth-units)");
  if (imported.format == "a preset")
    for (const std::string& note : preset_notes(arguments.camera)) imported.notes.push_back(note);
  if (camera.model == LensModel::kFisheye)
    imported.notes.emplace_back("pixels beyond 80 degrees from the axis of a fisheye are not used");
  if (!camera.has_central_principal_point())
    imported.notes.emplace_back(
        "the principal point is far from the image centre: is the calibration of another image size?");
  return imported;
}

double angle_between(const Camera& camera, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d from = camera.unproject(camera.undistort(a), 1.0);
  const Eigen::Vector3d to = camera.unproject(camera.undistort(b), 1.0);
  return std::atan2(from.cross(to).norm(), from.dot(to)) * kDegrees;
}

Json field_of_view(const Camera& camera) {
  const double right = camera.width - 1.0, bottom = camera.height - 1.0;
  return {{"horizontal", angle_between(camera, {0, camera.cy}, {right, camera.cy})},
          {"vertical", angle_between(camera, {camera.cx, 0}, {camera.cx, bottom})},
          {"diagonal", angle_between(camera, {0, 0}, {right, bottom})}};
}

// How far distortion moves the corners, in the order top left, top right, bottom left, bottom right; null
// where the lens does not cover them.
Json corner_shifts(const Camera& camera) {
  Json shifts = Json::array();
  for (const double y : {0.0, camera.height - 1.0}) {
    for (const double x : {0.0, camera.width - 1.0}) {
      const auto undistorted = camera.try_undistort({x, y});
      shifts.push_back(undistorted ? Json((*undistorted - Eigen::Vector2d(x, y)).norm()) : Json());
    }
  }
  return shifts;
}

std::vector<double> rows_of(const SE3& transform) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T = transform.matrix();
  return {T.data(), T.data() + T.size()};
}

// Roll, pitch, yaw of the camera's housing in degrees, as --mount takes them.
Eigen::Vector3d mount_angles(const Camera& camera) {
  const Eigen::Matrix3d R = (camera.T_body_camera * forward_camera().inverse()).rotation().toRotationMatrix();
  const double pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  return kDegrees * Eigen::Vector3d(std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0)));
}

Json describe(const ImportedCamera& imported, const std::string& name) {
  const Camera& camera = imported.camera;
  const Eigen::Vector3d angles = mount_angles(camera);
  Json json{{"camera", name},
            {"format", imported.format},
            {"model", lens_model_name(camera.model)},
            {"width", camera.width},
            {"height", camera.height},
            {"fx", camera.fx},
            {"fy", camera.fy},
            {"cx", camera.cx},
            {"cy", camera.cy},
            {"distortion", camera.coefficients()},
            {"field_of_view_degrees", field_of_view(camera)},
            {"corner_distortion_pixels", corner_shifts(camera)},
            {"depth_units_per_metre",
             camera.depth_units_per_metre > 0.0 ? Json(camera.depth_units_per_metre) : Json()},
            {"fps", camera.fps},
            {"T_body_camera", rows_of(camera.T_body_camera)},
            {"mount_degrees", {angles.x(), angles.y(), angles.z()}}};
  json["depth_noise"] = camera.depth_noise ? Json{{"constant", camera.depth_noise->constant},
                                                  {"growth", camera.depth_noise->growth}}
                                           : Json();
  json["imu"] = camera.imu ? Json{{"T_camera_imu", rows_of(camera.imu->T_camera_imu)},
                                  {"gyroscope_noise", camera.imu->gyroscope_noise},
                                  {"gyroscope_walk", camera.imu->gyroscope_walk}}
                           : Json();
  json["notes"] = imported.notes;
  return json;
}

std::string lens_in_words(const Camera& camera) {
  std::ostringstream text;
  const auto k = camera.coefficients();
  if (camera.model == LensModel::kFisheye)
    text << "fisheye (equidistant), k1 k2 k3 k4:";
  else if (!camera.has_distortion())
    return "pinhole without distortion";
  else
    text << "pinhole, "
         << (k.size() == 5 ? "radial and tangential, k1 k2 p1 p2 k3:" : "rational, k1 k2 p1 p2 k3 k4 k5 k6:");
  for (const double value : k) text << " " << value;
  return text.str();
}

void print(const Json& json, const Camera& camera) {
  std::ostringstream text;
  const auto degrees = [](const Json& value) { return std::round(10.0 * value.get<double>()) / 10.0; };
  const Json& view = json["field_of_view_degrees"];
  text << "camera: " << json["camera"].get<std::string>() << ", " << json["format"].get<std::string>()
       << "\nimages: " << camera.width << " x " << camera.height << " pixels, " << camera.fps
       << " a second\nlens: " << lens_in_words(camera) << "\nfocal length: " << camera.fx << " " << camera.fy
       << " pixels\nprincipal point: " << camera.cx << " " << camera.cy
       << "\nfield of view: " << degrees(view["horizontal"]) << " x " << degrees(view["vertical"])
       << " degrees, " << degrees(view["diagonal"]) << " diagonal\ndistortion at the corners:";
  for (const Json& shift : json["corner_distortion_pixels"])
    shift.is_null() ? text << " -" : text << " " << degrees(shift);
  text << " pixels (top left, top right, bottom left, bottom right)\ndepth: ";
  camera.depth_units_per_metre > 0.0 ? text << camera.depth_units_per_metre << " units per metre"
                                     : text << "units not set";
  if (camera.depth_noise)
    text << ", noise " << camera.depth_noise->constant << " m + " << camera.depth_noise->growth << " z^2/m";
  const Eigen::Vector3d at = camera.T_body_camera.translation();
  const auto& angles = json["mount_degrees"];
  text << "\nmount: at " << at.x() << " " << at.y() << " " << at.z() << " m of the body, roll "
       << degrees(angles[0]) + 0.0 << ", pitch " << degrees(angles[1]) + 0.0 << ", yaw "
       << degrees(angles[2]) + 0.0 << " degrees\ninertial unit: ";
  if (camera.imu) {
    const Eigen::Vector3d unit = camera.imu->T_camera_imu.translation();
    text << "at " << unit.x() << " " << unit.y() << " " << unit.z() << " m of the camera, gyroscope noise "
         << camera.imu->gyroscope_noise << " rad/s/sqrt(Hz), walk " << camera.imu->gyroscope_walk
         << " rad/s^2/sqrt(Hz)\n";
  } else {
    text << "none\n";
  }
  for (const Json& note : json["notes"]) text << "note: " << note.get<std::string>() << "\n";
  std::cout << text.str();
}

void show(const CameraArguments& arguments) {
  const ImportedCamera imported = camera_of(arguments);
  const Json json = describe(imported, arguments.camera);
  if (arguments.json)
    std::cout << json.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  else
    print(json, imported.camera);
  require_written_output();
}

std::string written(const Camera& camera, const std::string& format) {
  if (format == "ros") return camera_to_ros(camera);
  if (format == "kalibr") return camera_to_kalibr(camera);
  return format == "opencv" ? camera_to_opencv(camera) : camera_to_yaml(camera);
}

void convert(const CameraArguments& arguments) {
  const ImportedCamera imported = camera_of(arguments);
  std::string text;
  try {
    text = written(imported.camera, arguments.format);
  } catch (const InputError& error) {
    throw InputError(arguments.camera + ": " + error.what());
  }
  for (const std::string& note : imported.notes) std::cerr << "note: " << note << "\n";
  if (!arguments.out.empty()) return write_file(arguments.out, text);
  std::cout << text;
  require_written_output();
}

// The argument and options that both commands have.
void add_camera(CLI::App& command, CameraArguments& arguments) {
  command
      .add_option(
          "CAMERA", arguments.camera,
          "A preset or a camera file: of RO-SLAM, Kalibr, ROS (camera_info), ASL/EuRoC (sensor.yaml), "
          "OpenCV or ORB-SLAM; FILE#cam1 is the second camera of a file with several")
      ->required();
  command.add_option("--size", arguments.size,
                     "WIDTHxHEIGHT of the images, for a file that does not tell it");
  command
      .add_option("--depth-units", arguments.depth_units,
                  "Value of a 16-bit depth image at one metre, for a file that does not tell it: 1000 for "
                  "millimetres, 5000 for TUM RGB-D")
      ->check(CLI::PositiveNumber);
}

void add_show_command(CLI::App& camera) {
  const auto arguments = std::make_shared<CameraArguments>();
  CLI::App* command = camera.add_subcommand("show", "Print how a camera is understood");
  command->footer(
      "Example:\n"
      "  roslam camera show camchain-imucam.yaml#cam1\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage.");
  add_camera(*command, *arguments);
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout");
  command->callback([arguments] { show(*arguments); });
}

void add_convert_command(CLI::App& camera) {
  const auto arguments = std::make_shared<CameraArguments>();
  CLI::App* command = camera.add_subcommand("convert", "Convert a camera file to another format");
  command->footer(
      "Example:\n"
      "  roslam camera convert camera_info.yaml --depth-units 1000 --out camera.yaml\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage.");
  add_camera(*command, *arguments);
  command->add_option("--out", arguments->out, "File to write; default stdout")
      ->check(ReplacesOnly({"model:", "image_width:", "cam0:", "%YAML:1.0"}));
  command->add_option("--to", arguments->format, "Format: roslam, ros, kalibr or opencv")
      ->check(CLI::IsMember({"roslam", "ros", "kalibr", "opencv"}))
      ->capture_default_str();
  command->callback([arguments] { convert(*arguments); });
}
}  // namespace

void add_camera_command(CLI::App& program) {
  CLI::App* camera =
      program.add_subcommand("camera", "Show, convert and check camera files, list connected cameras");
  camera->require_subcommand(1);
  add_show_command(*camera);
  add_convert_command(*camera);
  add_camera_check_command(*camera);
  add_camera_list_command(*camera);
}

}  // namespace roslam::app
