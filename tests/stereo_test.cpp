// SPDX-License-Identifier: BSD-3-Clause
// Rectification, matching of features and dense depth of stereo pairs, against known geometry.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/features/stereo_matcher.hpp"
#include "roslam/stereo/dense_stereo.hpp"
#include "roslam/stereo/stereo_rectifier.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam {
namespace {

Camera raw_camera(LensModel model) {
  Camera camera;
  camera.width = 752;
  camera.height = 480;
  camera.fx = 458.0;
  camera.fy = 457.0;
  camera.cx = 367.0;
  camera.cy = 248.0;
  if (model == LensModel::kFisheye) {
    camera.set_lens("fisheye", {0.01, -0.004, 0.002, -0.0005});
  } else {
    camera.set_lens("pinhole", {-0.28, 0.07, 0.0002, 0.00002, 0.0});
  }
  return camera;
}

// A right camera that is turned, displaced and of other intrinsics.
RightCamera right_of(Camera left) {
  left.fx += 1.5;
  left.fy += 1.5;
  left.cx += 12.0;
  left.cy -= 6.0;
  return {left, SE3(so3_exp({0.012, -0.02, 0.015}), {0.11, -0.003, 0.002})};
}

Eigen::Vector2d raw_pixel(const Camera& camera, const Eigen::Vector3d& point) {
  return camera.distort(camera.project(point));
}

void draw_dot(cv::Mat& image, const Eigen::Vector2d& at) {
  constexpr double kSigma = 2.5;
  for (int y = static_cast<int>(at.y()) - 10; y <= static_cast<int>(at.y()) + 10; ++y) {
    for (int x = static_cast<int>(at.x()) - 10; x <= static_cast<int>(at.x()) + 10; ++x) {
      if (x < 0 || y < 0 || x >= image.cols || y >= image.rows) continue;
      const double squares = std::pow(x - at.x(), 2) + std::pow(y - at.y(), 2);
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
          image.at<std::uint8_t>(y, x) + 250.0 * std::exp(-0.5 * squares / (kSigma * kSigma)));
    }
  }
}

// The centroid of the brightness around a pixel.
Eigen::Vector2d dot_near(const cv::Mat& image, const Eigen::Vector2d& at) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0.0;
  for (int y = cvRound(at.y()) - 10; y <= cvRound(at.y()) + 10; ++y) {
    for (int x = cvRound(at.x()) - 10; x <= cvRound(at.x()) + 10; ++x) {
      const double value = image.at<std::uint8_t>(y, x);
      sum += value * Eigen::Vector2d(x, y);
      weight += value;
    }
  }
  return sum / weight;
}

class Rectification : public testing::TestWithParam<LensModel> {};

TEST_P(Rectification, PutsPointsWhereThePinholesSeeThem) {
  const Camera left = raw_camera(GetParam());
  const RightCamera right = right_of(left);
  const StereoRectifier rectifier(left, right);
  ASSERT_FALSE(rectifier.is_identity());
  const Camera& camera = rectifier.camera();
  EXPECT_NEAR(camera.baseline, right.baseline(), 1e-12);
  EXPECT_FALSE(camera.has_distortion());
  EXPECT_GT(camera.fx, 0.7 * left.fx);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(40, camera.width - 40), v(40, camera.height - 40), z(1.5, 12.0);
  int seen = 0;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d in_rectified = camera.unproject({u(random), v(random)}, z(random));
    const Eigen::Vector2d expected = camera.project(in_rectified);
    const double disparity = camera.fx * camera.baseline / in_rectified.z();
    if (expected.x() - disparity < 40) continue;
    ++seen;
    const Eigen::Vector3d in_left = rectifier.T_left_rectified() * in_rectified;
    cv::Mat left_image = cv::Mat::zeros(left.height, left.width, CV_8UC1), right_image = left_image.clone();
    draw_dot(left_image, raw_pixel(left, in_left));
    draw_dot(right_image, raw_pixel(right.camera, right.T_left_right.inverse() * in_left));
    EXPECT_LT((dot_near(rectifier.left(left_image), expected) - expected).norm(), 0.1);
    const Eigen::Vector2d expected_right = expected - Eigen::Vector2d(disparity, 0.0);
    EXPECT_LT((dot_near(rectifier.right(right_image), expected_right) - expected_right).norm(), 0.1);
  }
  EXPECT_GT(seen, 40);
}

