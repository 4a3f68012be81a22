// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <bitset>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/features/descriptor.hpp"
#include "roslam/features/feature_grid.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "simulation/depth_noise.hpp"

namespace roslam {

using namespace simulation;
namespace {

// Blobs of random size and grey level: corners everywhere, at all scales.
cv::Mat textured_image(unsigned seed, int width = 640, int height = 480) {
  std::mt19937 generator(seed);
  const auto below = [&](int limit) { return static_cast<int>(generator() % static_cast<unsigned>(limit)); };
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < 1500; ++i) {
    const cv::Point corner(below(width), below(height));
    cv::rectangle(image, {corner, cv::Size(4 + below(30), 4 + below(30))}, cv::Scalar(below(256)),
                  cv::FILLED);
  }
  cv::GaussianBlur(image, image, {3, 3}, 0.8);
  return image;
}

Descriptor random_descriptor(std::mt19937_64& generator) {
  return {generator(), generator(), generator(), generator()};
}

TEST(Descriptor, HammingCountsTheBitsThatDiffer) {
  std::mt19937_64 generator(1);
  for (int i = 0; i < 100; ++i) {
    const Descriptor a = random_descriptor(generator);
    const Descriptor b = random_descriptor(generator);
    std::size_t expected = 0;
    for (std::size_t k = 0; k < a.size(); ++k) expected += std::bitset<64>(a[k] ^ b[k]).count();
    EXPECT_EQ(hamming(a, b), static_cast<int>(expected));
  }
}

TEST(Descriptor, NearestTwoAgreesWithSorting) {
  std::mt19937_64 generator(2);
  std::vector<Descriptor> pool;
  for (int i = 0; i < 200; ++i) pool.push_back(random_descriptor(generator));
  const Descriptor query = random_descriptor(generator);
  std::vector<std::uint32_t> even;
  std::vector<std::pair<int, int>> distances;
  for (std::uint32_t i = 0; i < pool.size(); i += 2) {
    even.push_back(i);
    distances.emplace_back(hamming(query, pool[i]), static_cast<int>(i));
  }
  std::sort(distances.begin(), distances.end());
  const NearestTwo nearest = nearest_two(query, pool, even);
  EXPECT_EQ(nearest.best, distances[0].second);
  EXPECT_EQ(nearest.best_distance, distances[0].first);
  EXPECT_EQ(nearest.second_distance, distances[1].first);
  EXPECT_EQ(nearest_two(query, {}).best, -1);
}

TEST(Descriptor, MostTypicalIsInTheCluster) {
  std::mt19937_64 generator(3);
  const Descriptor centre = random_descriptor(generator);
  std::vector<Descriptor> pool{random_descriptor(generator)};
  for (int i = 0; i < 5; ++i) {
    Descriptor near = centre;
    near[0] ^= 1ULL << i;
    pool.push_back(near);
  }
  EXPECT_GT(most_typical(pool), 0U);
}

TEST(FeatureGrid, FindsWhatALinearSearchFinds) {
  std::mt19937 generator(4);
  std::uniform_real_distribution<float> x(-20.0F, 660.0F);
  std::uniform_real_distribution<float> y(-20.0F, 500.0F);
  std::vector<Eigen::Vector2f> points;
  for (int i = 0; i < 500; ++i) points.emplace_back(x(generator), y(generator));
  const FeatureGrid grid(points, {0, 0, 639, 479});
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector2f centre(x(generator), y(generator));
    std::vector<std::uint32_t> found;
    grid.find(centre, 25.0F, found);
    std::sort(found.begin(), found.end());
    std::vector<std::uint32_t> expected;
    for (std::uint32_t k = 0; k < points.size(); ++k) {
      if ((points[k] - centre).cwiseAbs().maxCoeff() <= 25.0F) expected.push_back(k);
    }
    EXPECT_EQ(found, expected);
  }
}

TEST(OrbExtractor, GivesTheNumberAskedFor) {
  OrbOptions options;
  options.features = 700;
  const auto features = OrbExtractor(options).extract(textured_image(1));
  EXPECT_NEAR(static_cast<double>(features.size()), 700.0, 10.0);
}

TEST(OrbExtractor, SpreadsOverImageAndLevels) {
  const auto features = OrbExtractor().extract(textured_image(2));
  std::array<int, 16> quarters{};
  std::array<int, 8> levels{};
  for (const auto& feature : features) {
    ++quarters[static_cast<std::size_t>(feature.pixel.x / 160) +
               4 * static_cast<std::size_t>(feature.pixel.y / 120)];
    ++levels[static_cast<std::size_t>(feature.level)];
  }
  for (const int count : quarters) EXPECT_GT(count, 25);  // a sixteenth of 1000 is 62; border cells lose some
  for (std::size_t level = 1; level < levels.size(); ++level) {
    EXPECT_GT(levels[level], 20);
    EXPECT_LE(levels[level], levels[level - 1] + 1);
  }
}

