// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/datasets/dataset.hpp"
#include "roslam/datasets/folder_source.hpp"
#include "tests/scratch.hpp"

namespace roslam {

/// A painted plane: the points p with normal . p = distance. Its colour is a smooth function of the point.
struct PaintedPlane {
  Eigen::Vector3d normal = Eigen::Vector3d(0.25, -0.2, 1.0).normalized();
  double distance = 2.2;

  /// Depth along the axis z of a camera in whose frame a pixel is seen along ray (z = 1).
  double depth(const SE3& T_world_camera, const Eigen::Vector3d& ray) const {
    return (distance - normal.dot(T_world_camera.translation())) /
           normal.dot(T_world_camera.rotation() * ray);
  }

  cv::Vec3d colour(const Eigen::Vector3d& p) const {
    return {128.0 + 100.0 * std::sin(1.7 * p.x() + 0.4), 128.0 + 100.0 * std::sin(2.1 * p.y()),
            128.0 + 100.0 * std::cos(1.3 * (p.x() - p.y()))};
  }
};

/// What a camera sees of a plane. ray: of a pixel, in the frame of the poses.
struct PlaneImage {
  cv::Mat colour;  ///< CV_8UC3
  cv::Mat depth;   ///< CV_64FC1, metres
};
using Rays = std::function<Eigen::Vector3d(double x, double y)>;

inline PlaneImage see_plane(const PaintedPlane& plane, const cv::Size& size, const SE3& T_world_camera,
                            const Rays& ray) {
  PlaneImage image{cv::Mat(size, CV_8UC3), cv::Mat(size, CV_64FC1)};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector3d r = ray(x, y);
      const double z = plane.depth(T_world_camera, r);
      const cv::Vec3d colour = plane.colour(T_world_camera * (r * z));
      for (int c = 0; c < 3; ++c) image.colour.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<uchar>(colour[c]);
      image.depth.at<double>(y, x) = z;
    }
  }
  return image;
}

inline PlaneImage see_plane(const PaintedPlane& plane, const Camera& camera, const SE3& T_world_camera) {
  return see_plane(plane, {camera.width, camera.height}, T_world_camera, [&](double x, double y) {
    return camera.unproject({x, y}, 1.0);
  });
}

/// Poses that turn about and move along all three axes.
inline SE3 pose_of_view(int i) {
  Vector6d tangent;
  tangent << 0.03 * i, -0.02 * i, 0.015 * i, 0.02 * i, -0.025 * i, 0.04 * i;
  return SE3(Eigen::Quaterniond::Identity(), {0.1, -0.05, 0.2}) * SE3::exp(tangent);
}

inline Camera small_camera() {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = 61.0;
  camera.fy = 58.0;
  camera.cx = 30.5;
  camera.cy = 25.0;
  return camera;
}

inline void write_depth(const std::filesystem::path& file, const cv::Mat& metres, double units) {
  cv::Mat raw;
  metres.convertTo(raw, CV_16UC1, units);
  ASSERT_TRUE(cv::imwrite(file.string(), raw)) << file;
}

inline void write_colour(const std::filesystem::path& file, const cv::Mat& image) {
  ASSERT_TRUE(cv::imwrite(file.string(), image, {cv::IMWRITE_JPEG_QUALITY, 100})) << file;
}

/// A 4x4 matrix as four lines.
inline std::string matrix_text(const Eigen::Matrix4d& matrix) {
  std::ostringstream text;
  text.precision(12);
  text << matrix << "\n";
  return text.str();
}

/// "time tx ty tz qx qy qz qw".
inline std::string tum_line(double time, const SE3& pose) {
  const auto& t = pose.translation();
  const auto& q = pose.rotation();
  std::ostringstream text;
  text.precision(12);
  text << time << " " << t.x() << " " << t.y() << " " << t.z() << " " << q.x() << " " << q.y() << " " << q.z()
       << " " << q.w() << "\n";
  return text.str();
}

