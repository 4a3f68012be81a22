// SPDX-License-Identifier: BSD-3-Clause
// The fast routines of the restoration give what the straightforward computation gives.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <random>

#include "roslam/restoration/colour_samples.hpp"
#include "roslam/restoration/depth_filling.hpp"
#include "roslam/restoration/disc_dilation.hpp"
#include "roslam/restoration/warp_group.hpp"
#include "roslam/restoration/warped_depths.hpp"
#include "tests/restoration_scene.hpp"

namespace roslam::scene {
namespace {

// A target and five source images of the room.
class Routines : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 5; ++i) {
      const double x = 0.15 * i - 0.3;
      sources_.push_back(*prepare_source(
          taken(stage_, room({kPerson.shifted(0.3 * i)}), turned(0.03 * x, {x, 0.02, 0.1 * x}), 10.0 + i),
          {}));
    }
    for (const SourceImage& source : sources_)
      warps_.emplace_back(rays_, source, source.T_world_camera.inverse(), 10.0, ReprojectionOptions{});
  }

  std::vector<Eigen::Vector3f> points() const {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> side(-3.0F, 3.0F), depth(-0.5F, 5.0F);
    std::vector<Eigen::Vector3f> result;
    for (int i = 0; i < 2000; ++i) result.emplace_back(side(random), side(random), depth(random));
    return result;
  }

  Stage stage_;
  PixelRays rays_{stage_.camera()};
  std::vector<SourceImage> sources_;
  std::vector<SourceWarp> warps_;
};

TEST_F(Routines, AGroupOfWarpsProjectsAndWeighsAsEachOfThem) {
  WarpGroup group(rays_, warps_);
  std::size_t inside = 0;
  for (const Eigen::Vector3f& point : points()) {
    const auto& warped = group.project(point);
    const auto& weights = group.weights();
    for (std::size_t i = 0; i < warps_.size(); ++i) {
      const auto one = warps_[i].project(point);
      if (!one) {
        EXPECT_FALSE(warps_[i].shows(warped[i]) || warps_[i].sees_through(warped[i]));
        continue;
      }
      ++inside;
      EXPECT_LT((one->pixel - warped[i].pixel).norm(), 1e-3F);
      EXPECT_NEAR(one->depth, warped[i].depth, 1e-5F);
      EXPECT_EQ(warps_[i].shows(*one), warps_[i].shows(warped[i]));
      EXPECT_EQ(warps_[i].sees_through(*one), warps_[i].sees_through(warped[i]));
      EXPECT_NEAR(warps_[i].weight(point, one->depth), number_of(weights, i), 2e-3F);
    }
  }
  EXPECT_GT(inside, 500U);
}

TEST_F(Routines, WeightsOfANearbyPointAreAlmostItsOwn) {
  WarpGroup group(rays_, warps_);
  group.project({0.2F, 0.1F, 2.0F});
  group.weights();
  group.project({0.21F, 0.1F, 2.01F});
  const std::vector<Four> nearby = group.weights_nearby();
  const std::vector<Four> own = group.weights();
  for (std::size_t i = 0; i < warps_.size(); ++i)
    EXPECT_NEAR(number_of(nearby, i), number_of(own, i), 0.02F * number_of(own, i));
}

TEST_F(Routines, PixelsOfManyPointsAreThoseOfEach) {
  Camera distorted = small_camera();
  distorted.distortion = {0.1, -0.05, 0.001, 0.001, 0.0};
  for (const Camera& camera : {stage_.camera(), distorted}) {
    const PixelRays rays(camera);
    std::vector<float> x, y, z;
    for (const Eigen::Vector3f& point : points()) {
      x.push_back(point.x());
      y.push_back(point.y());
      z.push_back(point.z());
    }
    rays.pixels(x.size(), x.data(), y.data(), z.data());
    const auto all = points();
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto pixel = rays.pixel(all[i]);
      ASSERT_EQ(pixel.has_value(), x[i] >= 0.0F);
      if (!pixel) continue;
      EXPECT_LT((*pixel - Eigen::Vector2f(x[i], y[i])).norm(), 1e-3F);
    }
  }
}