TEST(OrbExtractor, NeverReturnsPointsOnOrNearTheMask) {
  OrbOptions options;
  options.mask_margin = 6;
  cv::Mat mask = cv::Mat::zeros(480, 640, CV_8UC1);
  cv::ellipse(mask, {300, 250}, {140, 90}, 30, 0, 360, cv::Scalar(1), cv::FILLED);
  mask.at<uchar>(100, 500) = 255;
  cv::Mat distance;
  cv::distanceTransform(mask == 0, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const auto features = OrbExtractor(options).extract(textured_image(3), mask);
  EXPECT_GT(features.size(), 500U);
  for (const auto& feature : features) {
    const cv::Point nearest(cvRound(feature.pixel.x), cvRound(feature.pixel.y));
    EXPECT_GT(distance.at<float>(nearest), 5.0F) << feature.pixel;
  }
}

TEST(OrbExtractor, PointsInAPartOfTheMaskChangeNoOthers) {
  const cv::Mat image = textured_image(3);
  cv::Mat mask = cv::Mat::zeros(480, 640, CV_8UC1);
  mask(cv::Rect(100, 80, 400, 300)).setTo(255);
  cv::Mat part = cv::Mat::zeros(480, 640, CV_8UC1);
  part(cv::Rect(150, 120, 200, 200)).setTo(255);
  const OrbExtractor extractor;
  std::vector<cv::Point2f> removed, removed_with;
  const auto without = extractor.extract(image, mask, &removed);
  const auto with = extractor.extract(image, mask, part, &removed_with);
  EXPECT_EQ(removed, removed_with);
  std::size_t others = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    if (i > 0) {
      EXPECT_LE(with[i - 1].level, with[i].level);
    }
    if (with[i].is_in_part) {
      EXPECT_EQ(part.at<uchar>(cvRound(with[i].pixel.y), cvRound(with[i].pixel.x)), 255);
      continue;
    }
    ASSERT_LT(others, without.size());
    EXPECT_EQ(with[i].pixel, without[others].pixel);
    EXPECT_EQ(with[i].descriptor, without[others++].descriptor);
  }
  EXPECT_EQ(others, without.size());
  // As dense as elsewhere: 13 % of the image.
  const double expected = 200.0 * 200.0 / (640.0 * 480.0) * OrbOptions().features;
  EXPECT_NEAR(static_cast<double>(with.size() - others), expected, 0.1 * expected);
}

TEST(OrbExtractor, WholeImageMaskedGivesNothing) {
  const cv::Mat mask(480, 640, CV_8UC1, cv::Scalar(255));
  EXPECT_TRUE(OrbExtractor().extract(textured_image(4), mask).empty());
}

TEST(OrbExtractor, UniformImagesGiveNothing) {
  for (const int grey : {0, 127, 255}) {
    EXPECT_TRUE(OrbExtractor().extract(cv::Mat(480, 640, CV_8UC1, cv::Scalar(grey))).empty()) << grey;
  }
}

TEST(OrbExtractor, FindsTheSamePointsAfterAShift) {
  const cv::Mat image = textured_image(5, 700, 500);
  const cv::Mat left = image(cv::Rect(0, 0, 640, 480)).clone();
  const cv::Mat right = image(cv::Rect(10, 6, 640, 480)).clone();
  const OrbExtractor extractor;
  const auto a = extractor.extract(left);
  const auto b = extractor.extract(right);
  std::vector<Descriptor> pool;
  for (const auto& feature : b) pool.push_back(feature.descriptor);
  int right_place = 0;
  for (const auto& feature : a) {
    const NearestTwo nearest = nearest_two(feature.descriptor, pool);
    const cv::Point2f shift = feature.pixel - b[static_cast<std::size_t>(nearest.best)].pixel;
    const float tolerance = 1.5F * extractor.scale(feature.level);
    if (std::abs(shift.x - 10) < tolerance && std::abs(shift.y - 6) < tolerance) ++right_place;
  }
  EXPECT_GT(right_place, static_cast<int>(0.6 * static_cast<double>(a.size())));
}

