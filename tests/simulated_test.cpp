// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>

#include "roslam/common/error.hpp"
#include "simulation/depth_noise.hpp"
#include "simulation/simulated_corridor.hpp"
#include "simulation/simulated_imu.hpp"
#include "simulation/simulated_source.hpp"
#include "tests/scratch.hpp"

namespace roslam {

using namespace simulation;
namespace {

namespace fs = std::filesystem;

SimulatorOptions options_for(FlightPath path, TrafficLevel traffic, DepthModel depth = DepthModel::kIdeal) {
  SimulatorOptions options;
  options.path = path;
  options.traffic = traffic;
  options.depth = depth;
  return options;
}

bool same_bytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

bool movable(int label) { return label == 11 || label == 12 || label == 13 || label == 18; }

TEST(Simulator, GivesTheSameBytesInAnyOrder) {
  const auto options = options_for(FlightPath::kStreet, TrafficLevel::kLight, DepthModel::kD455);
  Simulator forwards(options);
  Simulator backwards(options);
  const auto a3 = forwards.render(3, SimulatedParts::kBackground);
  const auto a90 = forwards.render(90);
  const auto b90 = backwards.render(90, SimulatedParts::kBackground);
  const auto b3 = backwards.render(3, SimulatedParts::kBackground);
  EXPECT_TRUE(same_bytes(a3.frame.colour, b3.frame.colour));
  EXPECT_TRUE(same_bytes(a3.frame.depth, b3.frame.depth));
  EXPECT_TRUE(same_bytes(a3.frame.labels, b3.frame.labels));
  EXPECT_TRUE(same_bytes(a3.instances, b3.instances));
  EXPECT_TRUE(same_bytes(a3.background_colour, b3.background_colour));
  EXPECT_TRUE(same_bytes(a3.background_depth, b3.background_depth));
  EXPECT_TRUE(same_bytes(a90.frame.colour, b90.frame.colour));
  EXPECT_TRUE(same_bytes(a90.frame.depth, b90.frame.depth));
}

TEST(Simulator, AnotherSeedMakesAnotherCity) {
  auto options = options_for(FlightPath::kStreet, TrafficLevel::kNone);
  Simulator one(options);
  options.seed = 2;
  Simulator two(options);
  EXPECT_GT(cv::norm(one.render(0).frame.colour, two.render(0).frame.colour, cv::NORM_L1) / (640 * 480 * 3),
            10.0);
}

TEST(Simulator, FliesAtTheSpeedAskedFor) {
  Simulator street(options_for(FlightPath::kStreet, TrafficLevel::kNone));
  EXPECT_EQ(street.size(), 1500U);
  for (std::size_t i = 1; i < street.size(); ++i) {
    const double step =
        (street.T_world_camera(i).translation() - street.T_world_camera(i - 1).translation()).norm();
    ASSERT_NEAR(step, 1.0 / 30, 0.0025) << i;
  }
  const auto end = street.T_world_camera(1499).translation();
  EXPECT_NEAR(end.x(), 50.0, 0.3);
  EXPECT_NEAR(end.z(), 3.5, 0.2);
}

TEST(Simulator, TheLoopComesBackToItsStart) {
  Simulator loop(options_for(FlightPath::kLoop, TrafficLevel::kNone));
  EXPECT_NEAR(static_cast<double>(loop.size()) / 30, 205.0, 15.0);  // seconds, and metres
  const SE3 start = loop.T_world_camera(0);
  double nearest = 1e9;
  for (std::size_t i = loop.size() - 300; i < loop.size(); ++i) {
    nearest = std::min(nearest, (loop.T_world_camera(i).translation() - start.translation()).norm());
  }
  EXPECT_LT(nearest, 0.3);
  const SE3 last = start.inverse() * loop.T_world_camera(loop.size() - 1);
  EXPECT_GT(last.translation().norm(), 5.0);  // flies on over the start
  EXPECT_LT(last.angle(), 0.1);
}

TEST(Simulator, TurnsSmoothly) {
  for (const FlightPath path : {FlightPath::kTurn, FlightPath::kHover, FlightPath::kLoop}) {
    Simulator simulator(options_for(path, TrafficLevel::kNone));
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i < simulator.size(); ++i) {
      const SE3 step = simulator.T_world_camera(i - 1).inverse() * simulator.T_world_camera(i);
      const Eigen::Vector3d rate = so3_log(step.rotation()) * 30;
      if (i > 1) {
        ASSERT_LT((rate - before).norm() * 30, 0.35) << i;  // radians a second squared
      }
      ASSERT_LT(rate.norm(), 0.5) << i;
      before = rate;
    }
  }
}

TEST(Simulator, DepthAgreesWithThePoses) {
  Simulator simulator(options_for(FlightPath::kTurn, TrafficLevel::kLight));
  const Camera& camera = simulator.camera();
  for (const std::size_t i : {std::size_t{60}, std::size_t{800}}) {
    const auto from = simulator.render(i);
    const auto to = simulator.render(i + 10);
    const SE3 T_to_from = to.frame.T_world_camera->inverse() * *from.frame.T_world_camera;
    std::size_t compared = 0;
    std::size_t agree = 0;
    for (int y = 0; y < camera.height; y += 2) {
      for (int x = 0; x < camera.width; x += 2) {
        const float z = from.frame.depth.at<float>(y, x);
        const int label = from.frame.labels.at<std::uint8_t>(y, x);
        if (z <= 0 || z > 20 || movable(label) || label == 8) continue;
        const Eigen::Vector3d point = T_to_from * camera.unproject({x, y}, z);
        if (point.z() < 0.5) continue;
        const Eigen::Vector2d pixel = camera.project(point);
        const int u = static_cast<int>(std::floor(pixel.x()));
        const int v = static_cast<int>(std::floor(pixel.y()));
        if (u < 0 || v < 0 || u + 1 >= camera.width || v + 1 >= camera.height) continue;
        if (movable(to.frame.labels.at<std::uint8_t>(v, u))) continue;
        // Between the four pixels the inverse depth of a plane is linear.
        const auto inverse = [&](int i0, int j0) {
          const float d = to.frame.depth.at<float>(v + j0, u + i0);
          return d > 0 ? 1.0 / static_cast<double>(d) : 0.0;
        };
        const double a = pixel.x() - u;
        const double b = pixel.y() - v;
        const double interpolated = (1 - b) * ((1 - a) * inverse(0, 0) + a * inverse(1, 0)) +
                                    b * ((1 - a) * inverse(0, 1) + a * inverse(1, 1));
        ++compared;
        if (std::abs(1.0 / interpolated - point.z()) < 0.02) ++agree;
      }
    }
    EXPECT_GT(compared, 20000U);
    // The rest: edges, where the four pixels belong to different objects, and newly visible surfaces.
    EXPECT_GT(static_cast<double>(agree) / static_cast<double>(compared), 0.93) << "frame " << i;
  }
}

TEST(Simulator, BackgroundIsTheViewWithoutMovables) {
  Simulator simulator(options_for(FlightPath::kStreet, TrafficLevel::kHeavy));
  Simulator empty(options_for(FlightPath::kStreet, TrafficLevel::kNone));
  const auto view = simulator.render(300, SimulatedParts::kBackground);
  const auto still = empty.render(300, SimulatedParts::kBackground);
  std::size_t outside = 0;
  std::size_t shadowed = 0;
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      if (movable(view.frame.labels.at<std::uint8_t>(y, x))) {
        ASSERT_GE(view.background_depth.at<float>(y, x) +
                      (view.background_depth.at<float>(y, x) == 0 ? 1e9F : 0.0F),
                  view.frame.depth.at<float>(y, x));
        continue;
      }
      ++outside;
      ASSERT_EQ(view.background_depth.at<float>(y, x), view.frame.depth.at<float>(y, x));
      if (view.frame.colour.at<cv::Vec3b>(y, x) != view.background_colour.at<cv::Vec3b>(y, x)) ++shadowed;
    }
  }
  // Shadows of movable objects are removed as well, and so is their share in antialiased edge pixels.
  EXPECT_LT(static_cast<double>(shadowed) / static_cast<double>(outside), 0.2);
  // The background does not depend on the traffic.
  EXPECT_TRUE(same_bytes(view.background_depth, still.background_depth));
  cv::Mat difference;
  cv::absdiff(view.background_colour, still.background_colour, difference);
  EXPECT_LT(cv::countNonZero(difference.reshape(1) > 24), 640 * 480 * 3 / 500);
}

