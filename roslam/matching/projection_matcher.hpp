// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/map.hpp"
#include "roslam/matching/matcher_options.hpp"

namespace roslam {

/// Predicted observation of a landmark in an image.
struct Prediction {
  Eigen::Vector2f pixel;
  float depth = 0.0F;        ///< metres along the optical axis
  int level = 0;             ///< expected pyramid level
  float view_cosine = 1.0F;  ///< cosine of the angle between viewing direction and Landmark::normal
};

/// Nothing if the landmark lies behind the camera, outside the image, outside its distance limits, or is seen
/// more than 60 degrees off its normal.
std::optional<Prediction> predict(const Landmark& landmark, const Map& map, const ObservedFrame& frame,
                                  const Camera& camera, const SE3& T_camera_world);

/// Finds points of a frame by pixel and descriptor. Keeps scratch memory between searches; not thread safe.
class ProjectionMatcher {
 public:
  explicit ProjectionMatcher(const MatcherOptions& options) : options_(options) {}

  /// One search: pixel, levels, depth and limits.
  struct Query {
    Eigen::Vector2f pixel;
    float radius = 0.0F;  ///< pixels of the full image
    int min_level = 0;
    int max_level = 0;
    float depth = 0.0F;      ///< metres, 0 = any
    int max_distance = 0;    ///< bits
    bool use_ratio = false;  ///< apply the ratio test
  };

  /// Index of the best matching point of the frame that has no landmark in `taken`; -1 if there is none.
  int find(const Query& query, const Descriptor& descriptor, const ObservedFrame& frame,
           const std::vector<LandmarkId>& taken);

  const MatcherOptions& options() const { return options_; }

 private:
  bool is_elsewhere(const Query& query, const ObservedFrame& frame, std::size_t point) const;

  MatcherOptions options_;
  std::vector<std::uint32_t> nearby_;
  std::vector<std::uint32_t> candidates_;
};

/// Pairs (index in a, index in b): for each point of a in `from` its nearest neighbour in b, if it passes
/// strict_distance and the ratio test. Where several share a point of b, the closest. No cross-check.
std::vector<std::pair<std::uint32_t, std::uint32_t>> match_descriptors(const ObservedFrame& a,
                                                                       const std::vector<std::uint32_t>& from,
                                                                       const ObservedFrame& b,
                                                                       const MatcherOptions& options);

/// Rotation consistency check: flags the pairs in the largest bins of a histogram of angle differences
/// (degrees).
std::vector<bool> consistent_rotation(const std::vector<float>& angle_differences);

}  // namespace roslam
