// SPDX-License-Identifier: BSD-3-Clause
// Rotations by a gyroscope and its bias: exact motions, the simulated unit, and a real one with truth.
#include "roslam/sensors/gyroscope.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/common/upper_median.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/slam/run.hpp"
#include "roslam/slam/slam.hpp"
#include "simulation/simulated_imu.hpp"
#include "simulation/simulated_source.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

ImuCalibration turned_unit() {
  return {SE3(so3_exp(Vector3d(0.3, -1.2, 0.8)), Vector3d(0.01, 0.02, 0.03)), 2e-3, 5e-5};
}

// Samples at 200 Hz of a constant rate in the frame of the unit.
std::vector<InertialSample> constant(const Vector3d& rate, double from, double to) {
  std::vector<InertialSample> samples;
  const auto count = std::lround((to - from) * 200.0);
  for (long i = 0; i <= count; ++i) samples.push_back({from + static_cast<double>(i) / 200.0, rate});
  return samples;
}

double angle_between(const Quaterniond& a, const Quaterniond& b) { return so3_log(a * b.inverse()).norm(); }

TEST(Gyroscope, IntegratesAConstantRateExactlyInTheFrameOfTheCamera) {
  const ImuCalibration unit = turned_unit();
  Gyroscope gyroscope(unit);
  const Vector3d rate(0.4, -0.9, 1.3);
  gyroscope.add(constant(rate, 0.0, 2.0), 2.0);
  // Ends between samples as well.
  for (const auto& [from, to] : {std::pair(0.0, 1.0), {0.1234, 0.1301}, {0.5017, 1.9961}}) {
    const auto turn = gyroscope.turn(from, to);
    ASSERT_TRUE(turn);
    // The unit turns by exp(rate t); coordinates of fixed directions turn the other way.
    const Quaterniond R = unit.T_camera_imu.rotation();
    const Quaterniond expected = R * so3_exp(-rate * (to - from)) * R.inverse();
    EXPECT_LT(angle_between(turn->R_to_from, expected), 1e-9);
  }
}

TEST(Gyroscope, CovarianceIsThatOfBiasAndWhiteNoise) {
  Gyroscope gyroscope(turned_unit());
  gyroscope.add(constant(Vector3d::Zero(), 0.0, 2.0), 2.0);
  const auto turn = gyroscope.turn(0.5, 1.5);
  ASSERT_TRUE(turn);
  // At rest: the first sigma of the bias (0.1 rad/s) over a second, and 2e-3 rad/s/sqrt(Hz) likewise.
  EXPECT_NEAR(std::sqrt(turn->covariance(0, 0)), std::hypot(0.1, 2e-3), 1e-6);
  EXPECT_NEAR(turn->covariance(0, 1), 0.0, 1e-9);
}

TEST(Gyroscope, KnowsNoRotationWhereSamplesAreMissing) {
  Gyroscope gyroscope(turned_unit());
  EXPECT_FALSE(gyroscope.turn(0.0, 0.1));
  gyroscope.add(constant(Vector3d::UnitX(), 0.0, 0.5), 0.5);
  gyroscope.add(constant(Vector3d::UnitX(), 0.8, 1.2), 1.2);
  EXPECT_TRUE(gyroscope.turn(0.1, 0.4));
  EXPECT_FALSE(gyroscope.turn(-0.1, 0.4));  // before the first
  EXPECT_FALSE(gyroscope.turn(0.4, 0.9));   // over the gap
  EXPECT_TRUE(gyroscope.turn(0.9, 1.23));   // a little beyond the newest
  EXPECT_FALSE(gyroscope.turn(0.9, 1.4));
  EXPECT_FALSE(gyroscope.turn(0.4, 0.4));
  gyroscope.restart_clock();
  EXPECT_FALSE(gyroscope.turn(0.9, 1.1));
}

