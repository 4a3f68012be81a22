// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/depth_registration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr float kNearest = 1e-3F;  // metres before the colour camera
constexpr float kFarthest = 1e4F;  // metres
constexpr float kUnknown = 1e9F;   // depth of a pixel while nothing is drawn there
constexpr float kFar = 1e6F;       // pixels; what is farther outside is not in the image
constexpr int kLargest = 64;       // pixels that one may cover in each direction; more is no measurement
constexpr int kMargin = 32;        // pixels around the image for which distortion is known

// The smallest integer that is not less. Written so that a loop over it is vectorised. The limits below have
// the constant first, as NaN then becomes the constant.
int round_up(float value) {
  const int truncated = static_cast<int>(value);
  return truncated + (static_cast<float>(truncated) < value ? 1 : 0);
}

// Draws a depth where nothing nearer is.
void draw(const cv::Rect& area, float z, cv::Mat& image) {
  const auto set = [z](float& at) { at = std::min(at, z); };
  if (area.width <= 2 && area.height <= 2) {  // nearly always, and without branches
    float *above = image.ptr<float>(area.y) + area.x,
          *below = image.ptr<float>(area.y + area.height - 1) + area.x;
    const int last = area.width - 1;
    set(above[0]);
    set(above[last]);
    set(below[0]);
    set(below[last]);
    return;
  }
  for (int y = area.y; y < area.y + area.height; ++y) {
    float* at = image.ptr<float>(y) + area.x;
    for (int x = 0; x < area.width; ++x) set(at[x]);
  }
}
}  // namespace

// Of a row of the depth image, the pixels of the colour image that each depth pixel covers: [left, right) x
// [top, bottom).
struct DepthRegistration::Row {
  explicit Row(int width)
      : left(static_cast<std::size_t>(width)),
        right(left.size()),
        top(left.size()),
        bottom(left.size()),
        x(left.size()),
        y(left.size()),
        z(left.size()) {}

  std::vector<int> left, right, top, bottom;
  std::vector<float> x, y;  // of one corner of each
  std::vector<float> z;     // depth in the colour camera, metres; not positive: unknown
};

DepthRegistration::DepthRegistration(const Camera& depth, const Camera& colour, const SE3& T_colour_depth)
    : from_(depth.width, depth.height),
      to_(colour.width, colour.height),
      has_distortion_(colour.has_distortion()) {
  depth.validate();
  colour.validate();
  if (!T_colour_depth.is_finite())
    throw CalibrationError("the transform from the depth to the colour camera is not finite");
  const bool is_one_place = T_colour_depth.translation().norm() < 1e-6 && T_colour_depth.angle() < 1e-6;
  is_identity_ = is_one_place && from_ == to_ && depth.fx == colour.fx && depth.fy == colour.fy &&
                 depth.cx == colour.cx && depth.cy == colour.cy && depth.model == colour.model &&
                 depth.distortion == colour.distortion;
  if (is_identity_) return;
  Eigen::Matrix3d K;
  K << colour.fx, 0.0, colour.cx, 0.0, colour.fy, colour.cy, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d R = T_colour_depth.rotation().toRotationMatrix();
  const Eigen::Matrix3d KR = K * R;
  offset_ = (K * T_colour_depth.translation()).cast<float>();
  for (int v = 0; v <= depth.height; ++v) {
    for (int u = 0; u <= depth.width; ++u) {
      const Eigen::Vector3f ray =
          (KR * depth.unproject(depth.undistort({u - 0.5, v - 0.5}), 1.0)).cast<float>();
      x_.push_back(ray.x());
      y_.push_back(ray.y());
      z_.push_back(ray.z());
      if (u == depth.width || v == depth.height) continue;
      const auto centre = depth.try_undistort({u, v});
      centre_z_.push_back(centre ? static_cast<float>(R.row(2).dot(depth.unproject(*centre, 1.0)))
                                 : std::numeric_limits<float>::quiet_NaN());  // not seen by the lens
    }
  }
  measure_seams();
  if (!has_distortion_) return;
  displacement_.create(to_.height + 2 * kMargin, to_.width + 2 * kMargin, CV_32FC2);
  for (int v = 0; v < displacement_.rows; ++v) {
    for (int u = 0; u < displacement_.cols; ++u) {
      const Eigen::Vector2d pixel(u - kMargin, v - kMargin);
      const Eigen::Vector2f moved = (colour.distort(pixel) - pixel).cast<float>();
      displacement_.at<cv::Vec2f>(v, u) = {moved.x(), moved.y()};
    }
  }
}