TEST(Simulator, LabelsShowTheTraffic) {
  Simulator heavy(options_for(FlightPath::kStreet, TrafficLevel::kHeavy));
  std::set<int> labels;
  std::set<int> instances;
  double most = 0;
  for (std::size_t i = 0; i < heavy.size(); i += 250) {
    const auto view = heavy.render(i);
    int count = 0;
    for (int y = 0; y < 480; ++y) {
      for (int x = 0; x < 640; ++x) {
        const int label = view.frame.labels.at<std::uint8_t>(y, x);
        const int instance = view.instances.at<std::uint16_t>(y, x);
        labels.insert(label);
        instances.insert(instance);
        if (movable(label)) ++count;
        if (instance != 0) {
          ASSERT_TRUE(movable(label)) << label;
        }
      }
    }
    most = std::max(most, count / (640.0 * 480.0));
  }
  for (const int label : {0, 1, 2, 5, 7, 8, 10, 11, 12, 13, 18}) EXPECT_TRUE(labels.count(label)) << label;
  EXPECT_GT(instances.size(), 30U);
  EXPECT_GT(most, 0.2);
  EXPECT_LT(most, 0.6);
}

TEST(Simulator, WithoutTrafficOnlyParkedCarsAreLeft) {
  Simulator simulator(options_for(FlightPath::kStreet, TrafficLevel::kNone));
  int cars = 0;
  for (std::size_t i = 0; i < simulator.size(); i += 300) {
    const auto view = simulator.render(i);
    EXPECT_EQ(cv::countNonZero(view.instances), 0);
    for (const int label : {11, 12, 18}) EXPECT_EQ(cv::countNonZero(view.frame.labels == label), 0) << label;
    cars += cv::countNonZero(view.frame.labels == 13);
  }
  EXPECT_GT(cars, 10000);
}

