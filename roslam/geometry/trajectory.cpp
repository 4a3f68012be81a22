// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/trajectory.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam {

std::string time_text(double timestamp) {
  char text[400];  // the largest double has 309 digits before the point
  std::snprintf(text, sizeof(text), "%.6f", timestamp);
  return text;
}

namespace {
constexpr std::size_t kColumns = 8;
constexpr double kMinQuaternionNorm = 0.9;
constexpr double kMaxQuaternionNorm = 1.1;
constexpr int kTimeDecimals = 6;
constexpr int kPoseDecimals = 9;
// Spaces between numbers; the comma for CSV exports, the carriage return for files from Windows.
constexpr std::string_view kSeparators = " \t\r,\v\f";

using Row = std::array<double, kColumns>;

// std::from_chars, unlike streams, does not depend on the locale and reads "nan" and "inf".
std::optional<double> parse_number(std::string_view word) {
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size()) return std::nullopt;
  // A number out of range is still a number: the pose is unusable, but the line is not malformed.
  if (error == std::errc::result_out_of_range) return std::numeric_limits<double>::quiet_NaN();
  return error == std::errc() ? std::make_optional(value) : std::nullopt;
}

std::optional<Row> parse_row(std::string_view line) {
  Row row{};
  std::size_t columns = 0;
  for (auto begin = line.find_first_not_of(kSeparators); begin != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(kSeparators, begin), line.size());
    const auto value = parse_number(line.substr(begin, end - begin));
    if (!value || columns == kColumns) return std::nullopt;
    row[columns++] = *value;
    begin = line.find_first_not_of(kSeparators, end);
  }
  return columns == kColumns ? std::make_optional(row) : std::nullopt;
}

std::optional<StampedPose> to_pose(const Row& row) {
  if (!std::all_of(row.begin(), row.end(), [](double value) { return std::isfinite(value); }))
    return std::nullopt;
  const Eigen::Quaterniond rotation(row[7], row[4], row[5], row[6]);
  const double norm = rotation.norm();
  if (norm < kMinQuaternionNorm || norm > kMaxQuaternionNorm) return std::nullopt;
  return StampedPose{row[0], SE3(rotation, Eigen::Vector3d(row[1], row[2], row[3]))};
}

void sort_and_drop_repeats(TrajectoryFile& file) {
  auto& poses = file.trajectory;
  // Stable, so that of several poses with equal time the first in the file is kept.
  std::stable_sort(poses.begin(), poses.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.timestamp < b.timestamp; });
  const auto end = std::unique(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp == b.timestamp;
  });
  file.skipped += static_cast<std::size_t>(std::distance(end, poses.end()));
  poses.erase(end, poses.end());
}

void append_number(std::string& text, double value, int decimals) {
  std::array<char, 512> digits{};  // the largest double has 309 digits before the point
  const auto result =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed, decimals);
  std::string_view word(digits.data(), static_cast<std::size_t>(result.ptr - digits.data()));
  // No "-0.000": its sign depends on rounding noise, and equal poses must give equal bytes.
  if (word.front() == '-' && word.find_first_not_of("-0.") == std::string_view::npos) word.remove_prefix(1);
  text += word;
}

// q and -q are the same rotation: the one with w >= 0 is written.
Eigen::Vector4d canonical_coefficients(const Eigen::Quaterniond& q) {
  Eigen::Vector4d xyzw = q.coeffs();
  for (const int i : {3, 0, 1, 2}) {
    if (xyzw[i] == 0.0) continue;
    if (xyzw[i] < 0.0) xyzw = -xyzw;
    break;
  }
  return xyzw;
}
}  // namespace

std::optional<StampedPose> pose_at(const Trajectory& trajectory, double time, double max_gap) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), time,
                                      [](const StampedPose& pose, double t) { return pose.timestamp < t; });
  if (after == trajectory.end()) return std::nullopt;
  if (after->timestamp == time) return *after;
  if (after == trajectory.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double gap = after->timestamp - before->timestamp;
  if (gap > max_gap) return std::nullopt;
  const double share = (time - before->timestamp) / gap;
  const SE3& a = before->T_world_camera;
  const SE3& b = after->T_world_camera;
  return StampedPose{time, SE3(a.rotation().slerp(share, b.rotation()),
                               (1.0 - share) * a.translation() + share * b.translation())};
}

TrajectoryFile read_trajectory(const std::filesystem::path& file) {
  std::ifstream in(file);
  // A folder opens like a file on some systems and then reads as empty.
  if (!in || std::filesystem::is_directory(file)) {
    throw InputError(file.string() +
                     ": cannot open the trajectory; give a text file of 'timestamp tx ty tz qx qy qz qw'");
  }
  TrajectoryFile result;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    const std::string_view content = std::string_view(line).substr(0, line.find('#'));
    if (content.find_first_not_of(kSeparators) == std::string_view::npos) continue;
    const auto row = parse_row(content);
    if (!row && in.eof() && !result.trajectory.empty()) {  // of a program that was killed while it wrote
      ++result.skipped;
      break;
    }
    if (!row) {
      throw InputError(file.string() + ":" + std::to_string(number) +
                       ": not eight numbers 'timestamp tx ty tz qx qy qz qw'; correct or remove the line");
    }
    if (const auto pose = to_pose(*row)) {
      result.trajectory.push_back(*pose);
    } else {
      ++result.skipped;
    }
  }
  if (in.bad())
    throw InputError(file.string() + ": reading stopped half-way; check the disk or the connection");
  if (result.trajectory.empty()) {
    throw InputError(file.string() + ": holds no pose (" + std::to_string(result.skipped) +
                     " unusable lines); check that the run that wrote it tracked anything");
  }
  sort_and_drop_repeats(result);
  return result;
}

std::string trajectory_header() { return "# timestamp tx ty tz qx qy qz qw\n"; }

std::string trajectory_line(const StampedPose& stamped) {
  const auto& [timestamp, pose] = stamped;
  std::string text;
  append_number(text, timestamp, kTimeDecimals);
  const Eigen::Vector4d rotation = canonical_coefficients(pose.rotation());
  for (const double value : {pose.translation().x(), pose.translation().y(), pose.translation().z(),
                             rotation[0], rotation[1], rotation[2], rotation[3]}) {
    text += ' ';
    append_number(text, value, kPoseDecimals);
  }
  text += '\n';
  return text;
}

void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory) {
  std::string text = trajectory_header();
  for (const StampedPose& pose : trajectory) text += trajectory_line(pose);
  write_file(file, text);
}

}  // namespace roslam
