// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/datasets/calibration_yaml.hpp"

#include <algorithm>

#include "roslam/common/error.hpp"
#include "roslam/common/yaml_file.hpp"
#include "roslam/datasets/text_numbers.hpp"

namespace roslam::datasets {

CalibrationYaml::CalibrationYaml(const std::filesystem::path& file, const std::string& remedy) : file_(file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) fail("cannot open it; " + remedy);
  constexpr std::uintmax_t kLargest = 1U << 20U;
  if (std::filesystem::file_size(file, error) > kLargest) fail("is larger than 1 MB; " + remedy);
  root_ = load_yaml(file, "cannot open it; " + remedy);
  if (!root_.IsMap()) fail("holds no 'key: value' lines; " + remedy);
}

void CalibrationYaml::fail(const std::string& what) const { throw InputError(file_.string() + ": " + what); }

double CalibrationYaml::number(const YAML::Node& node, const std::string& key) const {
  try {
    if (node.IsMap() && node[key]) return node[key].as<double>();
  } catch (const YAML::Exception&) {
    fail("'" + key + "' is not a number");
  }
  fail("has no '" + key + "'");
}

int CalibrationYaml::integer(const YAML::Node& node, const std::string& key) const {
  const double value = number(node, key);
  if (!(value >= 0.0 && value <= 1e6)) fail("'" + key + "' is implausible");
  return static_cast<int>(value);
}

std::string CalibrationYaml::text(const YAML::Node& node, const std::string& key) const {
  if (node.IsMap() && node[key] && node[key].IsScalar()) return node[key].Scalar();
  return {};
}

std::vector<double> CalibrationYaml::list(const YAML::Node& node, const std::string& key) const {
  YAML::Node values = node.IsMap() ? node[key] : YAML::Node(YAML::NodeType::Undefined);
  if (values && values.IsMap()) values.reset(YAML::Node(values["data"]));
  if (!values || !values.IsSequence()) fail("has no list '" + key + "'");
  try {
    return values.as<std::vector<double>>();
  } catch (const YAML::Exception&) {
    fail("'" + key + "' is no list of numbers");
  }
}

std::vector<double> CalibrationYaml::numbers(const YAML::Node& node, const std::string& key,
                                             std::size_t count) const {
  auto values = list(node, key);
  if (values.size() != count)
    fail("'" + key + "' has " + std::to_string(values.size()) + " numbers and not " + std::to_string(count));
  return values;
}

SE3 CalibrationYaml::transform(const YAML::Node& node, const std::string& key) const {
  const auto rigid = rigid_transform(matrix_from(numbers(node, key, 16)));
  if (!rigid) fail("'" + key + "' is no rigid transform");
  return *rigid;
}

void CalibrationYaml::set_lens(const YAML::Node& node, const std::string& model_key, const std::string& key,
                               Camera& camera) const {
  const std::string model = text(node, model_key);
  if (model.empty() || model == "none") return;
  const bool is_pinhole = model == "radial-tangential" || model == "radtan";
  if (!is_pinhole && model != "equidistant")
    fail("the distortion model '" + model + "' is not supported; give images without distortion");
  try {
    camera.set_lens(is_pinhole ? "pinhole" : "fisheye", list(node, key));
  } catch (const InputError& error) {
    fail("'" + key + "': " + error.what());
  }
}

}  // namespace roslam::datasets
