// SPDX-License-Identifier: BSD-3-Clause
#include "recording/map_render.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <tuple>
#include <utility>

#include "roslam/geometry/se3f.hpp"
#include "roslam/restoration/provenance.hpp"
#include "roslam/semantics/label_set.hpp"

namespace roslam::recording {

namespace {
constexpr float kNearest = 0.1F;  // metres in front of the camera
const cv::Scalar kBackground(255, 255, 255);

constexpr std::array kNames{std::pair{"rgb", MapColour::kRgb}, std::pair{"height", MapColour::kHeight},
                            std::pair{"class", MapColour::kClass},
                            std::pair{"provenance", MapColour::kProvenance}};

// The 2nd and 98th percentile of the height along up, metres.
std::pair<float, float> usual_heights(const SurfaceMap& surface, const Eigen::Vector3f& up) {
  std::vector<float> heights;
  heights.reserve(surface.points.size());
  for (const SurfacePoint& point : surface.points) heights.push_back(up.dot(point.position));
  if (heights.empty()) return {0.0F, 1.0F};
  const auto at = [&](double share) {
    const auto n =
        heights.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(heights.size() - 1));
    std::nth_element(heights.begin(), n, heights.end());
    return *n;
  };
  const float low = at(0.02);
  return {low, std::max(at(0.98), low + 0.01F)};
}

cv::Vec3b height_colour(float share) {
  const cv::Mat grey(1, 1, CV_8UC1, cv::Scalar(std::clamp(share, 0.0F, 1.0F) * 255.0F));
  cv::Mat colour;
  cv::applyColorMap(grey, colour, cv::COLORMAP_TURBO);
  return colour.at<cv::Vec3b>(0);
}

// Diffuse shading by a fixed light, so that false colours show shapes too.
cv::Vec3b shaded(const cv::Vec3b& colour, const Eigen::Vector3f& normal) {
  const float light = 0.55F + 0.45F * std::abs(normal.dot(Eigen::Vector3f(0.4F, 0.3F, 0.87F)));
  return {cv::saturate_cast<std::uint8_t>(static_cast<float>(colour[0]) * light),
          cv::saturate_cast<std::uint8_t>(static_cast<float>(colour[1]) * light),
          cv::saturate_cast<std::uint8_t>(static_cast<float>(colour[2]) * light)};
}

class PointColour {
 public:
  PointColour(const SurfaceMap& surface, MapColour colour) : colour_(colour) {
    if (colour != MapColour::kHeight) return;
    up_ = up_of(surface);
    std::tie(low_, high_) = usual_heights(surface, up_);
    for (std::size_t i = 0; i < heights_.size(); ++i)
      heights_[i] = height_colour(static_cast<float>(i) / static_cast<float>(heights_.size() - 1));
  }

  cv::Vec3b operator()(const SurfacePoint& point) const {
    switch (colour_) {
      case MapColour::kRgb:
        return point.colour;
      case MapColour::kClass:
        return shaded(class_colour(point.label), point.normal);
      case MapColour::kProvenance:
        return shaded(provenance_colour(point.provenance), point.normal);
      case MapColour::kHeight:
        break;
    }
    const float share = std::clamp((up_.dot(point.position) - low_) / (high_ - low_), 0.0F, 1.0F);
    return shaded(heights_[static_cast<std::size_t>(share * static_cast<float>(heights_.size() - 1))],
                  point.normal);
  }

 private:
  MapColour colour_;
  Eigen::Vector3f up_ = Eigen::Vector3f::UnitZ();
  float low_ = 0.0F, high_ = 1.0F;
  std::array<cv::Vec3b, 256> heights_{};
};
}  // namespace

std::optional<MapColour> map_colour_from(std::string_view name) {
  for (const auto& [known, colour] : kNames)
    if (known == name) return colour;
  return std::nullopt;
}

std::vector<std::string> map_colour_names() {
  std::vector<std::string> result;
  for (const auto& [name, colour] : kNames) result.push_back(name);
  return result;
}

Eigen::Vector3f up_of(const SurfaceMap& surface) {
  constexpr std::array kNarrowing{35.0F, 20.0F, 10.0F, 5.0F};  // degrees around the current up direction
  constexpr std::size_t kEnough = 200;                         // points of horizontal surfaces
  constexpr float kDegree = static_cast<float>(M_PI / 180.0);
  Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
  for (const float angle : kNarrowing) {
    const float least = std::cos(angle * kDegree);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    std::size_t count = 0;
    for (const SurfacePoint& point : surface.points) {
      if (!(point.normal.dot(up) >= least)) continue;
      sum += point.normal;
      ++count;
    }
    if (count < kEnough) break;
    up = sum.normalized();
  }
  return up;
}

