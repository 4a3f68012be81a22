// SPDX-License-Identifier: BSD-3-Clause
#include "recording/odometry_file.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <optional>
#include <span>
#include <string_view>

#include "roslam/common/error.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::recording {

namespace {
constexpr std::size_t kNumbers = 15 + 2 * 21 + 7;  // after the state; none for a frame without a pose

void append(std::string& line, double value, std::chars_format format, int precision) {
  std::array<char, 400> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, format, precision);
  line += ',';
  line.append(digits.data(), end.ptr);
}

void append(std::string& line, const SE3& pose) {
  const auto& p = pose.translation();
  Eigen::Quaterniond q = pose.rotation();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  for (const double value : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()})
    append(line, value, std::chars_format::fixed, 9);
}

void append(std::string& line, const Eigen::Vector3d& vector) {
  for (int k = 0; k < 3; ++k) append(line, vector(k), std::chars_format::fixed, 6);
}

void append_upper_triangle(std::string& line, const Matrix6d& matrix) {
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      append(line, matrix(row, column), std::chars_format::general, 6);
  }
}

// The numbers of a line as they are taken one after the other.
class Numbers {
 public:
  explicit Numbers(std::span<const double> values) : values_(values) {}

  double next() { return values_[at_++]; }

  Eigen::Vector3d vector() {
    const double x = next(), y = next(), z = next();
    return {x, y, z};
  }

  SE3 pose() {
    const Eigen::Vector3d position = vector();
    const double x = next(), y = next(), z = next(), w = next();
    return {Eigen::Quaterniond(w, x, y, z).normalized(), position};
  }

  Matrix6d symmetric() {
    Matrix6d result;
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) result(row, column) = result(column, row) = next();
    }
    return result;
  }

 private:
  std::span<const double> values_;
  std::size_t at_ = 0;
};

// The fields of a line up to the reason, which may hold commas.
std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  while (fields.size() < kNumbers + 2) {
    const std::size_t comma = line.find(',');
    if (comma == std::string_view::npos) return fields;
    fields.push_back(line.substr(0, comma));
    line.remove_prefix(comma + 1);
  }
  return fields;
}

std::optional<double> number_of(std::string_view field) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::optional<Odometry> odometry_of(const std::vector<std::string_view>& fields) {
  std::array<double, kNumbers> values{};
  for (std::size_t i = 0; i < kNumbers; ++i) {
    const auto value = number_of(fields[i + 2]);
    if (!value) return std::nullopt;
    values[i] = *value;
  }
  const auto timestamp = number_of(fields[0]);
  constexpr double kMostResets = 1e9;
  if (!timestamp || !(values[0] >= 0.0 && values[0] <= kMostResets)) return std::nullopt;
  Numbers numbers(values);
  Odometry result;
  result.timestamp = *timestamp;
  result.resets = static_cast<std::size_t>(numbers.next());
  result.quality = numbers.next();
  result.T_odom_body = numbers.pose();
  result.linear_velocity = numbers.vector();
  result.angular_velocity = numbers.vector();
  result.covariance = numbers.symmetric();
  result.velocity_covariance = numbers.symmetric();
  result.T_map_odom = numbers.pose();
  result.is_predicted = fields[1] == "predicted";
  return result;
}

// Of those that a function words, the one of this text.
template <typename Enum, typename Words>
std::optional<Enum> one_of(std::initializer_list<Enum> all, const Words& words, std::string_view text) {
  for (const Enum one : all)
    if (words(one) == text) return one;
  return std::nullopt;
}

std::optional<TrackingState> state_of(std::string_view text) {
  using enum TrackingState;
  return one_of(
      {kInitialising, kTracking, kPredicted, kRecentlyLost, kLost},
      [](TrackingState state) { return name_of(state); }, text);
}

std::optional<NoPose> reason_of(std::string_view text) {
  using enum NoPose;
  return one_of(
      {kNone, kNoMap, kNotRecognised, kFewLandmarks, kUncertain, kPoorFit, kImplausible},
      [](NoPose reason) { return describe(reason); }, text);
}

std::optional<OdometryRow> row_of(std::string_view line) {
  const auto fields = fields_of(line);
  if (fields.size() != kNumbers + 2) return std::nullopt;
  const auto timestamp = number_of(fields[0]);
  const auto state = state_of(fields[1]);
  if (!timestamp || !state) return std::nullopt;
  OdometryRow row;
  row.timestamp = *timestamp;
  row.state = *state;
  if (fields[2].empty()) {  // a frame without a pose
    row.no_pose = reason_of(line.substr(line.rfind(',') + 1)).value_or(NoPose::kNotRecognised);
    return row;
  }
  row.odometry = odometry_of(fields);
  if (!row.odometry || !row.odometry->T_odom_body.is_finite() || !row.odometry->T_map_odom.is_finite())
    return std::nullopt;
  return row;
}
}  // namespace

std::string odometry_header() {
  std::string header = "#timestamp,state,reset,quality,px,py,pz,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz";
  constexpr std::array<std::string_view, 6> kPose{"px", "py", "pz", "rx", "ry", "rz"};
  constexpr std::array<std::string_view, 6> kVelocity{"vx", "vy", "vz", "wx", "wy", "wz"};
  for (const auto& names : {kPose, kVelocity}) {
    for (std::size_t row = 0; row < names.size(); ++row) {
      for (std::size_t column = row; column < names.size(); ++column)
        header.append(",cov_").append(names[row]).append("_").append(names[column]);
    }
  }
  return header + ",map_px,map_py,map_pz,map_qx,map_qy,map_qz,map_qw,reason\n";
}

std::string odometry_line(const FrameResult& result) {
  std::string line = time_text(result.timestamp);
  line.append(",").append(name_of(result.state));
  if (!result.odometry) {
    line.append(kNumbers, ',').append(",").append(describe(result.no_pose)).append("\n");
    return line;
  }
  const Odometry& odometry = *result.odometry;
  line.append(",").append(std::to_string(odometry.resets));
  append(line, odometry.quality, std::chars_format::fixed, 3);
  append(line, odometry.T_odom_body);
  append(line, odometry.linear_velocity);
  append(line, odometry.angular_velocity);
  append_upper_triangle(line, odometry.covariance);
  append_upper_triangle(line, odometry.velocity_covariance);
  append(line, odometry.T_map_odom);
  line += ",\n";
  return line;
}

std::vector<OdometryRow> read_odometry_rows(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw InputError(file.string() + ": cannot be read; give a folder that roslam run has written");
  std::vector<OdometryRow> result;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    if (in.eof()) break;  // cut off, as by a power cut
    auto row = row_of(line);
    if (!row)
      throw InputError(file.string() + ", line " + std::to_string(number) +
                       ": is no line of odometry.csv as roslam run writes it");
    result.push_back(*std::move(row));
  }
  return result;
}

std::vector<Odometry> read_odometry(const std::filesystem::path& file) {
  std::vector<Odometry> result;
  for (const OdometryRow& row : read_odometry_rows(file))
    if (row.odometry) result.push_back(*row.odometry);
  return result;
}

}  // namespace roslam::recording