TEST(Simulator, CornersCoverTheImage) {
  Simulator simulator(options_for(FlightPath::kStreet, TrafficLevel::kNone));
  for (std::size_t i = 0; i < simulator.size(); i += 50) {
    std::vector<cv::KeyPoint> corners;
    cv::FAST(simulator.render(i).frame.colour, corners, 20);
    EXPECT_GT(corners.size(), 600U) << "frame " << i;
    std::array<int, 16> cells{};
    for (const auto& corner : corners) {
      ++cells[static_cast<std::size_t>(corner.pt.y / 120) * 4 + static_cast<std::size_t>(corner.pt.x / 160)];
    }
    const auto filled = std::count_if(cells.begin(), cells.end(), [](int n) { return n >= 5; });
    EXPECT_GE(filled, 13) << "frame " << i;  // the sky has none
  }
}

TEST(DepthNoise, HasTheSpreadOfADisparity) {
  const Camera camera = *camera_preset("simulated");
  for (const double z : {1.0, 3.0, 6.0, 9.0}) {
    const cv::Mat wall(480, 640, CV_32FC1, cv::Scalar(z));
    const cv::Mat measured = stereo_depth(wall, camera, {}, 5);
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(measured, mean, deviation);
    const double sigma = z * z * 0.08 / (camera.fx * 0.095);
    EXPECT_NEAR(deviation[0], sigma, 0.08 * sigma + 0.0003) << z;
    EXPECT_NEAR(mean[0], z, 0.05 * sigma + 0.0005) << z;
    const double millimetres = 1000.0 * static_cast<double>(measured.at<float>(240, 320));
    EXPECT_NEAR(millimetres, std::round(millimetres), 0.01);
  }
}