Viewpoint top_view(const SurfaceMap& surface, const cv::Size& size) {
  const Eigen::Matrix3f level =
      Eigen::Quaternionf::FromTwoVectors(up_of(surface), Eigen::Vector3f::UnitZ()).toRotationMatrix();
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const SurfacePoint& point : surface.points) {
    low = low.cwiseMin(level * point.position);
    high = high.cwiseMax(level * point.position);
  }
  if (surface.points.empty()) low = high = Eigen::Vector3f::Zero();
  constexpr double kMargin = 1.05;
  const double wide = std::max(1.0, static_cast<double>(high.x() - low.x())) * kMargin;
  const double tall = std::max(1.0, static_cast<double>(high.y() - low.y())) * kMargin;
  const double pixels_a_metre = std::min(size.width / wide, size.height / tall);
  // Far away, for a nearly orthographic projection.
  const double above = 50.0 * std::max(wide, tall);
  Viewpoint view;
  view.camera.width = size.width;
  view.camera.height = size.height;
  view.camera.fx = view.camera.fy = pixels_a_metre * above;
  view.camera.cx = 0.5 * (size.width - 1);
  view.camera.cy = 0.5 * (size.height - 1);
  Eigen::Matrix3d down;
  down << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  const Eigen::Vector3d middle = (0.5F * (low + high)).cast<double>();
  const SE3 T_level_camera(down, {middle.x(), middle.y(), static_cast<double>(low.z()) + above});
  view.T_world_camera =
      SE3(Eigen::Matrix3d(level.transpose().cast<double>()), Eigen::Vector3d::Zero()) * T_level_camera;
  return view;
}

Viewpoint front_view(const SE3& T_world_camera, const cv::Size& size) {
  Viewpoint view;
  view.camera.width = size.width;
  view.camera.height = size.height;
  view.camera.fx = view.camera.fy = 0.7 * size.width;
  view.camera.cx = 0.5 * (size.width - 1);
  view.camera.cy = 0.5 * (size.height - 1);
  constexpr double kUp = 1.5, kBack = 2.5;  // metres
  const double pitch = 0.2;                 // radians, downwards
  const SE3 T_camera_view(so3_exp({-pitch, 0.0, 0.0}), {0.0, -kUp, -kBack});
  view.T_world_camera = T_world_camera * T_camera_view;
  return view;
}

cv::Mat draw_surface(const SurfaceMap& surface, const Viewpoint& view, MapColour colour, double point_size) {
  const cv::Size size(view.camera.width, view.camera.height);
  cv::Mat image(size, CV_8UC3, kBackground);
  cv::Mat nearest(size, CV_32FC1, cv::Scalar(std::numeric_limits<float>::max()));
  const SE3f camera_from_world(view.T_world_camera.inverse());
  const auto fx = static_cast<float>(view.camera.fx), fy = static_cast<float>(view.camera.fy);
  const auto cx = static_cast<float>(view.camera.cx), cy = static_cast<float>(view.camera.cy);
  const PointColour colour_of(surface, colour);
  const cv::Rect bounds({0, 0}, size);
  for (const SurfacePoint& point : surface.points) {
    const Eigen::Vector3f at = camera_from_world * point.position;
    if (at.z() < kNearest) continue;
    const float u = at.x() / at.z() * fx + cx, v = at.y() / at.z() * fy + cy;
    const float half = 0.5F * static_cast<float>(point_size) * fx / at.z();
    if (!(u + half >= 0.0F && v + half >= 0.0F && u - half < static_cast<float>(size.width) &&
          v - half < static_cast<float>(size.height)))
      continue;
    const cv::Point low(static_cast<int>(std::floor(u - half + 0.5F)),
                        static_cast<int>(std::floor(v - half + 0.5F)));
    const cv::Point high(static_cast<int>(std::ceil(u + half + 0.5F)),
                         static_cast<int>(std::ceil(v + half + 0.5F)));
    const cv::Rect square = cv::Rect(low, high) & bounds;
    const cv::Vec3b value = colour_of(point);
    for (int y = square.y; y < square.br().y; ++y) {
      for (int x = square.x; x < square.br().x; ++x) {
        if (nearest.at<float>(y, x) <= at.z()) continue;
        nearest.at<float>(y, x) = at.z();
        image.at<cv::Vec3b>(y, x) = value;
      }
    }
  }
  return image;
}

}  // namespace roslam::recording
