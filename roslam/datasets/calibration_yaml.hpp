// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "roslam/geometry/camera.hpp"

namespace roslam::datasets {

/// A file of calibration in YAML. Throws InputError naming file and key where a value is missing or
/// malformed.
class CalibrationYaml {
 public:
  /// remedy: what to do if the file is missing. Throws InputError if it is, or is larger than 1 MB.
  CalibrationYaml(const std::filesystem::path& file, const std::string& remedy);

  const YAML::Node& root() const { return root_; }

  double number(const YAML::Node& node, const std::string& key) const;
  int integer(const YAML::Node& node, const std::string& key) const;
  std::string text(const YAML::Node& node, const std::string& key) const;

  /// A list of count numbers: [a, b, ...], or a matrix as OpenCV writes it, whose data are taken.
  std::vector<double> numbers(const YAML::Node& node, const std::string& key, std::size_t count) const;

  /// As numbers(), of a 4x4 matrix that must be a rigid transform.
  SE3 transform(const YAML::Node& node, const std::string& key) const;

  /// The lens of a camera: the coefficients of the model "radial-tangential" or "equidistant"; none if it is
  /// absent.
  void set_lens(const YAML::Node& node, const std::string& model_key, const std::string& key,
                Camera& camera) const;

 private:
  [[noreturn]] void fail(const std::string& what) const;
  std::vector<double> list(const YAML::Node& node, const std::string& key) const;

  std::filesystem::path file_;
  YAML::Node root_;
};

}  // namespace roslam::datasets
