// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "roslam/map/map.hpp"
#include "roslam/place_recognition/geometric_verifier.hpp"
#include "roslam/tracking/tracking_options.hpp"

namespace roslam {

/// Estimates the pose of a frame without a prior, by geometric verification of keyframes.
class Relocaliser {
 public:
  Relocaliser(const RelocaliserOptions& options, GeometricVerifier verifier)
      : options_(options), verifier_(std::move(verifier)) {}

  /// Tries options.candidates similar keyframes, best first, then as many of the newest; with search_all, in
  /// place of the newest, all keyframes in turn over successive calls.
  std::optional<VerifiedMatch> find(const Map& map, const ObservedFrame& frame,
                                    std::span<const KeyframeId> similar, bool search_all);

 private:
  RelocaliserOptions options_;
  GeometricVerifier verifier_;
  std::size_t next_ = 0;  // position of search_all, counted from the newest keyframe
};

}  // namespace roslam
