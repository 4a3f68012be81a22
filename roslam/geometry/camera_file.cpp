// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <numbers>
#include <set>

#include "roslam/common/error.hpp"
#include "roslam/common/yaml_file.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam {

namespace {
std::map<std::string, Camera, std::less<>> presets() {
  const auto make = [](double fx, double fy, double cx, double cy, std::array<double, 5> distortion,
                       double units, DepthNoise noise) {
    return Camera{640, 480, fx, fy, cx, cy, distortion, units, 30.0, noise, {}, forward_camera()};
  };
  // TUM: calibration published with the RGB-D benchmark. RealSense: typical factory values of the colour
  // stream at 640x480 with depth aligned to colour; calibrate your own camera for the best accuracy. Depth
  // noise: as DepthNoiseEstimator finds it in recordings of these cameras; d455: of its baseline of 95 mm.
  constexpr DepthNoise kKinect{0.0005, 0.0026};
  std::map<std::string, Camera, std::less<>> all{
      {"tum-fr1",
       make(517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}, 5000, kKinect)},
      {"tum-fr2",
       make(520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}, 5000, kKinect)},
      {"tum-fr3", make(535.4, 539.2, 320.1, 247.6, {}, 5000, kKinect)},
      {"7scenes", make(525.0, 525.0, 320.0, 240.0, {}, 1000, {0.0007, 0.0015})},
      {"d435", make(615.0, 615.0, 320.0, 240.0, {}, 1000, {0.0005, 0.0066})},
      {"d455", make(385.0, 385.0, 320.0, 240.0, {}, 1000, {0.0005, 0.0022})},
      {"simulated", make(385.0, 385.0, 319.5, 239.5, {}, 1000, {0.0005, 0.0022})},
  };
  all.at("simulated").T_body_camera = mounted_camera({0, 0, 0, 0, 0.26 * 180.0 / std::numbers::pi, 0});
  return all;
}

std::string joined(const std::vector<std::string>& names) {
  std::string all;
  for (const auto& name : names) all += (all.empty() ? "" : " ") + name;
  return all;
}

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
  const std::set<std::string> known{"model",       "width", "height",       "fx",  "fy",
                                    "cx",          "cy",    "distortion",   "fps", "depth_units_per_metre",
                                    "depth_noise", "imu",   "T_body_camera"};
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
                       "distortion depth_units_per_metre fps depth_noise imu T_body_camera");
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
  constexpr double kRounding = 1e-3;
  if (values.size() == 16) {
    const Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
    const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
    const bool is_rigid = T.allFinite() && (R * R.transpose()).isIdentity(kRounding) &&
                          R.determinant() > 0.0 && T.row(3).isApprox(Eigen::RowVector4d::Unit(3));
    if (is_rigid) return {R, T.topRightCorner<3, 1>()};
  }
  throw CalibrationError(path.string() + ": " + name +
                         " is no rigid transform; give the 4x4 matrix row by row, whose last row is 0 0 0 1");
}

void write_transform(YAML::Emitter& out, const char* key, const SE3& transform) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T = transform.matrix();
  out << YAML::Key << key << YAML::Value << YAML::Flow << std::vector<double>(T.data(), T.data() + T.size());
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
  out << YAML::Key << "gyroscope_noise" << YAML::Value << imu.gyroscope_noise;
  out << YAML::Key << "gyroscope_walk" << YAML::Value << imu.gyroscope_walk;
  out << YAML::EndMap;
}
}  // namespace

std::vector<std::string> camera_preset_names() {
  std::vector<std::string> names;
  for (const auto& [name, camera] : presets()) names.push_back(name);
  return names;
}

std::optional<Camera> camera_preset(std::string_view name) {
  const auto all = presets();
  const auto found = all.find(name);
  return found == all.end() ? std::nullopt : std::make_optional(found->second);
}

Camera read_camera(const std::filesystem::path& file) {
  const YAML::Node node = load_yaml(file, "cannot open the camera file; give a YAML file or a preset (" +
                                              joined(camera_preset_names()) + ")");
  if (!node.IsMap()) throw InputError(file.string() + ": a camera file holds 'key: value' lines");
  reject_unknown_keys(file, node);
  const CameraFile read(file, node);
  if (const auto model = read.get<std::string>("model", "pinhole"); model != "pinhole") {
    throw InputError(file.string() + ": camera model '" + model + "' is not supported; use pinhole");
  }
  Camera camera;
  camera.width = read.get<int>("width");
  camera.height = read.get<int>("height");
  camera.fx = read.get<double>("fx");
  camera.fy = read.get<double>("fy");
  camera.cx = read.get<double>("cx");
  camera.cy = read.get<double>("cy");
  const auto coefficients = read.get<std::vector<double>>("distortion", {});
  // Three could be k1 k2 p1 as well as k1 k2 k3.
  if (const std::size_t n = coefficients.size(); n != 0 && n != 2 && n != 4 && n != 5) {
    throw InputError(file.string() + ": distortion has " + std::to_string(n) +
                     " values; give k1 k2 p1 p2 k3, with 0 for those that are not known");
  }
  std::copy(coefficients.begin(), coefficients.end(), camera.distortion.begin());
  // No default: a wrong one would scale the whole map.
  if (!node["depth_units_per_metre"]) {
    throw InputError(file.string() + ": camera file has no 'depth_units_per_metre'; add it: " +
                     std::string(usual_depth_units()));
  }
  camera.depth_units_per_metre = read.get<double>("depth_units_per_metre");
  if (camera.depth_units_per_metre == 0.0) {
    throw CalibrationError(file.string() + ": depth_units_per_metre must not be 0; " +
                           std::string(usual_depth_units()));
  }
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

Camera load_camera(const std::string& preset_or_file) {
  if (const auto preset = camera_preset(preset_or_file)) return *preset;
  return read_camera(preset_or_file);
}

std::string camera_to_yaml(const Camera& camera) {
  YAML::Emitter out;
  out.SetDoublePrecision(12);
  out << YAML::BeginMap;
  out << YAML::Key << "model" << YAML::Value << "pinhole";
  out << YAML::Key << "width" << YAML::Value << camera.width;
  out << YAML::Key << "height" << YAML::Value << camera.height;
  out << YAML::Key << "fx" << YAML::Value << camera.fx;
  out << YAML::Key << "fy" << YAML::Value << camera.fy;
  out << YAML::Key << "cx" << YAML::Value << camera.cx;
  out << YAML::Key << "cy" << YAML::Value << camera.cy;
  out << YAML::Key << "distortion" << YAML::Value << YAML::Flow
      << std::vector<double>(camera.distortion.begin(), camera.distortion.end());
  out << YAML::Key << "depth_units_per_metre" << YAML::Value << camera.depth_units_per_metre;
  out << YAML::Key << "fps" << YAML::Value << camera.fps;
  if (camera.depth_noise) {
    out << YAML::Key << "depth_noise" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
        << "constant" << YAML::Value << camera.depth_noise->constant << YAML::Key << "growth" << YAML::Value
        << camera.depth_noise->growth << YAML::EndMap;
  }
  if (camera.imu) write(out, *camera.imu);
  if (camera.T_body_camera != forward_camera()) write_transform(out, "T_body_camera", camera.T_body_camera);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace roslam
