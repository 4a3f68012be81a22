// SPDX-License-Identifier: BSD-3-Clause
// What an autopilot is sent: frames, covariances and times of poses, and the messages of each state.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "roslam/common/error.hpp"
#include "telemetry/mavlink/odometry_stream.hpp"
#include "telemetry/mavlink/stream_check.hpp"

namespace roslam::telemetry {
namespace {

using Clock = std::chrono::steady_clock;

const Eigen::Matrix3d kD = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();

SE3 random_pose(std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  return SE3::exp((Vector6d() << normal(random), normal(random), normal(random), 0.6 * normal(random),
                   0.6 * normal(random), 0.6 * normal(random))
                      .finished());
}

Matrix6d random_covariance(std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  Matrix6d A;
  for (int i = 0; i < 36; ++i) A(i / 6, i % 6) = normal(random);
  return 0.01 * A * A.transpose();
}

Odometry random_odometry(std::mt19937& random) {
  Odometry odometry;
  odometry.T_odom_body = random_pose(random);
  odometry.T_map_odom = random_pose(random);
  odometry.linear_velocity = random_pose(random).translation();
  odometry.angular_velocity = random_pose(random).translation();
  odometry.covariance = random_covariance(random);
  odometry.velocity_covariance = random_covariance(random);
  odometry.quality = 0.8;
  return odometry;
}

// Roll, pitch and yaw of R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Vector3d angles_of(const Eigen::Matrix3d& R) {
  return {std::atan2(R(2, 1), R(2, 2)), std::asin(-R(2, 0)), std::atan2(R(1, 0), R(0, 0))};
}

void expect_triangle(const std::array<float, 21>& found, const Matrix6d& truth) {
  std::size_t at = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column, ++at)
      EXPECT_NEAR(static_cast<double>(found[at]), truth(row, column), 1e-5 + 1e-4 * truth.norm())
          << row << " " << column;
}

TEST(OdometryMessage, IsThePoseBetweenFramesTurnedByAMatrix) {
  std::mt19937 random(3);
  for (int i = 0; i < 50; ++i) {
    const Odometry odometry = random_odometry(random);
    for (const PoseFrame frame : {PoseFrame::kOdom, PoseFrame::kMap}) {
      const Eigen::Matrix4d flu = frame == PoseFrame::kOdom
                                      ? odometry.T_odom_body.matrix()
                                      : (odometry.T_map_odom.matrix() * odometry.T_odom_body.matrix()).eval();
      const OdometryMessage m = odometry_message(frame, odometry);
      const Eigen::Matrix3d R = kD * flu.topLeftCorner<3, 3>() * kD;
      const Eigen::Quaternionf q(m.attitude[0], m.attitude[1], m.attitude[2], m.attitude[3]);
      EXPECT_LT((q.toRotationMatrix().cast<double>() - R).norm(), 1e-5);
      const Eigen::Vector3d p = kD * flu.topRightCorner<3, 1>();
      for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(k);
        EXPECT_NEAR(m.position[at], p(k), 1e-5);
        EXPECT_NEAR(m.velocity[at], (kD * odometry.linear_velocity)(k), 1e-5);
        EXPECT_NEAR(m.rates[at], (kD * odometry.angular_velocity)(k), 1e-5);
      }
      EXPECT_EQ(m.frame_id, 20);
      EXPECT_EQ(m.child_frame_id, 12);
      EXPECT_EQ(m.quality, 80);
    }
  }
}

// A drone that flies ahead, to its left and up, turned to the left.
TEST(OdometryMessage, TurnsLeftAndUpRound) {
  Odometry odometry;
  odometry.T_odom_body = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ())), {1, 2, 3});
  const OdometryMessage m = odometry_message(PoseFrame::kOdom, odometry);
  EXPECT_EQ(m.position, (std::array<float, 3>{1.0F, -2.0F, -3.0F}));
  EXPECT_NEAR(m.attitude[0], std::cos(0.15), 1e-6);
  EXPECT_NEAR(m.attitude[3], -std::sin(0.15), 1e-6);  // yaw is positive to the right
}