TEST(OrbExtractor, IsUnbiasedAcrossLevels) {
  // A symmetric cross: wherever a level sees it, its corners must lie around the same centre.
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(30));
  cv::rectangle(image, {240, 160, 160, 160}, cv::Scalar(220), cv::FILLED);
  const auto features = OrbExtractor().extract(image);
  std::map<int, cv::Point2d> sums;
  std::map<int, int> counts;
  for (const auto& feature : features) {
    sums[feature.level] += cv::Point2d(feature.pixel);
    ++counts[feature.level];
  }
  int checked = 0;
  for (const auto& [level, count] : counts) {
    if (count % 4 != 0) continue;  // not the same number at each of the four corners
    EXPECT_NEAR(sums[level].x / count, 319.5, 1.0) << level;
    EXPECT_NEAR(sums[level].y / count, 239.5, 1.0) << level;
    ++checked;
  }
  EXPECT_GE(checked, 3);
}

TEST(OrbExtractor, MirrorsWithTheImage) {
  // 640 pixels over the scale of a level are no whole number: a level whose pixels were placed by its nominal
  // scale alone would be too narrow or too wide, on the right of the image by a pixel and more.
  const cv::Mat image = textured_image(7);
  cv::Mat mirrored;
  cv::flip(image, mirrored, 1);
  OrbOptions options;
  options.features = 20000;
  options.min_fast_threshold =
      options.fast_threshold;  // so that cells, which are not mirrored, change nothing
  const OrbExtractor extractor(options);
  const auto a = extractor.extract(image);
  const auto b = extractor.extract(mirrored);
  for (int level = 0; level < options.levels; ++level) {
    double sum = 0.0;
    int count = 0;
    for (const auto& feature : a) {
      if (feature.level != level) continue;
      for (const auto& other : b) {
        const cv::Point2f apart(feature.pixel.x + other.pixel.x - 639.0F, feature.pixel.y - other.pixel.y);
        if (other.level != level || cv::norm(apart) > 2.0) continue;
        sum += apart.x;
        ++count;
      }
    }
    ASSERT_GT(count, 50) << level;
    EXPECT_NEAR(sum / count, 0.0, 0.1) << level;
  }
}

TEST(OrbExtractor, RefusesWhatItCannotUse) {
  EXPECT_THROW(OrbExtractor().extract(cv::Mat()), InputError);
  EXPECT_THROW(OrbExtractor().extract(cv::Mat(480, 640, CV_8UC3)), InputError);
  EXPECT_THROW(OrbExtractor().extract(textured_image(1), cv::Mat(10, 10, CV_8UC1)), InputError);
  OrbOptions options;
  options.features = 0;
  EXPECT_THROW(OrbExtractor{options}, OptionsError);
}

TEST(OrbExtractor, TinyImagesDoNotCrash) {
  EXPECT_NO_THROW(OrbExtractor().extract(textured_image(6, 40, 40)));
  EXPECT_NO_THROW(OrbExtractor().extract(textured_image(6, 100, 48)));
}

TEST(Observe, DepthIsUnknownAtEdgesAndWhereInvalid) {
  Camera camera;
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(2.0F));
  depth(cv::Rect(300, 0, 340, 480)) = 3.0F;  // an edge at x = 300
  depth.at<float>(100, 100) = std::nanf("");
  depth.at<float>(100, 120) = -1.0F;
  depth.at<float>(100, 140) = 100.0F;
  std::vector<OrbFeature> features(6);
  features[0].pixel = {50, 50};
  features[1].pixel = {299, 50};
  features[2].pixel = {100, 100};
  features[3].pixel = {120, 100};
  features[4].pixel = {140, 100};
  features[5].pixel = {400, 50};
  const ObservedFrame frame = observe(features, {}, depth, camera, {});
  EXPECT_FLOAT_EQ(frame.depths[0], 2.0F);
  for (const std::size_t i : {1U, 2U, 3U, 4U}) EXPECT_EQ(frame.depths[i], 0.0F) << i;
  EXPECT_FLOAT_EQ(frame.depths[5], 3.0F);
}

TEST(Observe, NoiseIsNotTakenForAnEdge) {
  const Camera camera = *camera_preset("d455");
  for (const float truth : {4.0F, 8.0F, 14.0F}) {
    DepthNoiseOptions noise;
    noise.sure_depth = 20.0;  // no holes
    noise.max_depth = 25.0;
    const cv::Mat depth = stereo_depth(cv::Mat(480, 640, CV_32FC1, cv::Scalar(truth)), camera, noise, 3);
    double sum = 0.0;
    int count = 0;
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        const float believed =
            depth_at(depth, {static_cast<float>(x), static_cast<float>(y)}, DepthOptions{});
        if (believed == 0.0F) continue;
        sum += truth / believed;
        ++count;
      }
    }
    EXPECT_GT(count, 0.9 * static_cast<double>(depth.total())) << truth;
    EXPECT_NEAR(sum / count, 1.0, 2e-4) << truth;  // inverse depth is what noise leaves unbiased
  }
}

}  // namespace
}  // namespace roslam
