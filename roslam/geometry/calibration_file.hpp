// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Reads a YAML file, also with the deviations of OpenCV's FileStorage ("%YAML:1.0"), or an XML file of
/// OpenCV as the same nodes. Throws InputError naming the file; if_missing: the message if it cannot be
/// opened.
ROSLAM_EXPORT YAML::Node load_calibration(const std::filesystem::path& file, const std::string& if_missing);

/// The content of an XML file of OpenCV's FileStorage as nodes: elements by name, lists of elements "_" as
/// sequences, text as scalars. name: of the file, for messages. Throws InputError.
YAML::Node nodes_of_xml(const std::string& text, const std::string& name);

/// A part of a calibration file: reads values by key. Each function throws InputError that names the file,
/// its format and the key.
class ROSLAM_EXPORT CalibrationPart {
 public:
  /// name: of the file; format: in words, or empty; both for messages. where: the keys above, for messages.
  CalibrationPart(std::string name, std::string format, YAML::Node node, std::string where = {});

  bool has(const std::string& key) const;
  CalibrationPart part(const std::string& key) const;
  std::string text(const std::string& key, const std::optional<std::string>& otherwise = {}) const;
  double number(const std::string& key, const std::optional<double>& otherwise = {}) const;

  /// A whole number of pixels.
  int pixels(const std::string& key) const;

  /// A list of at most 64 numbers: a sequence, its rows as sequences, text, or a matrix with the key data.
  std::vector<double> numbers(const std::string& key) const;

  /// The same; fails unless it has so many.
  std::vector<double> numbers(const std::string& key, std::size_t count) const;

  /// A rigid transform as a matrix 4x4, row by row.
  SE3 transform(const std::string& key) const;

  /// The first of these keys that there is; fails naming the first if there is none.
  std::string key_of(const std::vector<std::string>& keys) const;

  const YAML::Node& node() const { return node_; }
  const std::string& format() const { return format_; }
  const std::string& name() const { return name_; }

  [[noreturn]] void fail(const std::string& why) const;

 private:
  std::string name_, format_;
  YAML::Node node_;
  std::string where_;
};

/// A matrix as a rigid transform; nothing if it is none, to 0.01, as files state few decimals.
ROSLAM_EXPORT std::optional<SE3> rigid_transform(const Eigen::Matrix4d& matrix);

/// The same of 16 numbers, row by row.
ROSLAM_EXPORT std::optional<SE3> rigid_transform(const std::vector<double>& values);

}  // namespace roslam