TEST(Gyroscope, SkipsAndCountsWhatIsNoSample) {
  Gyroscope gyroscope(turned_unit());
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  auto samples = constant(Vector3d::UnitZ(), 0.0, 1.0);
  gyroscope.add(samples, 1.0);
  const std::vector<InertialSample> bad{{0.5, Vector3d::Zero()},      // backwards in time
                                        {1.0, Vector3d::Zero()},      // the same time
                                        {kNaN, Vector3d::Zero()},     // no time
                                        {1.1, Vector3d(kNaN, 0, 0)},  // no number
                                        {1.1, Vector3d(1e6, 0, 0)},   // impossible
                                        {1e12, Vector3d::Zero()}};    // of another clock
  gyroscope.add(bad, 1.1);
  EXPECT_EQ(gyroscope.state().skipped, bad.size());
  EXPECT_EQ(gyroscope.state().samples, samples.size());
  EXPECT_NEAR(gyroscope.turn(0.0, 1.0)->R_to_from.angularDistance(Quaterniond::Identity()), 1.0, 1e-9);
}

TEST(Gyroscope, KeepsSecondsHoweverLongTheFlight) {
  Gyroscope gyroscope(turned_unit());
  for (int second = 0; second < 100; ++second)
    gyroscope.add(constant(Vector3d::UnitX(), second + 0.001, second + 0.991), second + 1.0);
  EXPECT_TRUE(gyroscope.turn(99.1, 99.5));
  EXPECT_FALSE(gyroscope.turn(90.1, 90.5));
}

// Rotations as a camera would see them, with noise, on the simulated flight.
struct Flown {
  Gyroscope gyroscope;
  Vector3d bias;  // the true one at the end

  Flown(const ImuCalibration& calibration, double seconds, double sigma, std::uint32_t seed)
      : gyroscope(calibration) {
    simulation::SimulatorOptions options;
    options.path = simulation::FlightPath::kHover;
    options.gusts = 1.0;
    options.seed = seed;
    const simulation::Flight flight(options);
    cv::RNG random(seed);
    constexpr double kInterval = 0.1;
    for (double time = 0.0; time < seconds; time += kInterval) {
      const double to = time + kInterval;
      gyroscope.add(simulation::inertial_samples(flight, time - (time == 0.0 ? 0.01 : 0.0), to, seed), to);
      const SE3 T = flight.T_world_camera(to).inverse() * flight.T_world_camera(time);
      const Vector3d noise(random.gaussian(sigma), random.gaussian(sigma), random.gaussian(sigma));
      gyroscope.correct(time, to,
                        {so3_exp(noise) * T.rotation(), sigma * sigma * Eigen::Matrix3d::Identity()});
    }
    bias = simulation::gyroscope_bias(seconds, seed);
  }
};

TEST(Gyroscope, LearnsTheBiasOfTheSimulatedUnit) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const Flown flown(simulation::simulated_imu(), 20.0, 0.002, seed);
    const GyroscopeState state = flown.gyroscope.state();
    EXPECT_TRUE(state.agrees);
    EXPECT_GT(flown.bias.norm(), 0.005);
    EXPECT_LT((state.bias - flown.bias).norm(), 0.004) << state.bias.transpose();
    EXPECT_LT(state.bias_sigma.maxCoeff(), 0.004);
    EXPECT_GT(state.bias_sigma.minCoeff(), 0.0002);
  }
}

TEST(Gyroscope, ContradictsARotationThatIsWrong) {
  const Flown flown(simulation::simulated_imu(), 5.0, 0.002, 1);
  const auto turn = flown.gyroscope.turn(4.8, 4.9);
  ASSERT_TRUE(turn);
  const Eigen::Matrix3d covariance = 1e-6 * Eigen::Matrix3d::Identity();
  const auto off_by = [&](double degrees) {
    return Turn{so3_exp(Vector3d(0, degrees * kDegree, 0)) * turn->R_to_from, covariance};
  };
  EXPECT_FALSE(flown.gyroscope.contradicts(4.8, 4.9, off_by(0.0)));
  EXPECT_FALSE(flown.gyroscope.contradicts(4.8, 4.9, off_by(1.0)));
  EXPECT_TRUE(flown.gyroscope.contradicts(4.8, 4.9, off_by(4.0)));
  EXPECT_FALSE(flown.gyroscope.contradicts(9.8, 9.9, off_by(4.0))) << "no samples there";
}

TEST(Gyroscope, AWrongMountingIsNoticed) {
  ImuCalibration wrong = simulation::simulated_imu();
  wrong.T_camera_imu = SE3(so3_exp(Vector3d(0, 0, std::numbers::pi / 2)) * wrong.T_camera_imu.rotation(),
                           wrong.T_camera_imu.translation());
  const Flown flown(wrong, 20.0, 0.002, 1);
  EXPECT_FALSE(flown.gyroscope.agrees_with_images());
  EXPECT_FALSE(flown.gyroscope.contradicts(19.8, 19.9, {Quaterniond(0, 1, 0, 0), Eigen::Matrix3d::Zero()}));
}

