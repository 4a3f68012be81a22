// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <charconv>
#include <set>

#include "roslam/common/error.hpp"
#include "roslam/geometry/camera_formats.hpp"
#include "roslam/geometry/camera_import.hpp"

namespace roslam {

namespace {
constexpr const char* kNoUnits = "none";

class CameraFile {
 public:
  CameraFile(const std::filesystem::path& path, const YAML::Node& node) : path_(path), node_(node) {}

  template <typename T>
  T get(const std::string& key) const {
    if (!node_[key]) throw InputError(path_.string() + ": camera file has no '" + key + "'; add it");
    try {
      return node_[key].as<T>();
    } catch (const YAML::Exception&) {
      throw InputError(path_.string() + ": '" + key + "' has a value of the wrong type");
    }
  }

  template <typename T>
  T get(const std::string& key, T otherwise) const {
    return node_[key] ? get<T>(key) : otherwise;
  }

 private:
  std::filesystem::path path_;
  YAML::Node node_;
};

void reject_unknown_keys(const std::filesystem::path& path, const YAML::Node& node) {
  const std::set<std::string> known{
      "model",       "width", "height",        "fx",      "fy",
      "cx",          "cy",    "distortion",    "fps",     "depth_units_per_metre",
      "depth_noise", "imu",   "T_body_camera", "baseline"};
  std::set<std::string> seen;
  for (const auto& entry : node) {
    if (!entry.first.IsScalar())
      throw InputError(path.string() + ": a key must be a word; write 'key: value' lines");
    const std::string& key = entry.first.Scalar();
    // YAML parsers silently take one of two equal keys.
    if (!seen.insert(key).second)
      throw InputError(path.string() + ": '" + key + "' is given twice; remove one");
    if (!known.contains(key)) {
      throw InputError(path.string() + ": unknown key '" + key + "'; known: model width height fx fy cx cy " +
                       "distortion depth_units_per_metre fps depth_noise imu T_body_camera baseline");
    }
  }
}

DepthNoise depth_noise_of(const std::filesystem::path& path, const YAML::Node& node) {
  const bool has_both = node.IsMap() && node.size() == 2 && node["constant"] && node["growth"];
  if (!has_both)
    throw InputError(path.string() + ": depth_noise must be {constant: METRES, growth: PER_METRE}");
  const CameraFile read(path, node);
  return {read.get<double>("constant"), read.get<double>("growth")};
}

// A rigid transform as 16 numbers, row by row. name: of the key, for messages.
SE3 transform_of(const std::filesystem::path& path, const std::string& name,
                 const std::vector<double>& values) {
  if (const auto transform = rigid_transform(values)) return *transform;
  throw CalibrationError(path.string() + ": " + name +
                         " is no rigid transform; give the 4x4 matrix row by row, whose last row is 0 0 0 1");
}

// 0 where the camera has none ("none"), such as that of a recording without depth.
double depth_units_of(const std::filesystem::path& path, const YAML::Node& node) {
  const CameraFile read(path, node);
  if (read.get<std::string>("depth_units_per_metre") == kNoUnits) return 0.0;
  const auto units = read.get<double>("depth_units_per_metre");
  if (units == 0.0) {
    throw CalibrationError(path.string() + ": depth_units_per_metre must not be 0; " +
                           std::string(usual_depth_units()) + "; none for a camera without depth images");
  }
  return units;
}

// With all digits it needs to be read as the same number, and no more.
std::string exact(double value) {
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

template <typename Numbers>
std::vector<std::string> exact_all(const Numbers& values) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(exact(value));
  return texts;
}

void write_transform(YAML::Emitter& out, const char* key, const SE3& transform) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T = transform.matrix();
  out << YAML::Key << key << YAML::Value << YAML::Flow
      << exact_all(std::vector<double>(T.data(), T.data() + T.size()));
}

ImuCalibration imu_of(const std::filesystem::path& path, const YAML::Node& node) {
  const std::string form =
      ": imu must be {T_camera_imu: [16 numbers], gyroscope_noise: RAD/S/SQRT(HZ), "
      "gyroscope_walk: RAD/S^2/SQRT(HZ)}";
  if (!node.IsMap()) throw InputError(path.string() + form);
  ImuCalibration imu;
  for (const auto& entry : node) {
    const auto key = entry.first.as<std::string>("");
    if (key != "T_camera_imu" && key != "gyroscope_noise" && key != "gyroscope_walk")
      throw InputError(path.string() + form + ", and has '" + key + "'");
  }
  const CameraFile read(path, node);
  imu.T_camera_imu = transform_of(path, "imu.T_camera_imu", read.get<std::vector<double>>("T_camera_imu"));
  imu.gyroscope_noise = read.get<double>("gyroscope_noise", imu.gyroscope_noise);
  imu.gyroscope_walk = read.get<double>("gyroscope_walk", imu.gyroscope_walk);
  return imu;
}

void write(YAML::Emitter& out, const ImuCalibration& imu) {
  out << YAML::Key << "imu" << YAML::Value << YAML::BeginMap;
  write_transform(out, "T_camera_imu", imu.T_camera_imu);
  out << YAML::Key << "gyroscope_noise" << YAML::Value << exact(imu.gyroscope_noise);
  out << YAML::Key << "gyroscope_walk" << YAML::Value << exact(imu.gyroscope_walk);
  out << YAML::EndMap;
}
}  // namespace