TEST(DepthNoise, LosesWhatAStereoCameraLoses) {
  const Camera camera = *camera_preset("simulated");
  const auto known = [&](double z) {
    return cv::countNonZero(stereo_depth(cv::Mat(480, 640, CV_32FC1, cv::Scalar(z)), camera, {}, 5)) /
           (640.0 * 480.0);
  };
  EXPECT_EQ(known(0.3), 0.0);
  EXPECT_EQ(known(9.5), 1.0);
  EXPECT_GT(known(12.0), known(15.0) + 0.05);
  EXPECT_GT(known(15.0), known(18.0) + 0.05);
  EXPECT_EQ(known(20.5), 0.0);
  // A box 2 m away before a wall at 8 m hides a strip of the wall on its left from the right imager.
  cv::Mat scene(480, 640, CV_32FC1, cv::Scalar(8.0));
  scene(cv::Rect(300, 100, 100, 200)).setTo(2.0);
  const cv::Mat measured = stereo_depth(scene, camera, {}, 5);
  const double strip = camera.fx * 0.095 * (1 / 2.0 - 1 / 8.0);
  EXPECT_NEAR(cv::countNonZero(measured.row(200) == 0), strip, 2.0);
  EXPECT_EQ(measured.at<float>(200, 298), 0.0F);
  EXPECT_GT(measured.at<float>(200, 402), 0.0F);
}

TEST(Simulator, FliesBesideTheUsualPathAndUnderOtherLight) {
  auto options = options_for(FlightPath::kStreet, TrafficLevel::kNone);
  Simulator usual(options);
  options.gain = 0.5;
  const auto bright = usual.render(10);
  const auto dark = Simulator(options).render(10);
  EXPECT_NEAR(cv::mean(dark.frame.colour)[1], 0.5 * cv::mean(bright.frame.colour)[1], 1.0);
  EXPECT_TRUE(same_bytes(dark.frame.depth, bright.frame.depth));
  options.gain = 1.0;
  options.aside = 0.5;
  const Simulator beside(options);
  const SE3 moved = usual.T_world_camera(10).inverse() * beside.T_world_camera(10);
  EXPECT_NEAR(moved.translation().norm(), 0.5, 1e-6);
  EXPECT_LT(moved.translation().x(), -0.45) << "left of the camera";
  EXPECT_LT(moved.angle(), 1e-9);
}

TEST(SimulatorOptions, NamesTheFieldOutOfItsRange) {
  SimulatorOptions options;
  options.speed = -1;
  try {
    Simulator simulator(options);
    FAIL();
  } catch (const OptionsError& error) {
    EXPECT_NE(std::string(error.what()).find("speed"), std::string::npos);
  }
  options = {};
  options.gain = 0.0;
  EXPECT_THROW(options.validate(), OptionsError);
  options = {};
  options.aside = 10.0;
  EXPECT_THROW(options.validate(), OptionsError);
  options = {};
  options.frames = 3;
  SimulatedSource source(options);
  EXPECT_EQ(source.size(), 3U);
  double before = -1;
  while (const auto frame = source.next()) {
    EXPECT_GT(frame->timestamp, before);
    EXPECT_TRUE(frame->T_world_camera.has_value());
    before = frame->timestamp;
  }
  EXPECT_NEAR(before, 2.0 / 30, 1e-9);
}

class SimulateCommand : public testing::Test {
 protected:
  SimulateCommand() : out_(scratch_path()) { fs::remove_all(out_); }
  ~SimulateCommand() override { fs::remove_all(out_); }

  static int run(const std::string& arguments) {
    const int status = std::system((std::string(ROSLAM_PROGRAM) + " simulate " + arguments).c_str());
    return WEXITSTATUS(status);
  }

