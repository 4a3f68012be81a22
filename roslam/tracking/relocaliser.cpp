// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/relocaliser.hpp"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "roslam/error.hpp"

namespace roslam {

namespace {
SE3 from_rodrigues(const cv::Mat& rotation, const cv::Mat& translation) {
  const Eigen::Vector3d omega(rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2));
  return {so3_exp(omega),
          Eigen::Vector3d(translation.at<double>(0), translation.at<double>(1), translation.at<double>(2))};
}
}  // namespace

void RelocaliserOptions::validate() const {
  if (min_matches < 4) throw OptionsError("relocaliser.min_matches must be at least 4");
  if (min_inliers < 4) throw OptionsError("relocaliser.min_inliers must be at least 4");
  if (candidates < 1) throw OptionsError("relocaliser.candidates must be at least 1");
  if (iterations < 1) throw OptionsError("relocaliser.iterations must be at least 1");
  if (!(max_error > 0.0)) throw OptionsError("relocaliser.max_error must be positive (pixels)");
}

std::optional<RelocalisedPose> Relocaliser::find(const Map& map, const ObservedFrame& frame,
                                                 const Camera& camera, std::span<const KeyframeId> similar,
                                                 bool search_all) {
  for (const KeyframeId id :
       similar.first(std::min(similar.size(), static_cast<std::size_t>(options_.candidates)))) {
    const Keyframe* keyframe = map.find(id);
    if (keyframe == nullptr) continue;
    if (auto pose = recognise(map, *keyframe, frame, camera, options_, matcher_)) return pose;
  }
  std::vector<KeyframeId> keyframes = map.keyframe_ids();
  std::reverse(keyframes.begin(), keyframes.end());
  if (keyframes.empty()) return std::nullopt;
  if (!search_all) next_ = 0;
  const auto tries = std::min(static_cast<std::size_t>(options_.candidates), keyframes.size());
  for (std::size_t i = 0; i < tries; ++i) {
    const Keyframe& keyframe = *map.find(keyframes[(next_ + i) % keyframes.size()]);
    if (auto pose = recognise(map, keyframe, frame, camera, options_, matcher_)) return pose;
  }
  if (search_all) next_ = (next_ + tries) % keyframes.size();
  return std::nullopt;
}

std::optional<RelocalisedPose> recognise(const Map& map, const Keyframe& keyframe, const ObservedFrame& frame,
                                         const Camera& camera, const RelocaliserOptions& options,
                                         const MatcherOptions& matcher) {
  std::vector<std::uint32_t> known;
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (keyframe.landmarks[i].is_valid()) known.push_back(i);
  }
  const auto matches = match_descriptors(*keyframe.view, known, frame, matcher);
  if (static_cast<int>(matches.size()) < options.min_matches) return std::nullopt;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const auto& [in_keyframe, in_frame] : matches) {
    const Eigen::Vector3d& p = map.find(keyframe.landmarks[in_keyframe])->position;
    points.emplace_back(p.x(), p.y(), p.z());
    pixels.emplace_back(frame.pixels[in_frame].x(), frame.pixels[in_frame].y());
  }
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::Mat rotation;
  cv::Mat translation;
  std::vector<int> inliers;
  constexpr double kConfidence = 0.999;
  bool found = false;
  try {
    found = cv::solvePnPRansac(points, pixels, matrix, cv::noArray(), rotation, translation, false,
                               options.iterations, static_cast<float>(options.max_error), kConfidence,
                               inliers, cv::SOLVEPNP_P3P);
  } catch (const cv::Exception&) {  // a degenerate sample
    return std::nullopt;
  }
  if (!found || static_cast<int>(inliers.size()) < options.min_inliers) return std::nullopt;
  RelocalisedPose result{from_rodrigues(rotation, translation), std::vector<LandmarkId>(frame.size()),
                         keyframe.id};
  if (!result.T_camera_world.is_finite()) return std::nullopt;
  for (const int i : inliers) {
    const auto& [in_keyframe, in_frame] = matches[static_cast<std::size_t>(i)];
    result.landmarks[in_frame] = keyframe.landmarks[in_keyframe];
  }
  return result;
}

}  // namespace roslam
