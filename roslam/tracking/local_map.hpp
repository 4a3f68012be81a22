// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/map/map.hpp"
#include "roslam/tracking/tracking_options.hpp"

namespace roslam {

/// The part of the map around a frame: the keyframes that share landmarks with it, those covisible with the
/// reference keyframe, and the landmarks of all these.
class LocalMap {
 public:
  explicit LocalMap(const LocalMapOptions& options) : options_(options) {}

  /// seen: landmark of each point of the frame, or none. If there is none at all, fallback is the reference.
  void update(const Map& map, const std::vector<LandmarkId>& seen, KeyframeId fallback);

  /// Those that share most landmarks with the frame first.
  const std::vector<KeyframeId>& keyframes() const { return keyframes_; }

  const std::vector<LandmarkId>& landmarks() const { return landmarks_; }

  /// The keyframe that shares most landmarks with the frame.
  KeyframeId reference() const { return reference_; }

 private:
  void collect_keyframes(const Map& map, const std::vector<LandmarkId>& seen, KeyframeId fallback);
  void collect_landmarks(const Map& map);

  LocalMapOptions options_;
  std::vector<KeyframeId> keyframes_;
  std::vector<LandmarkId> landmarks_;
  KeyframeId reference_;
  std::vector<bool> is_in_;  // by landmark id
};

}  // namespace roslam