/// How far frames contradict each other and the plane.
struct Contradiction {
  double metres_from_plane = 0.0;  ///< of points by depth and truth, the largest
  double metres = 0.0;             ///< of depth between two frames, the largest
  double grey_values = 0.0;        ///< of colour between two frames, the largest
  int compared = 0;
};

inline Eigen::Vector4d sample(const Frame& frame, const Eigen::Vector2d& at) {  // bilinear: depth, B, G, R
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (const int dx : {0, 1}) {
    for (const int dy : {0, 1}) {
      const double weight = (dx ? at.x() - x : 1.0 - at.x() + x) * (dy ? at.y() - y : 1.0 - at.y() + y);
      const auto& c = frame.colour.at<cv::Vec3b>(y + dy, x + dx);
      const double z = frame.depth.at<float>(y + dy, x + dx);
      sum += weight * Eigen::Vector4d(z > 0.0 ? z : 1e9, c[0], c[1], c[2]);
    }
  }
  return sum;
}

/// Back-projects pixels of frame a with their depth and true pose into the world and looks for them in b.
inline Contradiction compare(const PaintedPlane& plane, const Camera& camera, const Frame& a,
                             const Frame& b) {
  Contradiction worst;
  if (a.depth.empty() || b.depth.empty()) return worst;
  for (int y = 1; y < camera.height; y += std::max(2, camera.height / 24)) {
    for (int x = 1; x < camera.width; x += std::max(2, camera.width / 24)) {
      const double z = a.depth.at<float>(y, x);
      if (!(z > 0.0)) continue;
      const Eigen::Vector3d point = *a.T_world_camera * camera.unproject({x, y}, z);
      worst.metres_from_plane =
          std::max(worst.metres_from_plane, std::abs(plane.normal.dot(point) - plane.distance));
      const Eigen::Vector3d in_b = b.T_world_camera->inverse() * point;
      const Eigen::Vector2d pixel = camera.project(in_b);
      if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < camera.width - 1 &&
            pixel.y() < camera.height - 1))
        continue;
      const Eigen::Vector4d seen = sample(b, pixel);
      if (seen[0] > 1e6) continue;  // a neighbour has no depth
      ++worst.compared;
      worst.metres = std::max(worst.metres, std::abs(seen[0] - in_b.z()));
      for (int c = 0; c < 3; ++c)
        worst.grey_values =
            std::max(worst.grey_values, std::abs(seen[c + 1] - a.colour.at<cv::Vec3b>(y, x)[c]));
    }
  }
  return worst;
}

inline std::vector<Frame> all_frames(FrameSource& source) {
  std::vector<Frame> frames;
  while (auto frame = source.next()) frames.push_back(*frame);
  return frames;
}

/// Frames of a plane as a folder should give them.
inline void expect_consistent(const PaintedPlane& plane, const Camera& camera,
                              const std::vector<Frame>& frames, double metres, double grey_values) {
  for (std::size_t i = 0; i + 3 < frames.size(); ++i) {
    ASSERT_TRUE(frames[i].T_world_camera && frames[i + 3].T_world_camera) << i;
    ASSERT_FALSE(frames[i].depth.empty());
    const auto worst = compare(plane, camera, frames[i], frames[i + 3]);
    EXPECT_GT(worst.compared, 150) << i;
    EXPECT_LT(worst.metres_from_plane, metres) << i;
    EXPECT_LT(worst.metres, metres) << i;
    EXPECT_LT(worst.grey_values, grey_values) << i;
  }
}

class DatasetFolder : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void put(const std::filesystem::path& file, const std::string& text) const {
    std::filesystem::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << text;
  }

  /// The message of the InputError that opening gives.
  std::string refused(const std::optional<Camera>& camera = {}, DatasetUse use = DatasetUse::kSlam) const {
    try {
      open_dataset(folder_, camera, use);
    } catch (const InputError& error) {
      return error.what();
    }
    return "not refused";
  }

  const std::filesystem::path folder_ = scratch_path();
  const PaintedPlane plane_;
};

}  // namespace roslam
