// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/calibration_file.hpp"

#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::uintmax_t kMaxBytes = 1 << 20U;  // of a calibration file

std::string content_of(const std::filesystem::path& file, const std::string& if_missing) {
  if (std::filesystem::is_directory(file))
    throw InputError(file.string() + ": is a folder; give a YAML file");
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file.string() + ": " + if_missing);
  std::string text(kMaxBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kMaxBytes)
    throw InputError(file.string() + ": is larger than a camera file can be (1 MB); give another file");
  return text;
}

// OpenCV writes YAML 1.0, where the header has a colon and a list may follow its key without a blank.
std::string as_yaml(std::string text) {
  constexpr std::string_view kHeader = "%YAML";
  if (!text.starts_with(kHeader)) return text;
  text.erase(0, std::min(text.find('\n'), text.size()));
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    result += text[i];
    if (text[i] == ':' && i + 1 < text.size() && text[i + 1] == '[') result += ' ';
  }
  return result;
}

std::optional<double> number_of(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// Appends the numbers of a scalar, separated by white space or commas. False if something else is in it.
bool append_numbers(const std::string& text, std::vector<double>& numbers) {
  constexpr std::string_view kSeparators = " \t\r\n,";
  std::size_t at = 0;
  while ((at = text.find_first_not_of(kSeparators, at)) != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, at), text.size());
    const auto number = number_of(std::string_view(text).substr(at, end - at));
    if (!number) return false;
    numbers.push_back(*number);
    at = end;
  }
  return true;
}

// depth: how many sequences may be within each other.
bool append_numbers(const YAML::Node& node, int depth, std::vector<double>& numbers) {
  constexpr std::size_t kMost = 64;
  if (node.IsScalar()) return append_numbers(node.Scalar(), numbers) && numbers.size() <= kMost;
  if (!node.IsSequence() || depth == 0 || node.size() > kMost) return false;
  for (const auto& item : node)
    if (!append_numbers(item, depth - 1, numbers)) return false;
  return true;
}
}  // namespace

YAML::Node load_calibration(const std::filesystem::path& file, const std::string& if_missing) {
  const std::string text = content_of(file, if_missing);
  if (text.starts_with("<?xml") || text.starts_with("<opencv_storage"))
    return nodes_of_xml(text, file.string());
  try {
    return YAML::Load(as_yaml(text));
  } catch (const std::exception& error) {
    throw InputError(file.string() + ": not a valid YAML file: " + error.what());
  }
}

std::optional<SE3> rigid_transform(const Eigen::Matrix4d& matrix) {
  constexpr double kRounding = 1e-2;
  if (!matrix.allFinite()) return std::nullopt;
  const Eigen::Matrix3d R = matrix.topLeftCorner<3, 3>();
  const bool is_rigid = (R * R.transpose()).isIdentity(kRounding) && R.determinant() > 0.0 &&
                        matrix.row(3).isApprox(Eigen::RowVector4d::Unit(3), kRounding);
  if (!is_rigid) return std::nullopt;
  return SE3(R, matrix.topRightCorner<3, 1>());
}

std::optional<SE3> rigid_transform(const std::vector<double>& values) {
  if (values.size() != 16) return std::nullopt;
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(values.data());
  return rigid_transform(Eigen::Matrix4d(matrix));
}

CalibrationPart::CalibrationPart(std::string name, std::string format, YAML::Node node, std::string where)
    : name_(std::move(name)), format_(std::move(format)), node_(std::move(node)), where_(std::move(where)) {}

void CalibrationPart::fail(const std::string& why) const {
  throw InputError(name_ + ": " + (format_.empty() ? "" : "recognised as " + format_ + ": ") +
                   (where_.empty() ? "" : where_ + " ") + why);
}

bool CalibrationPart::has(const std::string& key) const {
  return node_.IsMap() && node_[key] && !node_[key].IsNull();
}

CalibrationPart CalibrationPart::part(const std::string& key) const {
  if (!has(key)) fail("has no '" + key + "'");
  if (!node_[key].IsMap()) fail("has no values within '" + key + "'");
  return {name_, format_, node_[key], where_.empty() ? key : where_ + "." + key};
}

std::string CalibrationPart::text(const std::string& key, const std::optional<std::string>& otherwise) const {
  if (!has(key)) return otherwise ? *otherwise : (fail("has no '" + key + "'"), "");
  if (!node_[key].IsScalar()) fail("has no text in '" + key + "'");
  return node_[key].Scalar();
}

double CalibrationPart::number(const std::string& key, const std::optional<double>& otherwise) const {
  if (!has(key) && otherwise) return *otherwise;
  const auto value = number_of(text(key));
  if (!value) fail("has no number in '" + key + "'");
  return *value;
}

int CalibrationPart::pixels(const std::string& key) const {
  constexpr double kMost = 1e6;
  const double value = number(key);
  if (!(value > 0.0 && value < kMost && value == std::floor(value)))
    fail("has no size in pixels in '" + key + "'");
  return static_cast<int>(value);
}

std::vector<double> CalibrationPart::numbers(const std::string& key) const {
  if (!has(key)) fail("has no '" + key + "'");
  const YAML::Node value = node_[key];
  const bool is_matrix = value.IsMap() && value["data"];
  std::vector<double> result;
  if (!append_numbers(is_matrix ? value["data"] : value, 2, result))
    fail("has no list of numbers in '" + key + "'");
  return result;
}

std::vector<double> CalibrationPart::numbers(const std::string& key, std::size_t count) const {
  auto result = numbers(key);
  if (result.size() != count)
    fail("has " + std::to_string(result.size()) + " numbers in '" + key + "', not " + std::to_string(count));
  return result;
}

SE3 CalibrationPart::transform(const std::string& key) const {
  const auto result = rigid_transform(numbers(key));
  if (!result)
    fail("has no rigid transform in '" + key + "', a 4x4 matrix row by row whose last row is 0 0 0 1");
  return *result;
}

std::string CalibrationPart::key_of(const std::vector<std::string>& keys) const {
  for (const std::string& key : keys)
    if (has(key)) return key;
  fail("has no '" + keys.front() + "'");
}

}  // namespace roslam