  static std::vector<std::string> lines_of(const fs::path& file) {
    std::vector<std::string> lines;
    std::ifstream stream(file);
    for (std::string line; std::getline(stream, line);) {
      if (!line.empty() && line[0] != '#') lines.push_back(line);
    }
    return lines;
  }

  const fs::path out_;
};

TEST_F(SimulateCommand, WritesAFolderThatReadsBack) {
  ASSERT_EQ(run("street --traffic heavy --depth ideal --frames 3 --json --out " + out_.string() + " > " +
                out_.string() + ".json 2> /dev/null"),
            0);
  Camera camera = read_camera(out_ / "camera.yaml");
  const SE3 T_body_camera = camera_preset("simulated")->T_body_camera;
  EXPECT_LT((camera.T_body_camera.inverse() * T_body_camera).log().norm(), 1e-11);
  camera.T_body_camera = T_body_camera;  // a matrix in the file, with rounded numbers
  EXPECT_EQ(camera, *camera_preset("simulated"));
  SimulatorOptions options = options_for(FlightPath::kStreet, TrafficLevel::kHeavy);
  Simulator simulator(options);
  const auto colours = lines_of(out_ / "rgb.txt");
  const auto depths = lines_of(out_ / "depth.txt");
  const auto poses = lines_of(out_ / "groundtruth.txt");
  ASSERT_EQ(colours.size(), 3U);
  ASSERT_EQ(depths.size(), 3U);
  ASSERT_EQ(poses.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto view = simulator.render(i, SimulatedParts::kBackground);
    std::istringstream line(colours[i]);
    std::string time;
    std::string name;
    line >> time >> name;
    EXPECT_NEAR(std::stod(time), static_cast<double>(i) / 30, 1e-6);
    EXPECT_EQ(depths[i], time + " depth/" + time + ".png");
    EXPECT_EQ(poses[i].rfind(time + " ", 0), 0U);
    const auto read = [&](const std::string& folder) {
      return cv::imread((out_ / folder / (time + ".png")).string(), cv::IMREAD_UNCHANGED);
    };
    EXPECT_TRUE(same_bytes(read("rgb"), view.frame.colour));
    EXPECT_TRUE(same_bytes(read("labels"), view.frame.labels));
    EXPECT_TRUE(same_bytes(read("instances"), view.instances));
    EXPECT_TRUE(same_bytes(read("background/rgb"), view.background_colour));
    const cv::Mat depth = read("depth");
    ASSERT_EQ(depth.type(), CV_16UC1);
    EXPECT_NEAR(depth.at<std::uint16_t>(400, 320), 1000 * view.frame.depth.at<float>(400, 320), 1.0);
    EXPECT_EQ(read("background/depth").type(), CV_16UC1);
  }
  std::ifstream summary(out_.string() + ".json");
  const std::string text((std::istreambuf_iterator<char>(summary)), {});
  EXPECT_NE(text.find("\"frames\":3"), std::string::npos) << text;
  fs::remove(out_.string() + ".json");
}

TEST_F(SimulateCommand, TellsWrongUsageFromWrongOutput) {
  const std::string quiet = " > /dev/null 2> " + out_.string() + ".err";
  EXPECT_EQ(run("--help" + quiet), 0);
  EXPECT_EQ(run("street" + quiet), 2);
  EXPECT_EQ(run("river --out " + out_.string() + quiet), 2);
  EXPECT_EQ(run("street --frames 0 --out " + out_.string() + quiet), 2);
  EXPECT_EQ(run("street --frames -3 --out " + out_.string() + quiet), 2);
  EXPECT_EQ(run("street --traffic some --out " + out_.string() + quiet), 2);
  EXPECT_EQ(run("street --frames 1 --out /dev/null/flight" + quiet), 1);
  const auto lines = lines_of(out_.string() + ".err");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find("/dev/null/flight"), std::string::npos) << lines[0];
  fs::remove(out_.string() + ".err");
}

