// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/composition/composed_person.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace roslam::simulation {
namespace {

constexpr double kNearest = 0.2;  // metres from the camera; a nearer person is not rendered
constexpr double kLeastAside =
    0.3;                          // metres from the person along the floor: else the camera looks from above
constexpr int kSmallestSide = 8;  // pixels of the coarsest image

// Alpha matte of the mask. It fades inside the outline, where no colour of the background is mixed in.
cv::Mat soft_mask(const cv::Mat& mask) {
  cv::Mat padded;
  cv::copyMakeBorder(mask, padded, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::Mat alpha(mask.size(), CV_32FC1, cv::Scalar(0));
  for (int y = 0; y < alpha.rows; ++y) {
    for (int x = 0; x < alpha.cols; ++x) {
      if (mask.at<std::uint8_t>(y, x) == 0) continue;
      int inside = 0;
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) inside += padded.at<std::uint8_t>(y + j, x + i) != 0 ? 1 : 0;
      }
      alpha.at<float>(y, x) = std::max(0.0F, static_cast<float>(inside - 3) / 6.0F);
    }
  }
  return alpha;
}

cv::Mat premultiplied(const cv::Mat& colour, const cv::Mat& alpha, double gain) {
  cv::Mat image(colour.size(), CV_32FC4);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const auto& bgr = colour.at<cv::Vec3b>(y, x);
      const float a = alpha.at<float>(y, x);
      const float weight = a * static_cast<float>(gain);
      image.at<cv::Vec4f>(y, x) = {weight * bgr[0], weight * bgr[1], weight * bgr[2], a};
    }
  }
  return image;
}

// Means of two by two pixels; a last odd row or column is averaged with zeros.
cv::Mat halved(const cv::Mat& image) {
  cv::Mat half((image.rows + 1) / 2, (image.cols + 1) / 2, CV_32FC4, cv::Scalar::all(0));
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      half.at<cv::Vec4f>(y / 2, x / 2) += 0.25F * image.at<cv::Vec4f>(y, x);
    }
  }
  return half;
}

