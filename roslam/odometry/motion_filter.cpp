// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/odometry/motion_filter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
// Standard deviations of what is not known of the velocity at first.
constexpr double kFirstSpeed = 2.0;     // m/s
constexpr double kFirstTurnRate = 1.0;  // rad/s

// Densities of the white accelerations of each model: calm, manoeuvre, gust.
constexpr std::array kLinear{0.02, 0.3, 1.5};    // m^2/s^3
constexpr std::array kAngular{0.02, 0.7, 20.0};  // rad^2/s^3
constexpr double kStays = 0.95;                  // probability that a model holds from one pose to the next

// Adds the covariance of white acceleration over a time to the blocks of a rate and of what is integrated. R:
// from the frame of the rate to that of the integral.
void add_noise(Matrix12d& covariance, int at, double density, double dt, const Eigen::Matrix3d& R) {
  const Eigen::Matrix3d cross = density * dt * dt / 2.0 * R;
  covariance.block<3, 3>(at, at).diagonal().array() += density * dt * dt * dt / 3.0;
  covariance.block<3, 3>(at, at + 6) += cross;
  covariance.block<3, 3>(at + 6, at) += cross.transpose();
  covariance.block<3, 3>(at + 6, at + 6).diagonal().array() += density * dt;
}

// The error of one state against another, in the coordinates of the covariance.
Vector12d difference(const FilteredMotion& a, const FilteredMotion& b) {
  Vector12d result;
  result << a.T_odom_body.translation() - b.T_odom_body.translation(),
      so3_log(a.T_odom_body.rotation() * b.T_odom_body.rotation().inverse()), a.velocity - b.velocity,
      a.turn_rate - b.turn_rate;
  return result;
}

void move(FilteredMotion& state, const Vector12d& change) {
  state.T_odom_body = SE3(so3_exp(change.segment<3>(3)) * state.T_odom_body.rotation(),
                          state.T_odom_body.translation() + change.head<3>());
  state.velocity += change.segment<3>(6);
  state.turn_rate += change.segment<3>(9);
}

// Mean and covariance of a mixture of states, about the one of most weight.
template <std::size_t N>
FilteredMotion mixture(const std::array<const FilteredMotion*, N>& states,
                       const std::array<double, N>& weights) {
  const auto best =
      static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin());
  Vector12d mean = Vector12d::Zero();
  for (std::size_t i = 0; i < N; ++i) mean += weights[i] * difference(*states[i], *states[best]);
  FilteredMotion result = *states[best];
  move(result, mean);
  result.covariance.setZero();
  result.step_covariance.setZero();
  for (std::size_t i = 0; i < N; ++i) {
    const Vector12d off = difference(*states[i], result);
    const Matrix12d spread = off * off.transpose();
    result.covariance += weights[i] * (states[i]->covariance + spread);
    result.step_covariance += weights[i] * (states[i]->step_covariance + spread.topLeftCorner<6, 6>());
  }
  return result;
}

// Of a measured pose against a state.
Vector6d innovation_of(const SE3& T_odom_body, const FilteredMotion& state) {
  FilteredMotion measured = state;
  measured.T_odom_body = T_odom_body;
  return difference(measured, state).head<6>();
}

// A pose that even a gust does not explain is wrong by some part: its covariance is widened along its
// deviation to the 99 % limit, as a change of the scene in view may move the pose by centimetres between two
// images.
Matrix6d robust(const FilteredMotion& predicted, const SE3& T_odom_body, const Matrix6d& covariance) {
  constexpr double kLimit = 11.34;  // chi-squared, 3 degrees of freedom
  const Vector6d innovation = innovation_of(T_odom_body, predicted);
  Matrix6d result = covariance;
  for (const int at : {0, 3}) {
    const Eigen::Vector3d off = innovation.segment<3>(at);
    const Eigen::Matrix3d S = predicted.covariance.block<3, 3>(at, at) + covariance.block<3, 3>(at, at);
    if (off.dot(S.ldlt().solve(off)) > kLimit) result.block<3, 3>(at, at) += off * off.transpose() / kLimit;
  }
  return result;
}
}  // namespace

void MotionFilter::start(double timestamp, const SE3& T_odom_body, const Matrix6d& covariance) {
  timestamp_ = timestamp;
  FilteredMotion first;
  first.T_odom_body = T_odom_body;
  first.covariance.setZero();
  first.covariance.topLeftCorner<6, 6>() = covariance;
  first.covariance.diagonal().segment<3>(6).setConstant(kFirstSpeed * kFirstSpeed);
  first.covariance.diagonal().segment<3>(9).setConstant(kFirstTurnRate * kFirstTurnRate);
  first.step_covariance = covariance;
  for (Model& model : models_) model = {first, 1.0 / kModels};
  combined_ = first;
}