// The largest turn rate of a flight, degrees a second.
double largest_turn_rate(double gusts, std::uint32_t seed) {
  SimulatorOptions options;
  options.gusts = gusts;
  options.seed = seed;
  options.traffic = TrafficLevel::kNone;
  const Simulator simulator(options);
  double largest = 0.0;
  for (std::size_t i = 1; i < simulator.size(); ++i) {
    const SE3 turn = simulator.T_world_camera(i - 1).inverse() * simulator.T_world_camera(i);
    largest = std::max(largest, turn.angle() * options.fps * 180.0 / std::numbers::pi);
  }
  return largest;
}

TEST(SimulatedGusts, TurnTheDroneAtUpToSixtyDegreesASecond) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    EXPECT_LT(largest_turn_rate(0.0, seed), 5.0);
    EXPECT_GT(largest_turn_rate(1.0, seed), 40.0);
    EXPECT_LT(largest_turn_rate(1.0, seed), 70.0);
  }
}

TEST(SimulatedCorridor, IsClosedAndFlownBetweenItsWalls) {
  auto options = options_for(FlightPath::kCorridor, TrafficLevel::kLight);
  options.depth = DepthModel::kIdeal;
  options.fps = 5.0;
  Simulator simulator(options);
  const CorridorPlan plan;
  bool has_people = false;
  for (std::size_t i = 0; i < simulator.size(); ++i) {
    const Eigen::Vector3d at = simulator.T_world_camera(i).translation();
    const double aside = at.x() < 19.0  ? at.y()
                         : at.y() > 3.0 ? at.x() - static_cast<double>(plan.corner)
                                        : 0.0;
    EXPECT_LT(std::abs(aside), 0.5) << i;
    EXPECT_NEAR(at.z(), 1.5, 0.2);
    if (i % 40 != 5) continue;
    const auto view = simulator.render(i);
    EXPECT_EQ(cv::countNonZero(view.frame.depth <= 0.0F), 0) << i;  // nothing is open to the sky
    has_people |= cv::countNonZero(view.instances) > 100;
  }
  EXPECT_TRUE(has_people);
  EXPECT_GT(simulator.T_world_camera(simulator.size() - 1).translation().y(), 10.0);
}

TEST(SimulatedImu, FeelsGravityAndTheTurnsOfTheFlight) {
  SimulatorOptions options;
  options.path = FlightPath::kHover;
  options.seed = 3;
  const Flight flight(options);
  const SE3 T_camera_imu = simulated_imu().T_camera_imu;
  const auto samples = inertial_samples(flight, 1.0, 3.0, options.seed);
  ASSERT_EQ(samples.size(), 400U);
  EXPECT_NEAR(samples.front().timestamp, 1.005, 1e-9);
  EXPECT_NEAR(samples.back().timestamp, 3.0, 1e-9);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();
  for (const InertialSample& sample : samples) {
    const SE3 T_world_imu = flight.T_world_camera(sample.timestamp) * T_camera_imu;
    up += T_world_imu.rotation() * sample.acceleration / 400.0;
    turned += T_world_imu.rotation() * (sample.turn_rate - gyroscope_bias(sample.timestamp, 3)) / 200.0;
  }
  EXPECT_LT((up - Eigen::Vector3d(0, 0, 9.81)).norm(), 0.05) << up.transpose();
  const SE3 begin = flight.T_world_camera(1.0025);
  const SE3 end = flight.T_world_camera(3.0025);
  EXPECT_NEAR(turned.z(), so3_log(end.rotation() * begin.rotation().inverse()).z(), 0.01);
  // Where the flight begins there is no jerk either.
  options.path = FlightPath::kStreet;
  for (const InertialSample& sample : inertial_samples(Flight(options), -0.05, 0.05, options.seed))
    EXPECT_NEAR(sample.acceleration.norm(), 9.81, 0.6);
  // The same whatever was asked for before.
  const auto again = inertial_samples(flight, 1.9, 2.0, options.seed);
  ASSERT_EQ(again.size(), 20U);
  EXPECT_EQ(again.back().turn_rate, samples[199].turn_rate);
}

}  // namespace
}  // namespace roslam