// The profile of an ellipse from the outline to the innermost point of the person.
cv::Mat rounded_relief(const cv::Mat& mask, double thickness) {
  cv::Mat padded;
  cv::copyMakeBorder(mask, padded, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::Mat inside;
  cv::distanceTransform(padded, inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  double deepest = 1.0;
  cv::minMaxLoc(inside, nullptr, &deepest);
  cv::Mat relief(mask.size(), CV_32FC1);
  for (int y = 0; y < relief.rows; ++y) {
    for (int x = 0; x < relief.cols; ++x) {
      const double outer = 1.0 - static_cast<double>(inside.at<float>(y + 1, x + 1)) / deepest;
      relief.at<float>(y, x) = static_cast<float>(thickness * std::sqrt(1.0 - outer * outer));
    }
  }
  return relief;
}

// Bilinear sample; 0 outside the image.
template <typename Value>
Value sample(const cv::Mat& image, float x, float y) {
  const float left = std::floor(x);
  const float top = std::floor(y);
  const float fx = x - left;
  const float fy = y - top;
  const auto at = [&](int i, int j) {
    const bool is_inside = i >= 0 && j >= 0 && i < image.cols && j < image.rows;
    return is_inside ? image.at<Value>(j, i) : Value();
  };
  const int ix = static_cast<int>(left);
  const int iy = static_cast<int>(top);
  const Value upper = at(ix, iy) * (1.0F - fx) + at(ix + 1, iy) * fx;
  const Value lower = at(ix, iy + 1) * (1.0F - fx) + at(ix + 1, iy + 1) * fx;
  return upper * (1.0F - fy) + lower * fy;
}

// The plane that the image of a person fills, in the camera frame. Points at z = t on the ray (x, y, 1).
struct Billboard {
  Eigen::Vector3f feet;
  Eigen::Vector3f normal;  // towards the camera, level
  Eigen::Vector3f side;    // to the right of the image
  Eigen::Vector3f up;

  float depth_on(const Eigen::Vector3f& ray) const {
    const float slope = normal.dot(ray);
    return std::abs(slope) > 1e-6F ? normal.dot(feet) / slope : -1.0F;
  }
};

}  // namespace

ComposedPerson::ComposedPerson(const PersonCutout& cutout, const PersonShape& shape) : shape_(shape) {
  cv::Mat colour = cutout.colour;
  cv::Mat mask = cutout.mask;
  if (shape.mirrored) {
    cv::flip(cutout.colour, colour, 1);
    cv::flip(cutout.mask, mask, 1);
  }
  levels_.push_back(premultiplied(colour, soft_mask(mask), shape.gain));
  while (std::min(levels_.back().rows, levels_.back().cols) >= 2 * kSmallestSide) {
    levels_.push_back(halved(levels_.back()));
  }
  relief_ = rounded_relief(mask, shape.thickness);
}

double ComposedPerson::width() const { return shape_.height * relief_.cols / relief_.rows; }

// The pyramid level whose pixels are about as large as the camera's: finer ones would alias.
std::size_t ComposedPerson::level_for(double distance, double fy) const {
  double texels = relief_.rows / shape_.height * distance / fy;
  std::size_t level = 0;
  for (; texels > 1.5 && level + 1 < levels_.size(); texels /= 2.0) ++level;
  return level;
}

PersonLayer ComposedPerson::seen_from(const SE3& T_world_camera, const PixelRays& rays,
                                      const Eigen::Vector3d& feet, const Eigen::Vector3d& up) const {
  const Eigen::Vector3d to_camera = T_world_camera.translation() - feet;
  const Eigen::Vector3d level = to_camera - up * up.dot(to_camera);
  if (!(level.norm() > kLeastAside)) return {};
  const Eigen::Matrix3d R_camera_world = T_world_camera.rotation().toRotationMatrix().transpose();
  const Eigen::Vector3d normal = level.normalized();
  const Billboard board{(R_camera_world * -to_camera).cast<float>(), (R_camera_world * normal).cast<float>(),
                        (R_camera_world * up.cross(normal)).cast<float>(),
                        (R_camera_world * up).cast<float>()};
  const std::size_t fineness = level_for(level.norm(), rays.camera().fy);
  const cv::Mat& image = levels_[fineness];
  const float texels = static_cast<float>(relief_.rows / shape_.height);
  const float scale = 1.0F / static_cast<float>(1U << fineness);
  const auto rows = static_cast<float>(relief_.rows);
  const auto cols = static_cast<float>(relief_.cols);
  PersonLayer layer{cv::Mat(rays.size(), CV_32FC3, cv::Scalar::all(0)),
                    cv::Mat(rays.size(), CV_32FC1, cv::Scalar(0)),
                    cv::Mat(rays.size(), CV_32FC1, cv::Scalar(0))};
  for (int y = 0; y < layer.alpha.rows; ++y) {
    const cv::Vec2f* row = rays.row(y);
    for (int x = 0; x < layer.alpha.cols; ++x) {
      const Eigen::Vector3f ray(row[x][0], row[x][1], 1.0F);
      const float z = board.depth_on(ray);
      if (!(z > static_cast<float>(kNearest))) continue;
      const Eigen::Vector3f hit = z * ray - board.feet;
      const float u = board.side.dot(hit) * texels + 0.5F * cols;  // in pixels of the finest image
      const float v = rows - board.up.dot(hit) * texels;
      if (!(u > -1.0F && v > -1.0F && u < cols + 1.0F && v < rows + 1.0F)) continue;
      const auto bgra = sample<cv::Vec4f>(image, u * scale - 0.5F, v * scale - 0.5F);
      layer.colour.at<cv::Vec3f>(y, x) = {bgra[0], bgra[1], bgra[2]};
      layer.alpha.at<float>(y, x) = bgra[3];
      if (bgra[3] <= 0.5F) continue;
      layer.depth.at<float>(y, x) = z - sample<float>(relief_, u - 0.5F, v - 0.5F) / ray.norm();
    }
  }
  return layer;
}

}  // namespace roslam::simulation
