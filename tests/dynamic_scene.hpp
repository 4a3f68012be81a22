// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "roslam/dynamic_objects/movable_object.hpp"
#include "roslam/dynamic_objects/optical_flow.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

/// Small scenes with ground truth: textured rectangles in front of a small camera, rendered from any pose.
/// The world frame has the axes of the first camera (x right, y down, z forward), metres.
namespace roslam::scene {

/// Images of 320 by 240 pixels, so that detection cells have two pixels.
inline Camera small_camera() {
  Camera camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 260.0;
  camera.cx = 159.5;
  camera.cy = 119.5;
  return camera;
}

/// T_camera_world of a camera at that position, looking along z.
inline SE3 looking_from(double x, double y, double z) {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, -y, -z)};
}

/// T_camera_world of a camera at that position, turned to the right (radians).
inline SE3 turned(double angle, const Eigen::Vector3d& place = Eigen::Vector3d::Zero()) {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY())),
             Eigen::Vector3d::Zero()) *
         looking_from(place.x(), place.y(), place.z());
}

/// A rectangle perpendicular to the z axis. Its texture moves with it.
struct Panel {
  double left;
  double top;
  double right;
  double bottom;
  double z;

  Panel shifted(double x, double y = 0.0) const { return {left + x, top + y, right + x, bottom + y, z}; }
};

constexpr Panel kWall{-20.0, -20.0, 20.0, 20.0, 3.0};

/// A wall with a shelf and a bench in front, whose parallax separates the camera's rotation from its
/// translation; then the objects given, the first of which has the number kThing.
inline std::vector<Panel> room(const std::vector<Panel>& things = {}) {
  std::vector<Panel> panels{kWall, {-1.7, -1.4, -0.9, 1.4, 2.2}, {-1.5, 0.45, 1.5, 1.4, 1.6}};
  panels.insert(panels.end(), things.begin(), things.end());
  return panels;
}
constexpr int kThing = 4;

/// A rendered image with ground truth.
struct View {
  cv::Mat grey;   ///< CV_8UC1
  cv::Mat depth;  ///< CV_32FC1 metres, 0 = none
  cv::Mat panel;  ///< CV_8UC1: position in the list of panels plus one, 0 = none

  cv::Mat shows(int number) const { return panel == number; }
};

class Stage {
 public:
  explicit Stage(Camera camera = small_camera()) : camera_(std::move(camera)) {
    // Noise at several scales, so that optical flow finds texture at each pyramid level.
    cv::Mat sum = cv::Mat::zeros(kTexels, kTexels, CV_32FC1);
    cv::RNG random(7);
    for (const double size : {2.0, 6.0, 18.0}) {
      cv::Mat noise(kTexels, kTexels, CV_32FC1);
      random.fill(noise, cv::RNG::NORMAL, 0.0, size);
      cv::GaussianBlur(noise, noise, {}, size);
      sum += noise;
    }
    cv::normalize(sum, texture_, 0.0, 255.0, cv::NORM_MINMAX);
  }

  const Camera& camera() const { return camera_; }