// The other two corners of a pixel lie beside the rectangle between those that are projected, by what one
// camera is turned against the other and the depth camera's distortion; taken at infinity.
void DepthRegistration::measure_seams() {
  const std::size_t stride = static_cast<std::size_t>(from_.width) + 1;
  for (std::size_t i = 0; i + stride + 1 < x_.size(); ++i) {
    if ((i + 1) % stride == 0) continue;
    const std::size_t right = i + 1, below = i + stride;
    seam_x_ = std::max(seam_x_, std::abs(x_[i] / z_[i] - x_[below] / z_[below]));
    seam_y_ = std::max(seam_y_, std::abs(y_[i] / z_[i] - y_[right] / z_[right]));
  }
  constexpr float kHalf = 0.5F;  // of a pixel that is turned by 90 degrees
  seam_x_ = std::min(seam_x_, kHalf);
  seam_y_ = std::min(seam_y_, kHalf);
}

// To the raw image, by the nearest pixel of the table, between which the displacement hardly differs, and as
// at its border beyond it.
void DepthRegistration::distort(std::vector<float>& x, std::vector<float>& y) const {
  const auto right = static_cast<float>(displacement_.cols - 1),
             bottom = static_cast<float>(displacement_.rows - 1);
  constexpr float kCentre = kMargin + 0.5F;
  for (std::size_t u = 0; u < x.size(); ++u) {
    const int column = static_cast<int>(std::min(right, std::max(0.0F, x[u] + kCentre)));
    const int row = static_cast<int>(std::min(bottom, std::max(0.0F, y[u] + kCentre)));
    const cv::Vec2f& moved = displacement_.at<cv::Vec2f>(row, column);
    x[u] += moved[0];
    y[u] += moved[1];
  }
}

// Where one corner of each pixel of a row is in the colour image. corners: the first of them in the rays.
void DepthRegistration::project_corners(const float* depth, std::size_t corners, Row& row) const {
  const float *rx = x_.data() + corners, *ry = y_.data() + corners, *rz = z_.data() + corners;
  const float ox = offset_.x(), oy = offset_.y(), oz = offset_.z();
  float *x = row.x.data(), *y = row.y.data();
  const std::size_t columns = row.x.size();
  for (std::size_t u = 0; u < columns; ++u) {
    const float scale = 1.0F / std::max(kNearest, depth[u] * rz[u] + oz);
    x[u] = std::min(kFar, std::max(-kFar, (depth[u] * rx[u] + ox) * scale));
    y[u] = std::min(kFar, std::max(-kFar, (depth[u] * ry[u] + oy) * scale));
  }
  if (has_distortion_) distort(row.x, row.y);
}

void DepthRegistration::project(const float* depth, int row, Row& projected) const {
  const auto columns = static_cast<std::size_t>(from_.width);
  const std::size_t above = static_cast<std::size_t>(row) * (columns + 1), below = above + columns + 2;
  const auto round_all = [](const std::vector<float>& from, float aside, std::vector<int>& to) {
    const float* in = from.data();
    int* out = to.data();
    const std::size_t count = from.size();
    for (std::size_t u = 0; u < count; ++u) out[u] = round_up(in[u] + aside);
  };
  project_corners(depth, above, projected);
  round_all(projected.x, -seam_x_, projected.left);
  round_all(projected.y, -seam_y_, projected.top);
  project_corners(depth, below, projected);
  round_all(projected.x, seam_x_, projected.right);
  round_all(projected.y, seam_y_, projected.bottom);
  const float* centre_z = centre_z_.data() + static_cast<std::size_t>(row) * columns;
  const float oz = offset_.z();
  float* z = projected.z.data();
  for (std::size_t u = 0; u < columns; ++u) z[u] = depth[u] > 0.0F ? depth[u] * centre_z[u] + oz : 0.0F;
}

cv::Mat DepthRegistration::operator()(const cv::Mat& depth) const {
  if (depth.type() != CV_32FC1 || depth.size() != from_)
    throw InputError("the depth image is not of the depth camera's size, " + std::to_string(from_.width) +
                     "x" + std::to_string(from_.height));
  if (is_identity_) return depth;
  cv::Mat result(to_, CV_32FC1, cv::Scalar(kUnknown));
  Row row(from_.width);
  for (int v = 0; v < from_.height; ++v) {
    project(depth.ptr<float>(v), v, row);
    for (std::size_t u = 0; u < row.z.size(); ++u) {
      if (!(row.z[u] > kNearest && row.z[u] < kFarthest)) continue;
      // The order of the corners changes where one camera is turned against the other.
      const auto [left, right] = std::minmax(row.left[u], row.right[u]);
      const auto [top, bottom] = std::minmax(row.top[u], row.bottom[u]);
      if (right - left > kLargest || bottom - top > kLargest) continue;  // a corner is beyond the lens
      const cv::Rect area = cv::Rect(left, top, right - left, bottom - top) & cv::Rect({0, 0}, to_);
      if (!area.empty()) draw(area, row.z[u], result);
    }
  }
  for (int y = 0; y < result.rows; ++y) {
    float* at = result.ptr<float>(y);
    for (int x = 0; x < result.cols; ++x) at[x] = at[x] < kUnknown ? at[x] : 0.0F;
  }
  return result;
}

}  // namespace roslam
