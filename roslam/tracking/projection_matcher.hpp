// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/map.hpp"

namespace roslam {

struct MatcherOptions {
  int max_distance = 100;        ///< bits, for matches whose place in the image is predicted
  int strict_distance = 50;      ///< bits, for matches searched over whole images and for fusion
  double ratio = 0.8;            ///< best to second best distance, where both lie on one level
  double frame_radius = 7.0;     ///< pixels at the finest level, search from the last frame
  double map_radius = 3.0;       ///< pixels at the finest level, search for landmarks of the local map
  double fuse_radius = 3.0;      ///< pixels at the finest level, search for duplicates of landmarks
  double depth_tolerance = 0.1;  ///< share of the depth a match may be off by

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// A landmark as it should appear in an image.
struct Prediction {
  Eigen::Vector2f pixel;
  float depth = 0.0F;        ///< metres along the optical axis
  int level = 0;             ///< pyramid level it should be found on
  float view_cosine = 1.0F;  ///< angle between the direction it is seen from now and its mean direction
};

/// Nothing if the landmark lies behind the camera, outside the image, too near or far, or is seen from the
/// side.
std::optional<Prediction> predict(const Landmark& landmark, const Map& map, const ObservedFrame& frame,
                                  const Camera& camera, const SE3& T_camera_world);

/// Finds points of a frame by place and descriptor. Keeps scratch memory between searches; not thread safe.
class ProjectionMatcher {
 public:
  explicit ProjectionMatcher(const MatcherOptions& options) : options_(options) {}

  /// One search: where, on which levels, how deep.
  struct Query {
    Eigen::Vector2f pixel;
    float radius = 0.0F;  ///< pixels of the full image
    int min_level = 0;
    int max_level = 0;
    float depth = 0.0F;      ///< metres, 0 = any
    int max_distance = 0;    ///< bits
    bool use_ratio = false;  ///< refuse if the second best is nearly as good
  };

  /// The point of the frame that fits best and is not taken; -1 if there is none.
  int find(const Query& query, const Descriptor& descriptor, const ObservedFrame& frame,
           const std::vector<LandmarkId>& taken);

  const MatcherOptions& options() const { return options_; }

 private:
  MatcherOptions options_;
  std::vector<std::uint32_t> nearby_;
  std::vector<std::uint32_t> candidates_;
};

/// Pairs (index in a, index in b) of points whose descriptors are each other's clear nearest; indices of a
/// are limited to `from`.
std::vector<std::pair<std::uint32_t, std::uint32_t>> match_descriptors(const ObservedFrame& a,
                                                                       const std::vector<std::uint32_t>& from,
                                                                       const ObservedFrame& b,
                                                                       const MatcherOptions& options);

/// Flags the pairs whose points turned by about the same angle as most; angle differences in degrees.
std::vector<bool> consistent_rotation(const std::vector<float>& angle_differences);

}  // namespace roslam