TEST_P(Rectification, FillsTheImages) {
  const Camera left = raw_camera(GetParam());
  const StereoRectifier rectifier(left, right_of(left));
  const cv::Mat white(left.height, left.width, CV_8UC1, cv::Scalar(255));
  for (const cv::Mat& image : {rectifier.left(white), rectifier.right(white)})
    EXPECT_GE(cv::countNonZero(image == 255), 0.995 * static_cast<double>(image.total()));
}

TEST_P(Rectification, MovesMountAndInertialUnit) {
  Camera left = raw_camera(GetParam());
  left.imu.emplace();
  left.imu->T_camera_imu = SE3(so3_exp({0.3, -0.2, 0.1}), {0.05, 0.02, -0.01});
  const StereoRectifier rectifier(left, right_of(left));
  const SE3 T_body_imu = left.T_body_camera * left.imu->T_camera_imu;
  const Camera& camera = rectifier.camera();
  EXPECT_LT((T_body_imu.inverse() * camera.T_body_camera * camera.imu->T_camera_imu).log().norm(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Lenses, Rectification, testing::Values(LensModel::kPinhole, LensModel::kFisheye));

TEST(RectifiedPairs, AreRecognisedAndLeftAsTheyAre) {
  Camera left = raw_camera(LensModel::kPinhole);
  left.set_lens("pinhole", {});
  const RightCamera right{left, SE3(Eigen::Quaterniond::Identity(), {0.12, 0.0, 0.0})};
  const StereoRectifier rectifier(left, right);
  EXPECT_TRUE(rectifier.is_identity());
  const cv::Mat image(left.height, left.width, CV_8UC3, cv::Scalar(1, 2, 3));
  EXPECT_EQ(rectifier.left(image).data, image.data);
  EXPECT_EQ(rectifier.camera().fx, left.fx);
  EXPECT_EQ(rectifier.camera().baseline, 0.12);
}

TEST(Rectification, RefusesWrongPairs) {
  const Camera left = raw_camera(LensModel::kPinhole);
  const auto refused = [&](const std::function<void(RightCamera&)>& spoil) -> std::string {
    RightCamera right = right_of(left);
    spoil(right);
    try {
      const StereoRectifier rectifier(left, right);
    } catch (const CalibrationError& error) {
      return error.what();
    }
    return "none";
  };
  const auto move_to = [](double x, double y, double z) {
    return [=](RightCamera& right) {
      right.T_left_right = SE3(right.T_left_right.rotation(), Eigen::Vector3d(x, y, z));
    };
  };
  EXPECT_NE(refused(move_to(0, 0, 0)).find("the baseline is zero"), std::string::npos);
  EXPECT_NE(refused(move_to(-0.11, 0, 0)).find("swapped"), std::string::npos);
  EXPECT_NE(refused(move_to(110, 0, 0)).find("in millimetres?"), std::string::npos);
  EXPECT_NE(refused(move_to(0, 0.11, 0)).find("only horizontal pairs"), std::string::npos);
  EXPECT_NE(refused(move_to(std::nan(""), 0, 0)).find("baseline"), std::string::npos);
  EXPECT_NE(refused([](RightCamera& right) {
              right.camera.width = 640;
            }).find("752x480 and the right ones 640x480"),
            std::string::npos);
  EXPECT_NE(refused([](RightCamera& right) {
              right.T_left_right = SE3(so3_exp({0.0, 1.2, 0.0}), right.T_left_right.translation());
            }).find("more than 45 degrees"),
            std::string::npos);
  EXPECT_EQ(refused([](RightCamera&) {}), "none");
}

Camera rectified_camera() {
  Camera camera;
  camera.fx = camera.fy = 400.0;
  camera.baseline = 0.1;
  return camera;
}

// A smooth random texture at pixels that are moved to the left by a function of their place.
cv::Mat textured(const cv::Size& size, const std::function<double(double x, double y)>& shift) {
  cv::Mat image(size, CV_8UC1);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> frequency(0.05, 0.9), direction(0.0, 6.28), phase(0.0, 6.28);
  std::vector<std::array<double, 3>> waves;
  for (int i = 0; i < 60; ++i) {
    const double f = frequency(random), d = direction(random);
    waves.push_back({f * std::cos(d), f * std::sin(d), phase(random)});
  }
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      double value = 0.0;
      for (const auto& [fx, fy, p] : waves) value += std::sin(fx * (x + shift(x, y)) + fy * y + p);
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(128.0 + 14.0 * value);
    }
  }
  return image;
}

