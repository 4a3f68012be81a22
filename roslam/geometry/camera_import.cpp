// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/camera_import.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "roslam/common/error.hpp"
#include "roslam/geometry/camera_formats.hpp"

namespace roslam {

namespace {
namespace fs = std::filesystem;

// "cam0", "cam1" and so on, up to "cam99".
std::optional<int> camera_number(std::string_view name) {
  constexpr std::string_view kBegin = "cam";
  if (!name.starts_with(kBegin)) return std::nullopt;
  const std::string_view digits = name.substr(kBegin.size());
  const bool is_number =
      !digits.empty() && digits.size() <= 2 &&
      std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  return is_number ? std::make_optional(std::stoi(std::string(digits))) : std::nullopt;
}

struct Choice {
  fs::path file;
  std::optional<int> number;
};

// Takes "FILE#cam1" apart, unless there is a file of that name.
Choice choice_of(const std::string& name) {
  const std::size_t at = name.rfind('#');
  std::error_code error;
  if (at == std::string::npos || fs::exists(name, error)) return {name, {}};
  const std::string camera = name.substr(at + 1);
  const auto number = camera_number(camera);
  if (!number)
    throw InputError(name + ": '" + camera +
                     "' is no camera of a file; write FILE#cam0, FILE#cam1 and so on");
  return {name.substr(0, at), number};
}

enum class Format { kOwn, kKalibr, kAsl, kRos, kOpenCv, kOrbSlam };

std::string in_words(Format format) {
  switch (format) {
    case Format::kOwn:
      return "a camera file of RO-SLAM";
    case Format::kKalibr:
      return "a Kalibr camera chain";
    case Format::kAsl:
      return "an ASL (EuRoC) sensor.yaml";
    case Format::kRos:
      return "a ROS camera_info";
    case Format::kOpenCv:
      return "an OpenCV calibration";
    case Format::kOrbSlam:
      return "ORB-SLAM settings";
  }
  return {};
}

Format format_of(const YAML::Node& node) {
  if (!node.IsMap()) return Format::kOwn;
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) return Format::kOwn;
    const std::string& key = entry.first.Scalar();
    if (camera_number(key) && entry.second.IsMap()) return Format::kKalibr;
    if (key.starts_with("Camera.") || key.starts_with("Camera1.")) return Format::kOrbSlam;
    if (key == "sensor_type" || key == "T_BS") return Format::kAsl;
  }
  if (node["distortion_model"]) return Format::kRos;
  for (const char* key : {"camera_matrix", "Camera_Matrix", "cameraMatrix", "camera_Matrix", "K", "M1"})
    if (node[key]) return Format::kOpenCv;
  return Format::kOwn;
}

ImportedCamera read_foreign(const CalibrationPart& file, Format format, std::optional<int> number) {
  const bool has_one = format == Format::kAsl || format == Format::kRos;
  if (has_one && number.value_or(0) > 0)
    file.fail("has one camera only; leave out #cam" + std::to_string(*number));
  switch (format) {
    case Format::kKalibr:
      return read_kalibr(file, number.value_or(0));
    case Format::kAsl:
      return read_asl(file);
    case Format::kOrbSlam:
      return read_orb_slam(file, number.value_or(0));
    default:
      return read_opencv(file, number.value_or(0));
  }
}

void set_image_size(Camera& camera, const CalibrationPart& file,
                    const std::optional<std::array<int, 2>>& image_size) {
  const bool has_size = camera.width > 0 && camera.height > 0;
  if (!has_size && !image_size) {
    file.fail("does not tell the size of the images; give it: roslam camera convert " + file.name() +
              " --size WIDTHxHEIGHT --out camera.yaml");
  }
  if (has_size && image_size && *image_size != std::array{camera.width, camera.height}) {
    file.fail("is of images of " + std::to_string(camera.width) + "x" + std::to_string(camera.height) +
              ", not " + std::to_string((*image_size)[0]) + "x" + std::to_string((*image_size)[1]) +
              "; a calibration holds for one size");
  }
  if (image_size) std::tie(camera.width, camera.height) = std::tuple_cat(*image_size);
}

ImportedCamera read_any(const Choice& choice, const std::optional<std::array<int, 2>>& image_size) {
  std::string presets;
  for (const auto& name : camera_preset_names()) presets += (presets.empty() ? "" : " ") + name;
  const YAML::Node node = load_calibration(
      choice.file, "cannot open the camera file; give a YAML file or a preset (" + presets + ")");
  const Format format = format_of(node);
  const CalibrationPart file(choice.file.string(), in_words(format), node);
  if (format == Format::kOwn) {
    if (choice.number.value_or(0) > 0)
      file.fail("has one camera only; leave out #cam" + std::to_string(*choice.number));
    ImportedCamera own{read_own(choice.file, node), file.format(), {}};
    set_image_size(own.camera, file, image_size);
    return own;
  }
  ImportedCamera imported = read_foreign(file, format, choice.number);
  imported.format = file.format();
  set_image_size(imported.camera, file, image_size);
  try {
    imported.camera.validate();
  } catch (const CalibrationError& error) {
    throw CalibrationError(file.name() + ": recognised as " + file.format() + ": " + error.what());
  }
  return imported;
}
}  // namespace

ImportedCamera import_camera(const std::string& preset_or_file,
                             const std::optional<std::array<int, 2>>& image_size) {
  if (const auto preset = camera_preset(preset_or_file)) {
    if (image_size && *image_size != std::array{preset->width, preset->height})
      throw InputError(preset_or_file + ": this preset is of images of " + std::to_string(preset->width) +
                       "x" + std::to_string(preset->height) + "; leave out the size");
    return {*preset, "a preset", {}};
  }
  return read_any(choice_of(preset_or_file), image_size);
}

Camera load_camera(const std::string& preset_or_file) { return import_camera(preset_or_file).camera; }

Camera read_camera(const fs::path& file) { return read_any({file, {}}, {}).camera; }

}  // namespace roslam