TEST(ImuCalibration, RefusesWhatIsAbsurd) {
  ImuCalibration unit;
  unit.gyroscope_noise = 0.0;
  EXPECT_THROW(Gyroscope{unit}, CalibrationError);
  unit = {};
  unit.gyroscope_walk = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(unit.validate(), CalibrationError);
  unit = {};
  unit.T_camera_imu = SE3(Quaterniond::Identity(), Vector3d(30.0, 0, 0));  // millimetres
  EXPECT_THROW(unit.validate(), CalibrationError);
}

class InertialFiles : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path put(const std::string& text) const {
    const fs::path file = folder_ / "imu.txt";
    std::ofstream(file) << text;
    return file;
  }

  const fs::path folder_ = scratch_path();
};

TEST_F(InertialFiles, AreSortedAndCounted) {
  const auto file =
      read_inertial_file(put("# timestamp wx wy wz ax ay az\n"
                             "1.5 1 2 3 4 5 6\n"
                             "1.0,7,8,9,10,11,12\n"
                             "\n"
                             "1.5 0 0 0 0 0 0\n"
                             "2.0 1 2 nan 4 5 6\n"
                             "2.5 1 2 3\n"
                             "words\n"));
  ASSERT_EQ(file.samples.size(), 2U);
  EXPECT_EQ(file.skipped, 4U);
  EXPECT_EQ(file.samples[0].timestamp, 1.0);
  EXPECT_EQ(file.samples[0].turn_rate, Vector3d(7, 8, 9));
  EXPECT_EQ(file.samples[1].acceleration, Vector3d(4, 5, 6));
  EXPECT_THROW(read_inertial_file(put("# nothing\n")), InputError);
  EXPECT_THROW(read_inertial_file(folder_ / "absent.txt"), InputError);
}

TEST_F(InertialFiles, TheCalibrationIsReadAsItIsWritten) {
  Camera camera = *camera_preset("simulated");
  camera.imu = turned_unit();
  const fs::path file = folder_ / "camera.yaml";
  std::ofstream(file) << camera_to_yaml(camera);
  const Camera read = read_camera(file);
  ASSERT_TRUE(read.imu);
  EXPECT_LT(angle_between(read.imu->T_camera_imu.rotation(), camera.imu->T_camera_imu.rotation()), 1e-9);
  EXPECT_TRUE(read.imu->T_camera_imu.translation().isApprox(camera.imu->T_camera_imu.translation(), 1e-9));
  EXPECT_EQ(read.imu->gyroscope_noise, camera.imu->gyroscope_noise);
  std::string mirrored = camera_to_yaml(camera);
  const auto begin = mirrored.find("T_camera_imu: [") + 15;
  mirrored.replace(begin, mirrored.find(']', begin) - begin, "1,0,0,0, 0,1,0,0, 0,0,-1,0, 0,0,0,1");
  std::ofstream(file) << mirrored;
  EXPECT_THROW(read_camera(file), CalibrationError);
}

// Without knowing the truth: by the rotations that are tracked.
TEST(GyroscopeInFlight, ItsBiasIsLearntWhileTheMapIsMade) {
  simulation::SimulatorOptions simulated;
  simulated.path = simulation::FlightPath::kHover;
  simulated.traffic = simulation::TrafficLevel::kNone;
  simulated.fps = 10.0;
  simulated.frames = 60;
  simulated.gusts = 1.0;
  simulated.imu = true;
  simulation::SimulatedSource source(simulated);
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(source.camera(), options, Mode::kDeterministic);
  run_slam(source, slam);
  EXPECT_EQ(slam.trajectory().size(), 60U);
  const auto state = slam.gyroscope();
  ASSERT_TRUE(state);
  EXPECT_TRUE(state->agrees);
  EXPECT_EQ(state->skipped, 0U);
  EXPECT_LT((state->bias - simulation::gyroscope_bias(6.0, simulated.seed)).norm(), 0.006);
  options.tracker.use_gyroscope = false;
  EXPECT_FALSE(Slam(source.camera(), options, Mode::kDeterministic).gyroscope());
}

