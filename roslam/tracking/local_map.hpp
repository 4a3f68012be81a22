// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/map/map.hpp"

namespace roslam {

struct LocalMapOptions {
  int max_keyframes = 40;  ///< keyframes whose landmarks are searched for
  int neighbours = 5;      ///< covisible keyframes added for each keyframe that sees the frame's landmarks

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// The part of the map around a frame: the keyframes that see what it sees, their neighbours, and all their
/// landmarks.
class LocalMap {
 public:
  explicit LocalMap(const LocalMapOptions& options) : options_(options) {}

  /// seen: landmark of each point of the frame, or none. If none is seen, fallback and its neighbours serve.
  void update(const Map& map, const std::vector<LandmarkId>& seen, KeyframeId fallback);

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