TEST(StereoMatcher, FindsFractionsOfAPixelWhateverTheExposure) {
  const OrbExtractor extractor;
  const StereoMatcher matcher(rectified_camera(), {});
  const cv::Mat left = textured({640, 480}, [](double, double) { return 0.0; });
  const auto features = extractor.extract(left);
  ASSERT_GT(features.size(), 500U);
  for (const double disparity : {0.4, 7.25, 31.5, 60.8}) {
    cv::Mat right = textured({640, 480}, [&](double, double) { return disparity; });
    right.convertTo(right, CV_8UC1, 0.7, 25.0);
    const auto found = matcher.match(features, extractor.pyramid(left), extractor.pyramid(right));
    double squares = 0.0;
    std::size_t count = 0, wrong = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (!found[i] || features[i].level > 0) continue;
      const double error = found[i]->pixels - disparity;
      if (std::abs(error) > 0.3) {
        ++wrong;
      } else {
        squares += error * error;
        ++count;
      }
    }
    EXPECT_GT(count, 100U) << disparity;
    EXPECT_EQ(wrong, 0U) << disparity;
    EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 0.04) << disparity;
  }
}

TEST(StereoMatcher, DoesNotMatchWhatRepeatsOrIsFlat) {
  const OrbExtractor extractor;
  const StereoMatcher matcher(rectified_camera(), {});
  cv::Mat stripes(480, 640, CV_8UC1), flat(480, 640, CV_8UC1, cv::Scalar(90));
  for (int y = 0; y < stripes.rows; ++y) {
    for (int x = 0; x < stripes.cols; ++x)
      stripes.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>((x / 8 + y / 8) % 2 == 0 ? 60 : 190);
  }
  std::vector<OrbFeature> features;
  for (int x = 100; x < 600; x += 8) {
    OrbFeature feature;
    feature.pixel = cv::Point2f(static_cast<float>(x), 200.0F);
    features.push_back(feature);
  }
  const auto matched = [&](const cv::Mat& image) {
    const auto found = matcher.match(features, extractor.pyramid(image), extractor.pyramid(image));
    return std::count_if(found.begin(), found.end(), [](const auto& match) { return match.has_value(); });
  };
  EXPECT_EQ(matched(stripes), 0);
  EXPECT_EQ(matched(flat), 0);
  EXPECT_GT(matched(textured({640, 480}, [](double, double) { return 0.0; })), 40);
}

TEST(StereoMatcher, NeedsABaseline) {
  Camera camera = rectified_camera();
  camera.baseline = 0.0;
  EXPECT_THROW(StereoMatcher(camera, {}), CalibrationError);
  EXPECT_THROW(DenseStereo(camera, {}), CalibrationError);
}

// Stereo pairs of the simulated street, with noise and exposures of their own.
class SimulatedPairs : public testing::Test {
 protected:
  static simulation::SimulatorOptions options() {
    simulation::SimulatorOptions options;
    options.stereo = true;
    options.depth = simulation::DepthModel::kIdeal;
    options.frames = 100;
    return options;
  }

  simulation::Simulator simulator_{options()};
};