  View show(const std::vector<Panel>& panels, const SE3& T_camera_world = {}) const {
    const cv::Size size(camera_.width, camera_.height);
    View view{cv::Mat::zeros(size, CV_8UC1), cv::Mat::zeros(size, CV_32FC1), cv::Mat::zeros(size, CV_8UC1)};
    const SE3 T_world_camera = T_camera_world.inverse();
    const Eigen::Matrix3d turn = T_world_camera.rotation().toRotationMatrix();
    const Eigen::Vector3d from = T_world_camera.translation();
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const Eigen::Vector3d ray = turn * camera_.unproject({x, y}, 1.0);
        double nearest = 1e9;
        for (std::size_t i = 0; i < panels.size(); ++i) {
          const Panel& panel = panels[i];
          const double z = (panel.z - from.z()) / ray.z();
          const Eigen::Vector3d hit = from + z * ray;
          if (z < 0.05 || z >= nearest || hit.x() < panel.left || hit.x() > panel.right ||
              hit.y() < panel.top || hit.y() > panel.bottom)
            continue;
          nearest = z;
          view.grey.at<std::uint8_t>(y, x) =
              colour(hit.x() - panel.left + 1.7 * static_cast<double>(i), hit.y() - panel.top);
          view.depth.at<float>(y, x) = static_cast<float>(z);
          view.panel.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(i + 1);
        }
      }
    }
    return view;
  }

  /// Points on a regular grid, outside and inside a mask.
  struct GridPoints {
    std::vector<cv::Point2f> outside;
    std::vector<cv::Point2f> inside;
  };
  GridPoints grid_points(const cv::Mat& mask = {}) const {
    GridPoints points;
    constexpr int kApart = 8;  // pixels
    for (int y = kApart; y < camera_.height; y += kApart) {
      for (int x = kApart; x < camera_.width; x += kApart) {
        const bool is_inside = !mask.empty() && mask.at<std::uint8_t>(y, x) != 0;
        (is_inside ? points.inside : points.outside).emplace_back(x, y);
      }
    }
    return points;
  }

  /// The view as a past frame of the flow consistency check, with corners at the grid points; those in the
  /// mask are on moving objects.
  PastFrame past(const View& view, std::size_t index, double timestamp, const SE3& T_camera_world,
                 const cv::Mat& mask = {}) const {
    PastFrame frame{index, timestamp, flow_pyramid(view.grey), view.depth, T_camera_world, {}};
    const GridPoints points = grid_points(mask);
    for (const auto* list : {&points.outside, &points.inside}) {
      for (const auto& point : *list) {
        frame.corners.push_back({static_cast<int>(frame.corners.size()), point,
                                 camera_.undistort({point.x, point.y}), list == &points.inside});
      }
    }
    return frame;
  }

 private:
  static constexpr int kTexels = 1024;
  static constexpr double kTexelsPerMetre = 100.0;

  std::uint8_t colour(double x, double y) const {
    const double column = x * kTexelsPerMetre;
    const double row = y * kTexelsPerMetre;
    const auto texel = [&](int dx, int dy) {
      const int c = (static_cast<int>(std::floor(column)) + dx) & (kTexels - 1);
      const int r = (static_cast<int>(std::floor(row)) + dy) & (kTexels - 1);
      return static_cast<double>(texture_.at<float>(r, c));
    };
    const double u = column - std::floor(column);
    const double v = row - std::floor(row);
    const double value = (1.0 - v) * ((1.0 - u) * texel(0, 0) + u * texel(1, 0)) +
                         v * ((1.0 - u) * texel(0, 1) + u * texel(1, 1));
    return static_cast<std::uint8_t>(std::lround(value));
  }

  Camera camera_;
  cv::Mat texture_;
};

/// An object with a filled box as its mask.
inline MovableObject boxed(const cv::Rect& box, Movable kind = Movable::kPerson, float confidence = 0.9F) {
  MovableObject object;
  object.kind = kind;
  object.box = box;
  object.mask = cv::Mat(box.size(), CV_8UC1, cv::Scalar(255));
  object.confidence = object.decayed_confidence = confidence;
  return object;
}

/// Share of the pixels (or cells) set in one image that are set in another too.
inline double share_set(const cv::Mat& of, const cv::Mat& in) {
  const int all = cv::countNonZero(of);
  if (all == 0 || in.empty()) return 0.0;
  return static_cast<double>(cv::countNonZero(of & in)) / all;
}

/// The mask eroded by that many pixels (or cells).
inline cv::Mat inside(const cv::Mat& mask, int pixels) {
  cv::Mat result;
  cv::erode(mask, result, cv::getStructuringElement(cv::MORPH_RECT, {2 * pixels + 1, 2 * pixels + 1}),
            {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  return result;
}

}  // namespace roslam::scene