TEST_F(Routines, WarpedDepthsAreTheNearestReadingsAroundEachPixel) {
  cv::Mat area = cv::Mat::zeros(rays_.size(), CV_8UC1);
  const cv::Point centre(area.cols / 2, area.rows / 2);
  cv::circle(area, centre, area.rows / 5, 255, cv::FILLED);
  area.row(0).setTo(255);  // up to the border
  const WarpedDepths depths(rays_, warps_, area);
  constexpr float kNone = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < warps_.size(); ++i) {
    std::array<cv::Mat, 2> expected{cv::Mat(area.size(), CV_32FC1, cv::Scalar(kNone)),
                                    cv::Mat(area.size(), CV_32FC1, cv::Scalar(kNone))};
    const SourceImage& source = sources_[i];
    for (int y = 0; y < area.rows; ++y) {
      for (int x = 0; x < area.cols; ++x) {
        const float depth = source.depth.at<float>(y, x);
        if (!(depth > 0.0F)) continue;
        const Eigen::Vector3f point = warps_[i].target_from_source() * rays_.point(x, y, depth);
        const auto pixel = rays_.pixel(point);
        if (!pixel) continue;
        cv::Mat& image = expected[source.is_measured.at<std::uint8_t>(y, x) != 0 ? 0 : 1];
        for (int dy = 0; dy < 2; ++dy) {
          for (int dx = 0; dx < 2; ++dx) {
            const cv::Point at(static_cast<int>(pixel->x()) + dx, static_cast<int>(pixel->y()) + dy);
            if (at.x < area.cols && at.y < area.rows)
              image.at<float>(at) = std::min(image.at<float>(at), point.z());
          }
        }
      }
    }
    for (int y = 0; y < area.rows; ++y) {
      for (int x = 0; x < area.cols; ++x) {
        if (area.at<std::uint8_t>(y, x) == 0) continue;
        EXPECT_EQ(depths.measured(x, y)[i], expected[0].at<float>(y, x));
        EXPECT_EQ(depths.completed(x, y)[i], expected[1].at<float>(y, x));
      }
    }
  }
}

TEST(ColourSamples, TheMedoidIsTypicalUnlessMostDiffer) {
  ColourSamples samples(25.0F);
  samples.add({{100, 100, 100}, 0.3F, 1.0F});
  samples.add({{110, 104, 98}, 0.3F, 1.0F});
  EXPECT_TRUE(samples.all_agree());
  samples.add({{10, 10, 10}, 0.2F, 1.0F});
  samples.add({{105, 102, 99}, 0.3F, 1.0F});
  samples.add({{104, 100, 96}, 0.1F, 1.0F});
  EXPECT_FALSE(samples.all_agree());
  EXPECT_EQ(samples.consensus().colour, cv::Vec3f(105, 102, 99));
  // A heavy sample that most contradict is not typical.
  samples.clear();
  samples.add({{10, 10, 10}, 5.0F, 1.0F});
  for (const float grey : {200.0F, 203.0F, 206.0F}) samples.add({{grey, grey, grey}, 0.1F, 1.0F});
  EXPECT_EQ(samples.consensus().colour, cv::Vec3f(203, 203, 203));
}

TEST(DiscDilation, IsThatOfOpenCV) {
  cv::RNG random(3);
  for (const int side : {1, 3, 9, 25}) {
    cv::Mat mask = cv::Mat::zeros(120, 160, CV_8UC1);
    for (int i = 0; i < 12; ++i)
      cv::circle(mask, {random.uniform(0, 160), random.uniform(0, 120)}, random.uniform(0, 9), 255,
                 cv::FILLED);
    cv::Mat expected;
    cv::dilate(mask, expected, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
    EXPECT_EQ(cv::norm(dilated_by_disc(mask, side), expected, cv::NORM_INF), 0.0) << side;
  }
}

// The cheapest of the known depths in four directions; without the median filter that follows.
TEST(DepthFilling, TakesTheCheapestOfTheFourDirections) {
  cv::RNG random(5);
  cv::Mat depth(40, 50, CV_32FC1), colour(40, 50, CV_8UC3);
  random.fill(depth, cv::RNG::UNIFORM, 1.0, 4.0);
  random.fill(colour, cv::RNG::UNIFORM, 0, 255);
  const cv::Rect unknown(10, 8, 25, 20);
  depth(unknown).setTo(0);
  cv::Mat smooth, expected = depth.clone();
  cv::blur(colour, smooth, {5, 5});
  for (int y = unknown.y; y < unknown.br().y; ++y) {
    for (int x = unknown.x; x < unknown.br().x; ++x) {
      float least = std::numeric_limits<float>::max();
      for (const cv::Point& known : {cv::Point(unknown.x - 1, y), cv::Point(unknown.br().x, y),
                                     cv::Point(x, unknown.y - 1), cv::Point(x, unknown.br().y)}) {
        const cv::Vec3i differing =
            cv::Vec3i(smooth.at<cv::Vec3b>(y, x)) - cv::Vec3i(smooth.at<cv::Vec3b>(known));
        const float cost = static_cast<float>(cv::norm(differing, cv::NORM_L1)) / 3.0F +
                           0.2F * static_cast<float>(std::abs(known.x - x) + std::abs(known.y - y));
        if (cost >= least) continue;
        least = cost;
        expected.at<float>(y, x) = depth.at<float>(known);
      }
    }
  }
  cv::Mat even;
  cv::medianBlur(expected, even, 5);
  even.copyTo(expected, depth == 0);
  EXPECT_EQ(cv::norm(filled_depth(depth, colour), expected, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace roslam::scene
