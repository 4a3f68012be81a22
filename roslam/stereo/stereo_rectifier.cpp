// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/stereo/stereo_rectifier.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/common/formatted.hpp"

namespace roslam {

namespace {
constexpr double kWidest = 1.19;  // tangent of 50 degrees

[[noreturn]] void fail(const std::string& what) { throw CalibrationError("stereo calibration: " + what); }

void require_usable(const Camera& left, const RightCamera& right) {
  left.validate();
  right.camera.validate();
  if (left.width != right.camera.width || left.height != right.camera.height)
    fail(formatted("the left images are %dx%d and the right ones %dx%d; both cameras must have the same size",
                   left.width, left.height, right.camera.width, right.camera.height));
  constexpr double kLeast = 1e-3, kMost = 10.0;  // metres
  const Eigen::Vector3d& t = right.T_left_right.translation();
  if (!right.T_left_right.is_finite() || right.baseline() < kLeast)
    fail(
        "the baseline is zero; give the position of the right camera in the frame of the left one, in "
        "metres");
  if (right.baseline() > kMost)
    fail(formatted("the baseline is %.3g m, which is implausible; is it in millimetres?", right.baseline()));
  constexpr double kAlong = 0.7;  // cosine of 45 degrees
  const double along = t.x() / right.baseline();
  if (along < -kAlong)
    fail(
        formatted("the right camera is %.3f m to the left of the left one: the cameras are swapped, or the "
                  "transform is the inverse of the one from the right camera to the left",
                  -t.x()));
  if (along < kAlong) fail("the cameras are not side by side; only horizontal pairs are supported");
  constexpr double kMostTurned = 0.79;  // rad
  if (right.T_left_right.angle() > kMostTurned)
    fail("the cameras are turned by more than 45 degrees against each other");
}

bool has_same_pinhole(const Camera& a, const Camera& b) {
  constexpr double kSame = 1e-3;  // pixels
  return !a.has_distortion() && !b.has_distortion() && std::abs(a.fx - b.fx) < kSame &&
         std::abs(a.fy - b.fy) < kSame && std::abs(a.cx - b.cx) < kSame && std::abs(a.cy - b.cy) < kSame;
}

// Over an image of 2000 pixels the rows of a pair that is turned or moved by less agree to a fiftieth of a
// pixel.
bool is_rectified(const Camera& left, const RightCamera& right) {
  constexpr double kTurned = 1e-5;  // rad
  const Eigen::Vector3d t = right.T_left_right.translation() / right.baseline();
  return has_same_pinhole(left, right.camera) && right.T_left_right.angle() < kTurned &&
         std::abs(t.y()) < kTurned && std::abs(t.z()) < kTurned;
}

// The axes of the rectified cameras in the frame of the left one.
Eigen::Matrix3d rectified_axes(const SE3& T_left_right) {
  Eigen::Matrix3d R;
  R.col(0) = T_left_right.translation().normalized();
  const Eigen::Vector3d mean = Eigen::Vector3d::UnitZ() + T_left_right.rotation() * Eigen::Vector3d::UnitZ();
  R.col(1) = mean.cross(R.col(0)).normalized();
  R.col(2) = R.col(0).cross(R.col(1));
  return R;
}

// A rectangle of directions x / z and y / z.
struct View {
  double left = -kWidest, top = -kWidest, right = kWidest, bottom = kWidest;
};

// Narrows the view to what the image of a camera fills, by the directions along its border.
void narrow(View& view, const Camera& camera, const Eigen::Matrix3d& R_rectified_raw) {
  constexpr int kSteps = 64;
  const auto at = [&](double u, double v) -> std::optional<Eigen::Vector2d> {
    const auto pixel = camera.try_undistort({u, v});
    if (!pixel) return std::nullopt;  // beyond what the lens model covers, and so beyond the view
    const Eigen::Vector3d direction = R_rectified_raw * camera.unproject(*pixel, 1.0);
    if (direction.z() < 0.1) return std::nullopt;
    return Eigen::Vector2d(direction.head<2>() / direction.z());
  };
  for (int i = 0; i <= kSteps; ++i) {
    const double u = (camera.width - 1.0) * i / kSteps, v = (camera.height - 1.0) * i / kSteps;
    if (const auto p = at(0.0, v)) view.left = std::max(view.left, p->x());
    if (const auto p = at(camera.width - 1.0, v)) view.right = std::min(view.right, p->x());
    if (const auto p = at(u, 0.0)) view.top = std::max(view.top, p->y());
    if (const auto p = at(u, camera.height - 1.0)) view.bottom = std::min(view.bottom, p->y());
  }
}

// Sets the pinhole that shows as much of the view as fills the image.
void set_pinhole(Camera& camera, const View& view) {
  constexpr double kLeast = 0.1;
  const double width = view.right - view.left, height = view.bottom - view.top;
  if (width < kLeast || height < kLeast) fail("the views of the two cameras hardly overlap");
  const double f = std::max((camera.width - 1) / width, (camera.height - 1) / height);
  camera.set_lens("pinhole", {});
  camera.fx = camera.fy = f;
  camera.cx = 0.5 * (camera.width - 1) - 0.5 * f * (view.left + view.right);
  camera.cy = 0.5 * (camera.height - 1) - 0.5 * f * (view.top + view.bottom);
  if (camera.cx <= 0.0 || camera.cx >= camera.width || camera.cy <= 0.0 || camera.cy >= camera.height)
    fail("the views of the two cameras overlap only beside the direction across the baseline");
}
}  // namespace

StereoRectifier::StereoRectifier(const Camera& left, const RightCamera& right) : camera_(left) {
  require_usable(left, right);
  is_identity_ = is_rectified(left, right);
  camera_.baseline = right.baseline();
  if (is_identity_) return;
  const Eigen::Matrix3d R_left_rectified = rectified_axes(right.T_left_right);
  const Eigen::Matrix3d R_right_rectified =
      right.T_left_right.rotation().toRotationMatrix().transpose() * R_left_rectified;
  View view;
  narrow(view, left, R_left_rectified.transpose());
  narrow(view, right.camera, R_right_rectified.transpose());
  set_pinhole(camera_, view);
  T_left_rectified_ = SE3(Eigen::Quaterniond(R_left_rectified), Eigen::Vector3d::Zero());
  camera_.T_body_camera = left.T_body_camera * T_left_rectified_;
  if (camera_.imu) camera_.imu->T_camera_imu = T_left_rectified_.inverse() * camera_.imu->T_camera_imu;
  left_map_ = map_of(left, R_left_rectified);
  right_map_ = map_of(right.camera, R_right_rectified);
}

StereoRectifier::PixelMap StereoRectifier::map_of(const Camera& raw,
                                                  const Eigen::Matrix3d& R_raw_rectified) const {
  cv::Mat_<cv::Vec2f> from(camera_.height, camera_.width);
  for (int y = 0; y < from.rows; ++y) {
    for (int x = 0; x < from.cols; ++x) {
      const Eigen::Vector3d point =
          R_raw_rectified * camera_.unproject({static_cast<double>(x), static_cast<double>(y)}, 1.0);
      const Eigen::Vector2d pixel =
          point.z() > 0.0 ? raw.distort(raw.project(point)) : Eigen::Vector2d(-1e4, -1e4);
      from(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
  }
  PixelMap map;
  cv::convertMaps(from, {}, map.pixels, map.fractions, CV_16SC2);
  return map;
}

cv::Mat StereoRectifier::warp(const cv::Mat& image, const PixelMap& map) const {
  if (is_identity_) return image;
  cv::Mat warped;
  cv::remap(image, warped, map.pixels, map.fractions, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return warped;
}

}  // namespace roslam
