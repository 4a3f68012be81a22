// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/alignment.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace roslam {

namespace {
constexpr std::size_t kMinPoints = 3;
// Spread below this fraction of the points' magnitude is rounding, not motion.
constexpr double kRelativeRounding = 1e-12;

using Points = Eigen::Matrix3Xd;

Points columns(const std::vector<Eigen::Vector3d>& points) {
  Points matrix(3, static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < matrix.cols(); ++i) matrix.col(i) = points[static_cast<std::size_t>(i)];
  return matrix;
}

bool coincide(const Points& points, const Points& centred) {
  return centred.cwiseAbs().maxCoeff() <= kRelativeRounding * points.cwiseAbs().maxCoeff();
}
}  // namespace

std::optional<Alignment> align_points(const std::vector<Eigen::Vector3d>& source,
                               const std::vector<Eigen::Vector3d>& target, AlignmentModel model) {
  if (source.size() < kMinPoints || source.size() != target.size()) return std::nullopt;
  const Points from = columns(source);
  const Points to = columns(target);
  if (!from.allFinite() || !to.allFinite()) return std::nullopt;
  const Points from_centred = from.colwise() - from.rowwise().mean();
  const Points to_centred = to.colwise() - to.rowwise().mean();
  const bool with_scale = model == AlignmentModel::kSimilarity;
  if (with_scale && coincide(from, from_centred)) return std::nullopt;

  const Eigen::Matrix4d similarity = Eigen::umeyama(from, to, with_scale);
  if (!similarity.allFinite()) return std::nullopt;
  Alignment alignment;
  Eigen::Matrix3d rotation = similarity.topLeftCorner<3, 3>();
  if (with_scale) {
    alignment.scale = std::cbrt(rotation.determinant());
    if (!(alignment.scale > 0.0)) return std::nullopt;  // the target points coincide: the best scale is zero
    rotation /= alignment.scale;
  }
  alignment.T_target_source = SE3(rotation, similarity.topRightCorner<3, 1>());
  // The rotation is determined by the covariance having rank two or more (Umeyama 1991, section III).
  const Eigen::Matrix3d covariance = to_centred * from_centred.transpose();
  const Eigen::Vector3d singular = Eigen::JacobiSVD<Eigen::Matrix3d>(covariance).singularValues();
  alignment.unique_rotation = !coincide(from, from_centred) && !coincide(to, to_centred) &&
                              singular[1] > kRelativeRounding * singular[0];
  return alignment;
}

std::optional<SE3> align_poses(const std::vector<SE3>& source, const std::vector<SE3>& target) {
  if (source.empty() || source.size() != target.size()) return std::nullopt;
  // Sum of outer products, which is the same for a quaternion and its negative (one rotation).
  Eigen::Matrix4d products = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (!source[i].is_finite() || !target[i].is_finite()) return std::nullopt;
    const Eigen::Vector4d quaternion = (target[i].rotation() * source[i].rotation().conjugate()).coeffs();
    products += quaternion * quaternion.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(products);
  const Eigen::Quaterniond rotation(Eigen::Vector4d(solver.eigenvectors().col(3)));  // largest eigenvalue
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < source.size(); ++i)
    translation += target[i].translation() - rotation * source[i].translation();
  return SE3(rotation, translation / static_cast<double>(source.size()));
}

}  // namespace roslam