void MotionFilter::predict(double timestamp) {
  const double dt = timestamp - timestamp_;
  timestamp_ = timestamp;
  mix();
  for (std::size_t i = 0; i < kModels; ++i) predict(models_[i], i, dt);
  combine();
}

// Each model goes on from what all found, weighted by how probable a change to it is.
void MotionFilter::mix() {
  std::array<Model, kModels> mixed;
  std::array<const FilteredMotion*, kModels> states{};
  for (std::size_t i = 0; i < kModels; ++i) states[i] = &models_[i].state;
  for (std::size_t j = 0; j < kModels; ++j) {
    std::array<double, kModels> weights{};
    double sum = 0.0;
    for (std::size_t i = 0; i < kModels; ++i) {
      weights[i] = models_[i].probability * (i == j ? kStays : (1.0 - kStays) / (kModels - 1));
      sum += weights[i];
    }
    for (double& weight : weights) weight /= sum;
    mixed[j].state = mixture(states, weights);
    mixed[j].probability = sum;
  }
  models_ = mixed;
}

void MotionFilter::predict(Model& model, std::size_t index, double dt) {
  FilteredMotion& s = model.state;
  const Eigen::Matrix3d R = s.T_odom_body.rotation().toRotationMatrix();
  const Eigen::Vector3d turn = s.turn_rate * dt;
  Matrix12d F = Matrix12d::Identity();
  F.block<3, 3>(0, 6) = dt * Eigen::Matrix3d::Identity();
  F.block<3, 3>(3, 9) = dt * R * so3_left_jacobian(turn);
  model.before = s.covariance.topLeftCorner<6, 6>();
  model.cross = s.covariance.topRows<6>() * F.transpose();
  s.covariance = (F * s.covariance * F.transpose()).eval();
  add_noise(s.covariance, 0, kLinear[index], dt, Eigen::Matrix3d::Identity());
  add_noise(s.covariance, 3, kAngular[index], dt, R);
  s.T_odom_body =
      SE3(s.T_odom_body.rotation() * so3_exp(turn), s.T_odom_body.translation() + s.velocity * dt);
}

void MotionFilter::update(const SE3& T_odom_body, const Matrix6d& covariance_of_pose) {
  const Matrix6d covariance = robust(models_.back().state, T_odom_body, covariance_of_pose);
  std::array<double, kModels> likelihoods{};
  for (std::size_t i = 0; i < kModels; ++i) likelihoods[i] = update(models_[i], T_odom_body, covariance);
  const double best = *std::max_element(likelihoods.begin(), likelihoods.end());
  double sum = 0.0;
  for (std::size_t i = 0; i < kModels; ++i) sum += models_[i].probability *= std::exp(likelihoods[i] - best);
  for (Model& model : models_) model.probability /= sum;
  combine();
}

// Returns the logarithm of the likelihood of the measurement, without a constant.
double MotionFilter::update(Model& model, const SE3& T_odom_body, const Matrix6d& covariance) {
  FilteredMotion& s = model.state;
  const Vector6d innovation = innovation_of(T_odom_body, s);
  const Eigen::LDLT<Matrix6d> S(s.covariance.topLeftCorner<6, 6>() + covariance);
  const Eigen::Matrix<double, 12, 6> K = S.solve(s.covariance.topRows<6>()).transpose();
  move(s, K * innovation);
  Matrix12d left = Matrix12d::Identity();
  left.leftCols<6>() -= K;
  s.covariance =
      (left * s.covariance * left.transpose() + K * covariance * K.transpose()).eval();  // Joseph's form
  model.cross = (model.cross * left.transpose()).eval();
  return -0.5 * (innovation.dot(S.solve(innovation)) + S.vectorD().array().max(1e-30).log().sum());
}

void MotionFilter::combine() {
  std::array<const FilteredMotion*, kModels> states{};
  std::array<double, kModels> weights{};
  for (std::size_t i = 0; i < kModels; ++i) {
    Model& model = models_[i];
    const Matrix6d cross = model.cross.leftCols<6>();
    model.state.step_covariance =
        model.before + model.state.covariance.topLeftCorner<6, 6>() - cross - cross.transpose();
    states[i] = &model.state;
    weights[i] = model.probability;
  }
  combined_ = mixture(states, weights);
}

}  // namespace roslam
