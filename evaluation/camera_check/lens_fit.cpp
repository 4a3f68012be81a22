// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/lens_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <utility>

#include "roslam/common/upper_median.hpp"

namespace roslam::evaluation {

namespace {
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix62 = Eigen::Matrix<double, 6, 2>;

constexpr std::size_t kFewestPoints = 30;
constexpr double kFocalSigma = 0.015;  // relative error of a focal length as calibrated
constexpr double kMostError = 5.0;     // pixels

struct Lens2 {  // what is estimated beside the motions
  double k1 = 0.0;
  double focal = 0.0;  // relative

  Eigen::Vector2d distort(const Eigen::Vector2d& x) const {
    return (1.0 + focal) * (1.0 + k1 * x.squaredNorm()) * x;
  }
  Eigen::Vector2d undistort(const Eigen::Vector2d& m) const {
    Eigen::Vector2d x = m / (1.0 + focal);
    for (int i = 0; i < 6; ++i) x = m / ((1.0 + focal) * std::max(0.2, 1.0 + k1 * x.squaredNorm()));
    return x;
  }
};

struct Point {
  Eigen::Vector2d from, to;  // normalised, after the reading
  double z;
  Eigen::Matrix2d to_pixels;  // of a small displacement after the reading
  double radius;              // of its raw pixel from the centre, as a share of that of the corner
};

struct Pair {
  std::size_t index;
  std::size_t run;
  std::vector<Point> points;
  SE3 T_to_from;
  double scale = 1.0;  // of its errors, pixels
  double unit = 1.0;   // of its lengths, metres
};

struct Normal {  // equations of a pair, without its motion
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
};

// Normalised coordinates of a raw pixel under a reading.
std::optional<Eigen::Vector2d> read_pixel(const Camera& camera, LensReading reading,
                                          const Eigen::Vector2d& raw) {
  std::optional<Eigen::Vector2d> pixel = raw;
  if (reading == LensReading::kAsGiven) pixel = camera.try_undistort(raw);
  if (reading == LensReading::kInverse) pixel = camera.distort(raw);
  if (!pixel) return std::nullopt;
  return camera.unproject(*pixel, 1.0).head<2>();
}

std::optional<Point> point_of(const Camera& camera, LensReading reading, const TrackedPair& pair,
                              std::size_t i, const Alignment& alignment) {
  const auto z = pair.depth(i, alignment);
  const auto from = read_pixel(camera, reading, pair.from[i]), to = read_pixel(camera, reading, pair.to[i]);
  const auto right = read_pixel(camera, reading, pair.to[i] + Eigen::Vector2d(1.0, 0.0));
  const auto below = read_pixel(camera, reading, pair.to[i] + Eigen::Vector2d(0.0, 1.0));
  if (!z || !from || !to || !right || !below) return std::nullopt;
  Eigen::Matrix2d by_pixel;
  by_pixel << *right - *to, *below - *to;
  if (std::abs(by_pixel.determinant()) < 1e-10) return std::nullopt;
  const Eigen::Vector2d centre(camera.cx, camera.cy);
  const double corner = std::hypot(0.5 * camera.width, 0.5 * camera.height);
  return Point{*from, *to, *z, by_pixel.inverse(),
               std::max((pair.from[i] - centre).norm(), (pair.to[i] - centre).norm()) / corner};
}

Eigen::Vector2d error_of(const Point& point, const SE3& T, const Lens2& lens) {
  const Eigen::Vector3d moved = T * (point.z * lens.undistort(point.from).homogeneous());
  if (moved.z() < 1e-3 * point.z) return Eigen::Vector2d::Constant(1e3);
  return point.to_pixels * (lens.distort(moved.hnormalized()) - point.to);
}

Matrix26 by_motion(const Point& point, const SE3& T, const Lens2& lens) {
  const Eigen::Vector3d p = T * (point.z * lens.undistort(point.from).homogeneous());
  Eigen::Matrix<double, 2, 3> projection;
  projection << 1.0 / p.z(), 0.0, -p.x() / (p.z() * p.z()), 0.0, 1.0 / p.z(), -p.y() / (p.z() * p.z());
  Eigen::Matrix<double, 3, 6> motion;
  motion << Eigen::Matrix3d::Identity(), -skew(p);
  const Eigen::Vector2d x = p.hnormalized();
  const Eigen::Matrix2d distortion =
      (1.0 + lens.focal) *
      ((1.0 + lens.k1 * x.squaredNorm()) * Eigen::Matrix2d::Identity() + 2.0 * lens.k1 * x * x.transpose());
  return point.to_pixels * distortion * projection * motion;
}

Eigen::Matrix2d by_lens(const Point& point, const SE3& T, const Lens2& lens) {
  constexpr double kStep = 1e-5;
  const auto at = [&](double k1, double focal) {
    return error_of(point, T, {lens.k1 + k1, lens.focal + focal});
  };
  Eigen::Matrix2d J;
  J << (at(kStep, 0.0) - at(-kStep, 0.0)) / (2.0 * kStep), (at(0.0, kStep) - at(0.0, -kStep)) / (2.0 * kStep);
  return J;
}

// So that the fit does not depend on the scale of depth.
void normalise(Pair& pair) {
  std::vector<double> depths;
  for (const Point& point : pair.points) depths.push_back(point.z);
  pair.unit = upper_median(depths);
  for (Point& point : pair.points) point.z /= pair.unit;
}

bool start_motion(Pair& pair) {
  constexpr int kIterations = 200;
  constexpr float kInlier = 15.0F;  // pixels, as the lens may be wrong
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  double focal = 0.0;
  for (const Point& point : pair.points) {
    points.emplace_back(point.z * point.from.x(), point.z * point.from.y(), point.z);
    pixels.emplace_back(point.to.x(), point.to.y());
    focal += std::sqrt(std::abs(point.to_pixels.determinant())) / static_cast<double>(pair.points.size());
  }
  cv::Mat rotation = cv::Mat::zeros(3, 1, CV_64F), translation = cv::Mat::zeros(3, 1, CV_64F);
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(points, pixels, cv::Mat::eye(3, 3, CV_64F), {}, rotation, translation, false,
                          kIterations, kInlier / static_cast<float>(focal), 0.99, inliers) ||
      3 * inliers.size() < pair.points.size())
    return false;
  Eigen::Vector3d turn, t;
  cv::cv2eigen(rotation, turn);
  cv::cv2eigen(translation, t);
  pair.T_to_from = SE3(so3_exp(turn), t);
  return pair.T_to_from.is_finite();
}

void set_scale(Pair& pair, const Lens2& lens) {
  constexpr double kLeast = 0.3;  // pixels
  std::vector<double> errors;
  for (const Point& point : pair.points) errors.push_back(error_of(point, pair.T_to_from, lens).norm());
  pair.scale = std::max(kLeast, upper_median(errors));
}

// A step of the motion, and the equations of the lens that remain.
Normal step(Pair& pair, Lens2& lens, const Eigen::Vector2d& lens_step, bool moves) {
  Matrix6d A = Matrix6d::Identity() * 1e-9;
  Matrix62 B = Matrix62::Zero();
  Vector6d a = Vector6d::Zero();
  Normal normal;
  for (const Point& point : pair.points) {
    const Eigen::Vector2d error = error_of(point, pair.T_to_from, lens) / pair.scale;
    const double weight = 1.0 / ((1.0 + error.squaredNorm() / 4.0) * pair.scale * pair.scale);  // Cauchy
    const Matrix26 J = by_motion(point, pair.T_to_from, lens);
    const Eigen::Matrix2d K = by_lens(point, pair.T_to_from, lens);
    A += weight * J.transpose() * J;
    B += weight * J.transpose() * K;
    a += weight * pair.scale * J.transpose() * error;
    normal.H += weight * K.transpose() * K;
    normal.g += weight * pair.scale * K.transpose() * error;
  }
  const Eigen::LDLT<Matrix6d> solver(A);
  normal.H -= B.transpose() * solver.solve(B);
  normal.g -= B.transpose() * solver.solve(a);
  if (moves) pair.T_to_from = SE3::exp(-solver.solve(a + B * lens_step)) * pair.T_to_from;
  return normal;
}

struct Errors {
  double all = 0.0, outer = 0.0;
};

Errors errors_of(const std::vector<Pair>& pairs, const Lens2& lens) {
  constexpr double kOuter = 0.6;
  Errors sum;
  double count = 0.0, outer_count = 0.0;
  for (const Pair& pair : pairs) {
    for (const Point& point : pair.points) {
      const double error = std::min(kMostError, error_of(point, pair.T_to_from, lens).norm());
      sum.all += error;
      count += 1.0;
      if (point.radius < kOuter) continue;
      sum.outer += error;
      outer_count += 1.0;
    }
  }
  return {sum.all / std::max(count, 1.0), sum.outer / std::max(outer_count, 1.0)};
}

// Errors of depth move points along the epipolar line; errors in that direction weigh less, as of a sum of
// pixel noise and depth noise.
void allow_for_depth(std::vector<Pair>& pairs) {
  constexpr double kDepthError = 0.03;  // relative
  constexpr double kPixelError = 0.7;
  const Lens2 lens;
  for (Pair& pair : pairs) {
    for (Point& point : pair.points) {
      Point farther = point;
      farther.z *= 1.0 + kDepthError;
      const Eigen::Vector2d moved =
          error_of(farther, pair.T_to_from, lens) - error_of(point, pair.T_to_from, lens);
      const double by_depth = moved.norm() / kPixelError;
      if (by_depth < 1e-3) continue;
      const Eigen::Vector2d along = moved.normalized();
      const double reduced = 1.0 / std::sqrt(1.0 + by_depth * by_depth);
      const Eigen::Matrix2d whitening =
          Eigen::Matrix2d::Identity() - (1.0 - reduced) * along * along.transpose();
      point.to_pixels = whitening * point.to_pixels;
    }
  }
}

void fit_motions(std::vector<Pair>& pairs, Lens2 lens) {
  constexpr int kIterations = 6;
  for (Pair& pair : pairs) {
    for (int i = 0; i < kIterations; ++i) {
      set_scale(pair, lens);
      step(pair, lens, Eigen::Vector2d::Zero(), true);
    }
  }
}

// Gauss-Newton on the lens and all motions. Returns the covariance of the lens.
Eigen::Matrix2d fit_all(std::vector<Pair>& pairs, Lens2& lens, const std::stop_token& stop) {
  constexpr int kIterations = 12;
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  const Eigen::Vector2d prior(0.0, 1.0 / (kFocalSigma * kFocalSigma));
  for (int i = 0; i < kIterations && !stop.stop_requested(); ++i) {
    Eigen::Matrix2d H = prior.asDiagonal();
    Eigen::Vector2d g(0.0, prior.y() * lens.focal);
    std::map<std::size_t, Eigen::Vector2d> by_run;
    for (Pair& pair : pairs) {
      const Normal normal = step(pair, lens, Eigen::Vector2d::Zero(), false);
      H += normal.H;
      g += normal.g;
      by_run.try_emplace(pair.run, Eigen::Vector2d::Zero()).first->second += normal.g;
    }
    H += 1e-9 * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d inverse = H.inverse();
    const Eigen::Vector2d delta = -inverse * g;
    Eigen::Matrix2d scatter = prior.asDiagonal();
    for (const auto& [run, gradient] : by_run) scatter += gradient * gradient.transpose();
    covariance = inverse * scatter * inverse;
    for (Pair& pair : pairs) step(pair, lens, delta, true);
    lens.k1 = std::clamp(lens.k1 + delta.x(), -1.0, 1.0);
    lens.focal = std::clamp(lens.focal + delta.y(), -0.1, 0.1);
  }
  return covariance;
}
}  // namespace

