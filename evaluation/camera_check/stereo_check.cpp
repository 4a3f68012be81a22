// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/stereo_check.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/common/formatted.hpp"
#include "roslam/features/descriptor.hpp"
#include "roslam/features/orb_extractor.hpp"

namespace roslam::evaluation {

namespace {
constexpr std::size_t kPairs = 30, kEvery = 5, kFrames = 1500;  // frames
constexpr std::size_t kEnough = 300;                            // matches
constexpr double kMostOffset = 30.0;                            // pixels
constexpr double kAround = 3.0;                                 // pixels, of the most frequent offset

struct Match {
  cv::Point2f left;
  float disparity = 0.0F;
  float offset = 0.0F;  // of rows
};

std::vector<OrbFeature> features_of(const OrbExtractor& extractor, const cv::Mat& image) {
  cv::Mat grey = image;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return extractor.extract(grey);
}

std::vector<Descriptor> descriptors_of(const std::vector<OrbFeature>& features) {
  std::vector<Descriptor> descriptors;
  for (const OrbFeature& feature : features) descriptors.push_back(feature.descriptor);
  return descriptors;
}

// Features that are each other's nearest by descriptor.
void match(const std::vector<OrbFeature>& left, const std::vector<OrbFeature>& right,
           std::vector<Match>& matches) {
  constexpr int kMostDistance = 40;  // bits
  const auto of_left = descriptors_of(left), of_right = descriptors_of(right);
  for (std::size_t i = 0; i < left.size(); ++i) {
    const NearestTwo there = nearest_two(of_left[i], of_right);
    if (there.best < 0 || there.best_distance > kMostDistance) continue;
    const auto j = static_cast<std::size_t>(there.best);
    if (nearest_two(of_right[j], of_left).best != static_cast<int>(i) || left[i].level != right[j].level)
      continue;
    const cv::Point2f moved = left[i].pixel - right[j].pixel;
    if (std::abs(moved.y) < kMostOffset) matches.push_back({left[i].pixel, moved.x, -moved.y});
  }
}

// Keeps the matches around the most frequent offset: the others are wrong.
void keep_consistent(std::vector<Match>& matches) {
  constexpr int kBins = 121;  // of half a pixel
  std::vector<int> histogram(kBins);
  const auto bin_of = [](float offset) {
    return static_cast<std::size_t>(std::lround(2.0F * offset) + kBins / 2);
  };
  for (const Match& each : matches) ++histogram[bin_of(each.offset)];
  const auto peak = std::max_element(histogram.begin(), histogram.end()) - histogram.begin();
  const double offset = 0.5 * static_cast<double>(peak - kBins / 2);
  std::erase_if(matches, [&](const Match& each) { return std::abs(each.offset - offset) > kAround; });
}

double median_offset(const std::vector<Match>& matches) {
  std::vector<float> offsets;
  for (const Match& each : matches) offsets.push_back(each.offset);
  std::nth_element(offsets.begin(), offsets.begin() + static_cast<std::ptrdiff_t>(offsets.size() / 2),
                   offsets.end());
  return offsets[offsets.size() / 2];
}

// A roll of one camera against the other, or another focal length, makes offsets grow over the image.
double worst_offset(const std::vector<Match>& matches, const Camera& camera) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  const auto at = [&](double u, double v) {
    return Eigen::Vector3d(1.0, (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
  };
  for (const Match& each : matches) {
    const Eigen::Vector3d row = at(each.left.x, each.left.y);
    normal += row * row.transpose();
    right_side += each.offset * row;
  }
  const Eigen::Vector3d fit = normal.ldlt().solve(right_side);
  double worst = 0.0;
  for (const double u : {0.0, camera.width - 1.0})
    for (const double v : {0.0, camera.height - 1.0}) worst = std::max(worst, std::abs(fit.dot(at(u, v))));
  return worst;
}

void judge_order(StereoCheck& check) {
  constexpr double kMost = 0.6;
  const int left = static_cast<int>(std::lround(100.0 * check.to_the_left)),
            right = static_cast<int>(std::lround(100.0 * check.to_the_right));
  check.order.words = formatted(
      "points lie farther left in the right image for %d %% of the matches, farther "
      "right for %d %%",
      left, right);
  if (check.to_the_right > kMost) {
    check.order.verdict = Verdict::kDoesNotFit;
    check.order.remedy = "left and right images are swapped: exchange the folders or topics";
  } else if (check.to_the_left > kMost) {
    check.order.verdict = Verdict::kFits;
  }
}

void judge_rows(StereoCheck& check) {
  constexpr double kRight = 0.7, kWrong = 1.2;  // pixels
  check.rows.words = formatted(
      "points are %.2f pixels lower in the right image (median), %.2f pixels off in the "
      "worst corner",
      check.offset, check.worst);
  if (check.worst <= kRight) {
    check.rows.verdict = Verdict::kFits;
  } else if (check.worst > kWrong) {
    check.rows.verdict = Verdict::kDoesNotFit;
    check.rows.remedy =
        "calibrate the pair again: the rotation between the cameras or the lens of one has changed";
  }
}
}  // namespace

StereoCheck check_stereo(FrameSource& source, const std::string& name,
                         const std::function<void(std::size_t, std::size_t)>& progress,
                         const std::stop_token& stop) {
  StereoCheck check;
  const OrbExtractor extractor;
  std::vector<Match> matches;
  for (std::size_t i = 0; check.pairs < kPairs && i < kFrames; ++i) {
    const auto frame = source.next(stop);
    if (stop.stop_requested()) throw InputError(name + ": interrupted before the check was done");
    if (!frame) break;
    if (i % kEvery != 0 || frame->right.empty()) continue;
    match(features_of(extractor, frame->colour), features_of(extractor, frame->right), matches);
    progress(++check.pairs, kPairs);
  }
  if (check.pairs == 0) throw InputError(name + ": has no stereo pair; give a source of two cameras");
  keep_consistent(matches);
  check.matches = matches.size();
  if (check.matches < kEnough) {
    check.order.words = check.rows.words = formatted("only %zu points were matched", check.matches);
    return check;
  }
  const auto share = [&](auto&& has) {
    return static_cast<double>(std::count_if(matches.begin(), matches.end(), has)) /
           static_cast<double>(matches.size());
  };
  check.to_the_left = share([](const Match& each) { return each.disparity > 1.0F; });
  check.to_the_right = share([](const Match& each) { return each.disparity < -1.0F; });
  check.offset = median_offset(matches);
  check.worst = worst_offset(matches, source.camera());
  judge_order(check);
  judge_rows(check);
  return check;
}

}  // namespace roslam::evaluation
