// SPDX-License-Identifier: BSD-3-Clause
// KITTI odometry: image_0 and image_1 (rectified grey) or image_2 and image_3 (colour) with NNNNNN.png,
// times.txt (seconds), calib.txt (P0 to P3: 3x4 projections K [I | t] from the frame of camera 0) and
// poses.txt (3x4, camera 0 to world), in the folder or, as published, in ../../poses/SEQUENCE.txt.
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/datasets/formats.hpp"
#include "roslam/datasets/text_numbers.hpp"
#include "roslam/sensors/image_file.hpp"
#include "roslam/sensors/timed_files.hpp"

namespace roslam::datasets {

namespace {
using Matrix34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

struct RectifiedCamera {
  Camera camera;
  Eigen::Vector3d t_camera_0 = Eigen::Vector3d::Zero();  ///< origin of camera 0 in its frame, metres
};

std::map<long, Path> images_of(const Path& folder, int camera) {
  return numbered_files(folder / ("image_" + std::to_string(camera)), "", {".png", ".jpg"});
}

std::optional<Matrix34> matrix34(const std::vector<double>& numbers) {
  if (numbers.size() != 12) return std::nullopt;
  return Eigen::Map<const Matrix34>(numbers.data());
}

// The camera of a line of calib.txt. fps: images a second.
RectifiedCamera read_calibration(const Path& file, int number, const cv::Size& size, double fps) {
  const std::string key = std::string("P").append(std::to_string(number)).append(":");
  std::optional<Matrix34> P;
  for_each_line(file, "it comes with the sequence", [&](std::size_t, std::string_view line) {
    if (const auto begin = line.find_first_not_of(" \t"); line.substr(begin).starts_with(key))
      P = matrix34(numbers_of(line.substr(begin + key.size())).value_or(std::vector<double>{}));
  });
  const Eigen::Matrix3d K = P ? Eigen::Matrix3d(P->leftCols<3>()) : Eigen::Matrix3d::Zero();
  if (!P || !P->allFinite() || !(std::abs(K.determinant()) > 0.0))
    throw InputError(file.string() + ": has no line '" + key + "' of 12 numbers; it comes with the sequence");
  RectifiedCamera result;
  result.camera.width = size.width;
  result.camera.height = size.height;
  result.camera.fx = K(0, 0);
  result.camera.fy = K(1, 1);
  result.camera.cx = K(0, 2);
  result.camera.cy = K(1, 2);
  result.camera.fps = fps;
  result.t_camera_0 = K.inverse() * P->col(3);
  return result;
}

// One time an image; NaN where a line is none.
std::vector<double> read_times(const Path& file) {
  std::vector<double> times;
  for_each_line(file, "it comes with the sequence", [&](std::size_t, std::string_view line) {
    const auto numbers = numbers_of(line);
    times.push_back(numbers && numbers->size() == 1 ? numbers->front() : std::nan(""));
  });
  return times;
}

double images_a_second(const std::vector<double>& times) {
  std::vector<TimedFile> entries;
  for (const double time : times) {
    if (std::isfinite(time)) entries.push_back({time, {}, 0});
  }
  const double interval = median_interval(entries);
  return interval > 1e-3 && interval < 1e3 ? 1.0 / interval : 10.0;
}

// Poses of camera 0, one an image.
std::vector<std::optional<SE3>> read_poses(const Path& folder) {
  Path file = folder / "poses.txt";
  const Path absolute = std::filesystem::absolute(folder).lexically_normal();
  const Path sequence = absolute.has_filename() ? absolute : absolute.parent_path();
  if (!is_present(file))
    file = sequence.parent_path().parent_path() / "poses" / (sequence.filename().string() + ".txt");
  std::vector<std::optional<SE3>> poses;
  if (!is_present(file)) return poses;
  for_each_line(file, "it comes with the sequence", [&](std::size_t, std::string_view line) {
    const auto pose = matrix34(numbers_of(line).value_or(std::vector<double>{}));
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    if (pose) matrix.topRows<3>() = *pose;
    poses.push_back(pose ? rigid_transform(matrix) : std::nullopt);
  });
  return poses;
}

cv::Size size_of(const std::map<long, Path>& files) {
  int left = 20;
  for (const auto& [number, file] : files) {
    if (const ImageFile image = read_colour_image(file); image.error.empty()) return image.image.size();
    if (--left == 0) break;
  }
  return {};
}
}  // namespace

bool is_kitti(const Path& folder) {
  return is_present(folder / "calib.txt") && is_present(folder / "times.txt") &&
         (is_present(folder / "image_0") || is_present(folder / "image_2"));
}

FolderListing list_kitti(const Path& folder, const GivenCamera& camera) {
  const int number = images_of(folder, 0).empty() ? 2 : 0;  // grey where there is a choice: it is sharper
  const auto images = images_of(folder, number);
  const cv::Size size = size_of(images);
  if (size.empty())
    throw InputError(folder.string() + ": image_" + std::to_string(number) +
                     " has no image that can be read; is the dataset complete?");
  const auto times = read_times(folder / "times.txt");
  const double fps = images_a_second(times);
  const RectifiedCamera left = read_calibration(folder / "calib.txt", number, size, fps);
  FolderListing listing{folder.string(), camera.value_or(left.camera), {}};
  const auto right_images = images_of(folder, number + 1);
  const auto poses = read_poses(folder);
  const SE3 T_0_left(Eigen::Quaterniond::Identity(), -left.t_camera_0);
  for (const auto& [index, file] : images) {
    const auto i = static_cast<std::size_t>(index);
    if (i >= times.size()) {
      ++listing.skipped["colour image without a time"];
      continue;
    }
    ListedFrame frame{times[i], 0, file, {}, {}, std::nullopt};
    if (const auto found = right_images.find(index); found != right_images.end()) frame.right = found->second;
    if (i < poses.size() && poses[i]) frame.T_world_camera = *poses[i] * T_0_left;
    listing.frames.push_back(std::move(frame));
  }
  if (!right_images.empty()) {
    const auto right = read_calibration(folder / "calib.txt", number + 1, size, fps);
    // p_left = p_0 + t_left and p_right = p_0 + t_right.
    listing.right = {right.camera, SE3(Eigen::Quaterniond::Identity(), left.t_camera_0 - right.t_camera_0)};
  }
  return listing;
}

}  // namespace roslam::datasets
