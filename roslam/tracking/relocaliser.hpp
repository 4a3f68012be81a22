// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "roslam/map/map.hpp"
#include "roslam/place_recognition/geometric_verifier.hpp"
#include "roslam/tracking/tracking_options.hpp"

namespace roslam {

/// Estimates the pose of a frame without a prior, by geometric verification of keyframes.
class Relocaliser {
 public:
  Relocaliser(const RelocaliserOptions& options, GeometricVerifier verifier)
      : options_(options), verifier_(std::move(verifier)) {}

  /// Verifies at most options.tries keyframes: the most similar one, and in turn over successive calls the
  /// next options.candidates similar ones (best first) and the newest; with search_all, in place of the
  /// newest, all keyframes.
  std::optional<VerifiedMatch> find(const Map& map, const ObservedFrame& frame,
                                    std::span<const KeyframeId> similar, bool search_all);

  /// To be called when the camera is tracked: turns begin again with the best and the newest keyframes.
  void restart() { next_similar_ = next_other_ = 0; }

  /// The keyframes that the last find() chose to verify, in this order; it ends with the first match.
  std::span<const KeyframeId> chosen() const { return chosen_; }

 private:
  void choose(std::span<const KeyframeId> similar, std::span<const KeyframeId> others);

  RelocaliserOptions options_;
  GeometricVerifier verifier_;
  std::vector<KeyframeId> chosen_;
  std::size_t next_similar_ = 0;  // turns: position after the most similar keyframe
  std::size_t next_other_ = 0;    // position counted from the newest keyframe
};

}  // namespace roslam