LensFit fit_lens(const Camera& camera, LensReading reading, const std::vector<TrackedPair>& tracked,
                 const Alignment& alignment, const std::stop_token& stop) {
  LensFit fit;
  fit.T_to_from.resize(tracked.size());
  fit.has_motion.resize(tracked.size(), false);
  std::vector<Pair> pairs;
  std::vector<double> radii;
  for (std::size_t i = 0; i < tracked.size() && !stop.stop_requested(); ++i) {
    Pair pair{i, tracked[i].run, {}, {}};
    for (std::size_t j = 0; j < tracked[i].from.size(); ++j)
      if (auto point = point_of(camera, reading, tracked[i], j, alignment)) pair.points.push_back(*point);
    if (pair.points.size() < kFewestPoints) continue;
    normalise(pair);
    if (!start_motion(pair)) continue;
    for (const Point& point : pair.points) radii.push_back(point.radius);
    pairs.push_back(std::move(pair));
  }
  fit.pairs = pairs.size();
  fit.points = radii.size();
  if (pairs.empty()) return fit;
  std::sort(radii.begin(), radii.end());
  fit.outermost = radii[radii.size() * 95 / 100];
  Lens2 lens;
  fit_motions(pairs, lens);
  allow_for_depth(pairs);
  fit_motions(pairs, lens);
  const Errors errors = errors_of(pairs, lens);
  fit.error = errors.all;
  fit.outer_error = errors.outer;
  for (const Pair& pair : pairs) {
    fit.T_to_from[pair.index] = SE3(pair.T_to_from.rotation(), pair.unit * pair.T_to_from.translation());
    fit.has_motion[pair.index] = true;
  }
  const Eigen::Matrix2d covariance = fit_all(pairs, lens, stop);
  fit.free_error = errors_of(pairs, lens).all;
  fit.k1 = {lens.k1, std::sqrt(covariance(0, 0))};
  fit.focal = {lens.focal, std::sqrt(covariance(1, 1))};
  const double radius = std::hypot(0.5 * camera.width / camera.fx, 0.5 * camera.height / camera.fy);
  const double by_k1 = std::pow(radius, 3) * std::sqrt(camera.fx * camera.fy);
  fit.corner = {by_k1 * fit.k1.mean, by_k1 * fit.k1.sigma};
  return fit;
}

}  // namespace roslam::evaluation