// A real unit with motion capture: EuRoC V1_01.
class RealGyroscope : public testing::Test {
 protected:
  void SetUp() override {
    const fs::path folder = fs::path(ROSLAM_TEST_DATA) / "imu" / "euroc_v101";
    if (!fs::exists(folder / "imu0.csv.gz")) GTEST_SKIP() << folder << " is not there";
    fs::create_directories(scratch_);
    for (const char* name : {"imu0.csv", "groundtruth.csv"}) {
      const std::string command = "gzip -dc '" + (folder / (std::string(name) + ".gz")).string() + "' >'" +
                                  (scratch_ / name).string() + "'";
      ASSERT_EQ(std::system(command.c_str()), 0);
    }
    samples_ = read_inertial_file(scratch_ / "imu0.csv").samples;
    for (auto& sample : samples_) sample.timestamp = (sample.timestamp - kBegin) * 1e-9;
    std::ifstream truth(scratch_ / "groundtruth.csv");
    for (std::string line; std::getline(truth, line);) {
      if (line.starts_with('#')) continue;
      std::replace(line.begin(), line.end(), ',', ' ');
      std::istringstream in(line);
      double time = 0.0;
      Vector3d p;
      Quaterniond q;
      in >> time >> p.x() >> p.y() >> p.z() >> q.w() >> q.x() >> q.y() >> q.z();
      truth_.push_back({(time - kBegin) * 1e-9, q.normalized()});
    }
  }
  void TearDown() override { fs::remove_all(scratch_); }

  struct Attitude {
    double time;
    Quaterniond R_world_imu;
  };

  // Errors (degrees) of rotations predicted over an interval of so many poses, after so many seconds of
  // flight; the bias is learnt from poses a tenth of a second apart, if at all.
  std::vector<double> errors(std::size_t interval, double after, bool learn, Gyroscope& gyroscope) const {
    std::vector<double> result;
    std::size_t fed = 0;
    for (std::size_t k = 0; k < truth_.size(); ++k) {
      std::vector<InertialSample> samples;
      while (fed < samples_.size() && samples_[fed].timestamp <= truth_[k].time)
        samples.push_back(samples_[fed++]);
      gyroscope.add(samples, truth_[k].time);
      const auto seen = [&](std::size_t earlier) {
        const Attitude& from = truth_[k - earlier];
        return truth_[k].R_world_imu.inverse() * from.R_world_imu;
      };
      if (k >= interval && truth_[k].time > after) {
        if (const auto turn = gyroscope.turn(truth_[k - interval].time, truth_[k].time))
          result.push_back(angle_between(turn->R_to_from, seen(interval)) / kDegree);
      }
      if (learn && k >= 2 && k % 2 == 0)
        gyroscope.correct(truth_[k - 2].time, truth_[k].time, {seen(2), 1e-6 * Eigen::Matrix3d::Identity()});
    }
    return result;
  }

  static constexpr double kBegin = 1403715273262142976.0;  // ns
  const fs::path scratch_ = scratch_path();
  std::vector<InertialSample> samples_;
  std::vector<Attitude> truth_;
};

TEST_F(RealGyroscope, PredictsRotationsOnceItsBiasIsLearnt) {
  const ImuCalibration unit{SE3(), 1.7e-4, 2e-5};
  Gyroscope gyroscope(unit);
  auto image = errors(2, 5.0, true, gyroscope);  // a tenth of a second, as between images at 10 Hz
  ASSERT_GT(image.size(), 2000U);
  EXPECT_LT(upper_median(image), 0.15);
  const GyroscopeState state = gyroscope.state();
  EXPECT_TRUE(state.agrees);
  EXPECT_EQ(state.skipped, 0U);
  // Known of this flight from its estimators: about (-0.002, 0.021, 0.077) rad/s.
  EXPECT_LT((state.bias - Vector3d(-0.0022, 0.0208, 0.0764)).norm(), 0.003) << state.bias.transpose();
  Gyroscope another(unit);
  auto second = errors(20, 5.0, true, another);
  EXPECT_LT(upper_median(second), 0.3);
  Gyroscope unlearnt(unit);
  auto without = errors(20, 5.0, false, unlearnt);
  EXPECT_GT(upper_median(without), 4.0);
}

}  // namespace
}  // namespace roslam