// The covariance of the angles by their numeric derivative.
TEST(OdometryMessage, HasTheCovarianceOfRollPitchAndYaw) {
  std::mt19937 random(5);
  for (int i = 0; i < 20; ++i) {
    const Odometry odometry = random_odometry(random);
    for (const PoseFrame frame : {PoseFrame::kOdom, PoseFrame::kMap}) {
      const Eigen::Matrix3d R_frame_odom = frame == PoseFrame::kOdom
                                               ? Eigen::Matrix3d::Identity().eval()
                                               : odometry.T_map_odom.rotation().toRotationMatrix();
      const Eigen::Matrix3d R_odom_body = odometry.T_odom_body.rotation().toRotationMatrix();
      const auto angles = [&](const Eigen::Vector3d& w) {
        return angles_of(kD * R_frame_odom * so3_exp(w).toRotationMatrix() * R_odom_body * kD);
      };
      if (std::abs(std::cos(angles(Eigen::Vector3d::Zero()).y())) < 0.15) continue;
      Matrix6d J = Matrix6d::Zero();
      J.topLeftCorner<3, 3>() = kD * R_frame_odom;
      constexpr double kStep = 1e-6;
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d w = kStep * Eigen::Vector3d::Unit(k);
        J.block<3, 1>(3, 3 + k) = (angles(w) - angles(-w)) / (2.0 * kStep);
      }
      const OdometryMessage m = odometry_message(frame, odometry);
      expect_triangle(m.pose_covariance, J * odometry.covariance * J.transpose());
    }
    Matrix6d D = Matrix6d::Zero();
    D.topLeftCorner<3, 3>() = D.bottomRightCorner<3, 3>() = kD;
    expect_triangle(odometry_message(PoseFrame::kOdom, odometry).velocity_covariance,
                    D * odometry.velocity_covariance * D);
  }
}

TEST(OdometryMessage, StaysFiniteWhereTheBodyPointsUp) {
  Odometry odometry;
  odometry.T_odom_body = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitY())),
                             Eigen::Vector3d::Zero());
  odometry.covariance = Matrix6d::Identity();
  const OdometryMessage m = odometry_message(PoseFrame::kOdom, odometry);
  expect_triangle(m.pose_covariance, Matrix6d::Identity());
}

TEST(OdometryMessage, SaysThatACovarianceIsUnknown) {
  Odometry odometry;
  odometry.covariance(2, 4) = std::nan("");
  EXPECT_TRUE(std::isnan(odometry_message(PoseFrame::kOdom, odometry).pose_covariance[0]));
}

TEST(OdometryMessage, BoundsQuality) {
  Odometry odometry;
  odometry.quality = 0.0;
  EXPECT_EQ(odometry_message(PoseFrame::kOdom, odometry).quality, 1);
  odometry.quality = 1.0;
  EXPECT_EQ(odometry_message(PoseFrame::kOdom, odometry).quality, 100);
  odometry.is_predicted = true;
  EXPECT_EQ(odometry_message(PoseFrame::kOdom, odometry).quality, 10);
}

Clock::time_point at(double seconds) {
  return Clock::time_point(
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds)));
}

// The transfer takes 20 ms and up to 15 ms more; the camera's clock is 50 ppm fast.
TEST(CompanionClock, RemovesJitterAndFollowsDrift) {
  std::mt19937 random(1);
  std::exponential_distribution<double> jitter(1.0 / 0.004);
  CompanionClock clock;
  double worst = 0.0, sum = 0.0;
  int frames = 0;
  std::uint64_t last = 0;
  for (int i = 0; i < 30 * 300; ++i) {
    const double truth = 100.0 + i / 30.0;  // on the steady clock
    const double timestamp = 1.7e9 + (i / 30.0) * (1.0 + 50e-6);
    const auto time = clock.time_of(timestamp, at(truth + 0.02 + std::min(0.015, jitter(random))));
    EXPECT_GT(time, last);
    last = time;
    if (i < 60) continue;
    const double error = 1e-6 * static_cast<double>(time) - (truth + 0.02);
    worst = std::max(worst, std::abs(error));
    sum += error;
    ++frames;
  }
  EXPECT_LT(worst, 0.003);  // 20 s of drift are 1 ms
  EXPECT_LT(std::abs(sum / frames), 0.001);
}