TEST_F(SimulatedPairs, DisparitiesAreAsUncertainAsTheySay) {
  const OrbExtractor extractor;
  const Camera& camera = simulator_.camera();
  StereoOptions options;
  options.disparity_sigma = 0.25;  // nothing is wrong with the calibration of a simulated camera
  const StereoMatcher matcher(camera, options);
  std::size_t features_in_all = 0, matched = 0, wrong = 0, far = 0;
  double squares = 0.0;
  std::vector<double> of_finest;  // errors in pixels
  for (const std::size_t index : {0U, 40U, 80U}) {
    const Frame frame = simulator_.render(index).frame;
    cv::Mat grey;
    cv::cvtColor(frame.colour, grey, cv::COLOR_BGR2GRAY);
    const auto features = extractor.extract(grey);
    const auto found = matcher.match(features, extractor.pyramid(grey), extractor.pyramid(frame.right));
    DepthOptions depth_options;
    depth_options.max_depth = 200.0;
    for (std::size_t i = 0; i < features.size(); ++i) {
      const float depth = depth_at(frame.depth, features[i].pixel, depth_options);
      if (depth <= 0.0F) continue;  // on an edge of depth, where there are two answers
      ++features_in_all;
      if (!found[i]) continue;
      ++matched;
      const double error = (found[i]->pixels - camera.fx * camera.baseline / depth) / found[i]->sigma;
      if (std::abs(error) > 4.0) {
        ++wrong;
      } else {
        squares += error * error;
        if (features[i].level == 0) of_finest.push_back(error * found[i]->sigma);
      }
      far += depth > 20.0F ? 1 : 0;
    }
  }
  EXPECT_GT(static_cast<double>(matched), 0.6 * static_cast<double>(features_in_all));
  EXPECT_GT(far, 100U);
  EXPECT_LT(static_cast<double>(wrong), 0.03 * static_cast<double>(matched));
  const double spread = std::sqrt(squares / static_cast<double>(matched - wrong));
  EXPECT_GT(spread, 0.5);
  EXPECT_LT(spread, 1.5);
  // What is beside a nearer surface takes some of its disparity, which the median does not see.
  std::nth_element(of_finest.begin(), of_finest.begin() + of_finest.size() / 2, of_finest.end());
  const double bias = of_finest[of_finest.size() / 2];
  EXPECT_LT(std::abs(bias), 0.03);  // pixels: it would scale the map
  std::printf("%zu of %zu matched, %zu wrong, spread %.2f, bias %.4f pixels\n", matched, features_in_all,
              wrong, spread, bias);
}

TEST_F(SimulatedPairs, DenseDepthIsThatOfTheScene) {
  const Camera& camera = simulator_.camera();
  const StereoOptions options;
  const DenseStereo stereo(camera, options);
  const DepthNoise noise = dense_stereo_noise(camera, options);
  std::size_t known = 0, total = 0, wrong = 0;
  double squares = 0.0;
  for (const std::size_t index : {0U, 40U, 80U}) {
    const Frame frame = simulator_.render(index).frame;
    const cv::Mat depth = stereo.depth(frame.colour, frame.right);
    ASSERT_EQ(depth.size(), frame.colour.size());
    ASSERT_EQ(depth.type(), CV_32FC1);
    DepthOptions limits;
    for (int y = 0; y < depth.rows; y += 3) {
      for (int x = 60; x < depth.cols; x += 3) {
        const float truth =
            depth_at(frame.depth, cv::Point2f(static_cast<float>(x), static_cast<float>(y)), limits);
        if (truth <= 0.0F) continue;
        ++total;
        const float z = depth.at<float>(y, x);
        if (z <= 0.0F) continue;
        ++known;
        const double error = (z - truth) / noise.sigma(truth);
        if (std::abs(error) > 5.0) {
          ++wrong;
        } else {
          squares += error * error;
        }
      }
    }
  }
  std::printf("%zu of %zu known, %zu wrong, spread %.2f\n", known, total, wrong,
              std::sqrt(squares / static_cast<double>(known - wrong)));
  EXPECT_GT(static_cast<double>(known), 0.6 * static_cast<double>(total));
  EXPECT_LT(static_cast<double>(wrong), 0.05 * static_cast<double>(known));
  const double spread = std::sqrt(squares / static_cast<double>(known - wrong));
  EXPECT_GT(spread, 0.4);
  EXPECT_LT(spread, 1.5);
}

TEST_F(SimulatedPairs, AFrameWithDepthOrWithoutRightImageStaysAsItIs) {
  const DenseStereo stereo(simulator_.camera(), {});
  Frame frame = simulator_.render(0).frame;
  EXPECT_EQ(stereo.with_depth(frame).depth.data, frame.depth.data);
  frame.depth.release();
  EXPECT_FALSE(stereo.with_depth(frame).depth.empty());
  frame.right.release();
  EXPECT_TRUE(stereo.with_depth(frame).depth.empty());
}

}  // namespace
}  // namespace roslam