Camera read_own(const std::filesystem::path& file, const YAML::Node& node) {
  if (!node.IsMap()) throw InputError(file.string() + ": a camera file holds 'key: value' lines");
  reject_unknown_keys(file, node);
  const CameraFile read(file, node);
  Camera camera;
  camera.width = read.get<int>("width");
  camera.height = read.get<int>("height");
  camera.fx = read.get<double>("fx");
  camera.fy = read.get<double>("fy");
  camera.cx = read.get<double>("cx");
  camera.cy = read.get<double>("cy");
  try {
    camera.set_lens(read.get<std::string>("model", "pinhole"),
                    read.get<std::vector<double>>("distortion", {}));
  } catch (const InputError& error) {
    throw InputError(file.string() + ": " + error.what());
  }
  camera.baseline = read.get<double>("baseline", camera.baseline);
  // No default: a wrong one would scale the whole map.
  if (!node["depth_units_per_metre"] && !camera.is_stereo()) {
    throw InputError(file.string() + ": camera file has no 'depth_units_per_metre'; add it: " +
                     std::string(usual_depth_units()));
  }
  if (node["depth_units_per_metre"]) camera.depth_units_per_metre = depth_units_of(file, node);
  camera.fps = read.get<double>("fps", camera.fps);
  if (node["depth_noise"]) camera.depth_noise = depth_noise_of(file, node["depth_noise"]);
  if (node["imu"]) camera.imu = imu_of(file, node["imu"]);
  if (node["T_body_camera"])
    camera.T_body_camera =
        transform_of(file, "T_body_camera", read.get<std::vector<double>>("T_body_camera"));
  try {
    camera.validate();
  } catch (const CalibrationError& error) {
    throw CalibrationError(file.string() + ": " + error.what());
  }
  return camera;
}

Camera camera_from_yaml(const std::string& text, const std::string& name) {
  YAML::Node node;
  try {
    node = YAML::Load(text);
  } catch (const YAML::Exception&) {
    throw InputError(name + ": is no YAML");
  }
  return read_own(name, node);
}

std::string camera_to_yaml(const Camera& camera) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  out << YAML::Key << "model" << YAML::Value << std::string(lens_model_name(camera.model));
  out << YAML::Key << "width" << YAML::Value << camera.width;
  out << YAML::Key << "height" << YAML::Value << camera.height;
  out << YAML::Key << "fx" << YAML::Value << exact(camera.fx);
  out << YAML::Key << "fy" << YAML::Value << exact(camera.fy);
  out << YAML::Key << "cx" << YAML::Value << exact(camera.cx);
  out << YAML::Key << "cy" << YAML::Value << exact(camera.cy);
  out << YAML::Key << "distortion" << YAML::Value << YAML::Flow << exact_all(camera.coefficients());
  out << YAML::Key << "depth_units_per_metre" << YAML::Value;
  out << (camera.depth_units_per_metre > 0.0 ? exact(camera.depth_units_per_metre) : kNoUnits);
  out << YAML::Key << "fps" << YAML::Value << exact(camera.fps);
  if (camera.is_stereo()) out << YAML::Key << "baseline" << YAML::Value << exact(camera.baseline);
  if (camera.depth_noise) {
    out << YAML::Key << "depth_noise" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
        << "constant" << YAML::Value << exact(camera.depth_noise->constant) << YAML::Key << "growth"
        << YAML::Value << exact(camera.depth_noise->growth) << YAML::EndMap;
  }
  if (camera.imu) write(out, *camera.imu);
  if (camera.T_body_camera != forward_camera()) write_transform(out, "T_body_camera", camera.T_body_camera);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace roslam