TEST(CompanionClock, BeginsAnewWithTheCamerasClock) {
  CompanionClock clock;
  clock.time_of(5000.0, at(10.0));
  EXPECT_EQ(clock.time_of(0.5, at(12.0), true), 12'000'000U);
  EXPECT_EQ(clock.time_of(1.5, at(13.2)), 13'000'000U);  // 200 ms late
  // A timestamp before the window is a clock that began anew, too.
  EXPECT_EQ(clock.time_of(0.1, at(14.0)), 14'000'000U);
}

// A flight that is told frame by frame, 30 a second.
class Script {
 public:
  explicit Script(const OdometryStreamOptions& options = {}) : stream_(options) {}

  TrackingReport& next(TrackingState state) {
    report_ = {};
    report_.timestamp = 1000.0 + frame_ / 30.0;
    report_.received = at(5.0 + frame_ / 30.0);
    report_.state = state;
    report_.submap = submap;
    ++frame_;
    const bool has_pose = state == TrackingState::kTracking || state == TrackingState::kPredicted;
    if (!has_pose) return report_;
    Odometry odometry;
    odometry.timestamp = report_.timestamp;
    odometry.T_odom_body = SE3(Eigen::Quaterniond::Identity(), {0.01 * frame_, 0.0, 0.0});
    odometry.T_map_odom = T_map_odom;
    odometry.linear_velocity = {0.3, 0.0, 0.0};
    odometry.covariance = odometry.velocity_covariance = 1e-4 * Matrix6d::Identity();
    odometry.quality = 0.9;
    odometry.resets = resets;
    odometry.is_predicted = state == TrackingState::kPredicted;
    report_.odometry = odometry;
    return report_;
  }

  void send() { send(report_); }
  void send(const TrackingReport& report) {
    for (const MavlinkMessage& message : stream_.add(report)) {
      if (const auto* pose = std::get_if<OdometryMessage>(&message)) poses.push_back(*pose);
      if (const auto* text = std::get_if<StatusTextMessage>(&message))
        texts.emplace_back(text->severity, std::string(text->words()));
    }
  }
  void fly(TrackingState state, int frames) {
    for (int i = 0; i < frames; ++i) send(next(state));
  }

  const OdometryStream& stream() const { return stream_; }

  SubmapId submap{0};
  std::size_t resets = 0;
  SE3 T_map_odom;
  std::vector<OdometryMessage> poses;
  std::vector<std::pair<int, std::string>> texts;

 private:
  OdometryStream stream_;
  TrackingReport report_;
  int frame_ = 0;
};

using enum TrackingState;

TEST(OdometryStream, SendsEachPoseOnceAndNothingWhileLost) {
  Script flight;
  flight.fly(kInitialising, 5);
  EXPECT_EQ(flight.stream().state(), MavlinkState::kStandby);
  EXPECT_TRUE(flight.poses.empty());
  EXPECT_TRUE(flight.texts.empty());
  flight.fly(kTracking, 30);
  EXPECT_EQ(flight.stream().state(), MavlinkState::kActive);
  EXPECT_EQ(flight.poses.size(), 30U);
  flight.fly(kRecentlyLost, 20);
  flight.fly(kLost, 40);
  EXPECT_EQ(flight.stream().state(), MavlinkState::kCritical);
  EXPECT_EQ(flight.poses.size(), 30U);
  flight.resets = 1;
  flight.fly(kTracking, 10);
  ASSERT_EQ(flight.poses.size(), 40U);
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(flight.poses[i].reset_counter, i < 30 ? 0 : 1);
    if (i > 0) {
      EXPECT_GT(flight.poses[i].time_usec, flight.poses[i - 1].time_usec);
    }
    if (i > 0) {
      EXPECT_NE(flight.poses[i].position, flight.poses[i - 1].position);
    }
  }
  EXPECT_EQ(flight.stream().counts().without_pose, 65U);
  ASSERT_EQ(flight.texts.size(), 3U);
  EXPECT_EQ(flight.texts[0].second, "RO-SLAM: tracking, reset counter 0");
  EXPECT_EQ(flight.texts[1].first, 4);  // a warning
  EXPECT_EQ(flight.texts[1].second.substr(0, 13), "RO-SLAM: lost");
  EXPECT_EQ(flight.texts[2], std::make_pair(5, std::string("RO-SLAM: tracking again, reset counter 1")));
}

TEST(OdometryStream, IsOnTheClockOfThisComputer) {
  Script flight;
  flight.fly(kTracking, 3);
  EXPECT_EQ(flight.poses[0].time_usec, 5'000'000U);
  EXPECT_NEAR(static_cast<double>(flight.poses[2].time_usec), 5e6 + 2e6 / 30.0, 2.0);
  OdometryStreamOptions options;
  options.mode = Mode::kDeterministic;
  Script repeated(options);
  repeated.fly(kTracking, 1);
  EXPECT_EQ(repeated.poses[0].time_usec, 1'000'000'000U);  // the timestamp of the frame
}

TEST(OdometryStream, SendsPredictedPosesOnlyIfAsked) {
  for (const bool is_asked : {false, true}) {
    OdometryStreamOptions options;
    options.sends_predicted = is_asked;
    Script flight(options);
    flight.fly(kTracking, 10);
    flight.fly(kPredicted, 5);
    EXPECT_EQ(flight.stream().state(), MavlinkState::kActive);
    flight.fly(kTracking, 5);
    EXPECT_EQ(flight.poses.size(), is_asked ? 20U : 15U);
    EXPECT_EQ(flight.stream().counts().predicted_unsent, is_asked ? 0U : 5U);
    if (is_asked) {
      EXPECT_LE(flight.poses[12].quality, 10);
    }
    EXPECT_EQ(flight.texts.size(), 1U);  // that it tracks; a prediction is no loss
  }
}

TEST(OdometryStream, TellsOfNewSubmapsAndOfResetsWithoutALoss) {
  Script flight;
  flight.fly(kTracking, 60);
  flight.submap = SubmapId{1};
  flight.resets = 1;
  flight.fly(kTracking, 60);
  flight.submap = SubmapId{0};  // merged: no new one, no reset
  flight.fly(kTracking, 60);
  flight.resets = 257;
  flight.fly(kTracking, 1);
  ASSERT_EQ(flight.texts.size(), 3U);
  EXPECT_EQ(flight.texts[1].second, "RO-SLAM: new submap, reset counter 1");
  EXPECT_EQ(flight.texts[2].second, "RO-SLAM: position restarts, reset counter 1");
  EXPECT_EQ(flight.poses.back().reset_counter, 1);  // modulo 256
}

TEST(OdometryStream, RaisesTheCounterWhereThePoseInTheMapJumps) {
  for (const PoseFrame frame : {PoseFrame::kOdom, PoseFrame::kMap}) {
    OdometryStreamOptions options;
    options.frame = frame;
    Script flight(options);
    flight.fly(kTracking, 10);
    const auto move = [&](double metres, double degrees) {
      // Turned about the body, so that it is not moved as well.
      const SE3 T_odom_body = flight.next(kTracking).odometry->T_odom_body;
      const SE3 turn(Eigen::Quaterniond(Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitZ())),
                     {0.0, metres, 0.0});
      flight.T_map_odom = flight.T_map_odom * (T_odom_body * turn * T_odom_body.inverse());
      flight.fly(kTracking, 1);
      return flight.poses.back().reset_counter;
    };
    const int step = frame == PoseFrame::kMap ? 1 : 0;
    EXPECT_EQ(move(0.03, 0.0), 0);
    EXPECT_EQ(move(0.0, 0.8), 0);
    EXPECT_EQ(move(0.07, 0.0), step);
    EXPECT_EQ(move(0.0, 1.2), 2 * step);
    EXPECT_EQ(move(0.0, 0.0), 2 * step);
    EXPECT_NEAR(flight.poses.back().position[1], frame == PoseFrame::kMap ? -0.1 : 0.0, 0.01);
    flight.resets = 1;
    EXPECT_EQ(move(2.0, 0.0), 2 * step + 1);  // one reset, not two
  }
}

TEST(OdometryStream, ThinsFramesToTheRate) {
  OdometryStreamOptions options;
  options.rate = 20.0;
  Script flight(options);
  flight.fly(kTracking, 300);
  EXPECT_NEAR(static_cast<double>(flight.poses.size()), 200.0, 2.0);
  EXPECT_EQ(flight.stream().counts().above_rate + flight.poses.size(), 300U);
}

TEST(OdometryStream, SendsNoPoseThatIsNotFinite) {
  Script flight;
  flight.fly(kTracking, 2);
  flight.next(kTracking).odometry->linear_velocity.x() = std::nan("");
  flight.send();
  EXPECT_EQ(flight.poses.size(), 2U);
  EXPECT_EQ(flight.stream().counts().not_finite, 1U);
}

TEST(OdometryStream, LeavesOutTextsOfAStateThatFlickers) {
  Script flight;
  for (int i = 0; i < 150; ++i) {
    flight.fly(kTracking, 1);
    flight.fly(kRecentlyLost, 1);
  }
  EXPECT_LE(flight.texts.size(), 16U);  // in 10 s
  EXPECT_EQ(flight.texts.size() + flight.stream().counts().texts_left_out, 300U);
  EXPECT_EQ(flight.poses.size(), 150U);
}

TEST(OdometryStream, ChecksItsOptions) {
  OdometryStreamOptions options;
  options.rate = 0.0;
  EXPECT_THROW(OdometryStream{options}, OptionsError);
  options = {};
  options.map_jump = std::nan("");
  EXPECT_THROW(OdometryStream{options}, OptionsError);
}

TEST(StreamCheck, MeasuresWhatWouldBeSent) {
  Script flight;
  std::vector<TrackingReport> reports;
  const auto fly = [&](TrackingState state, int frames) {
    for (int i = 0; i < frames; ++i) reports.push_back(flight.next(state));
  };
  fly(kInitialising, 3);
  fly(kTracking, 90);
  fly(kPredicted, 8);
  fly(kTracking, 9);
  fly(kRecentlyLost, 30);
  flight.resets = 1;
  fly(kTracking, 60);
  const StreamCheck check = check_stream(reports, {});
  EXPECT_NEAR(check.duration, 199.0 / 30.0, 1e-6);
  EXPECT_EQ(check.counts.odometry, 159U);
  ASSERT_EQ(check.states.size(), 4U);
  EXPECT_EQ(check.states[1].state, kTracking);
  EXPECT_EQ(check.states[1].messages, 159U);
  EXPECT_NEAR(check.rate, 30.0, 0.1);
  EXPECT_EQ(check.long_gaps, 2U);
  EXPECT_NEAR(check.longest_gap, 31.0 / 30.0, 1e-4);
  EXPECT_NEAR(check.longest_gap_tracking, 0.3, 1e-4);  // eight predicted frames
  EXPECT_EQ(check.resets, 1U);
  EXPECT_NEAR(check.largest_step, 0.09, 1e-4);
  EXPECT_NEAR(check.largest_surprise, 0.0, 1e-3);
  EXPECT_NEAR(check.position_sigma.median, std::sqrt(3e-4), 1e-6);
  EXPECT_EQ(check.texts.size(), 3U);
  // In the last second 30 poses of 245 bytes, or one more, and a heartbeat.
  EXPECT_GE(check.most_bytes, 30 * 245 + 21);
  EXPECT_LE(check.most_bytes, 32 * 245 + 2 * 66);
  EXPECT_FALSE(check.is_ready());
  for (const StreamRule& rule : check.rules)
    EXPECT_EQ(rule.is_met, rule.demand.find("gap") == std::string::npos) << rule.demand << " " << rule.found;
}

TEST(StreamCheck, ApprovesOfASteadyFlightAndOfNoneAtAllNot) {
  Script flight;
  std::vector<TrackingReport> reports;
  EXPECT_FALSE(check_stream(reports, {}).is_ready());
  for (int i = 0; i < 90; ++i) reports.push_back(flight.next(kTracking));
  EXPECT_TRUE(check_stream(reports, {}).is_ready());
  // A jump that no reset explains, and a body that is not level at first.
  reports[50].odometry->T_odom_body = SE3(Eigen::Quaterniond::Identity(), {3.0, 0.0, 0.0});
  reports[0].odometry->T_odom_body =
      SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX())), Eigen::Vector3d::Zero());
  const StreamCheck check = check_stream(reports, {});
  EXPECT_NEAR(check.first_tilt, 0.2 * 180 / M_PI, 1e-3);
  int unmet = 0;
  for (const StreamRule& rule : check.rules) unmet += rule.is_met ? 0 : 1;
  EXPECT_EQ(unmet, 2);
}

}  // namespace
}  // namespace roslam::telemetry
