// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roslam/features/orb_extractor.hpp"

namespace roslam {

/// How many points a mask leaves and takes.
struct PointTally {
  std::size_t kept = 0;
  std::size_t removed = 0;

  /// Shares of both together; NaN where there are none.
  double kept_share() const;
  double removed_share() const;
  PointTally& operator+=(const PointTally& other);
  bool operator==(const PointTally&) const = default;
};

inline constexpr int kNearActor = 10;  ///< pixels from an actor's silhouette that count as near

/// How well the points on things that really move, the actors, were removed, and what else went with them.
/// Tallies are of the points that pictures have without a mask: unlike those of the run they do not depend on
/// where a budget goes that a mask set free.
struct RemovalError {
  PointTally on_actors;
  PointTally near_actors;  ///< on the static scene, at most kNearActor pixels from an actor
  PointTally beyond;       ///< on the static scene, farther away
  PointTally at_rest;      ///< on things that can move but rest: right either way, no part of the scene

  std::size_t run_points = 0;  ///< that the run had under its masks
  std::size_t run_points_on_actors = 0;

  std::uint64_t pixels = 0;
  std::uint64_t actor_pixels = 0;
  std::uint64_t removed_pixels = 0;        ///< under the mask as the run dilated it
  std::uint64_t removed_actor_pixels = 0;  ///< of the actors' under that mask

  std::size_t frames = 0;            ///< compared
  std::size_t with_mask = 0;         ///< frames compared of which the run removed something
  std::size_t without_truth = 0;     ///< frames left out: the true mask is missing or unusable
  std::size_t without_mask = 0;      ///< frames left out: the mask of the run is missing or unusable
  std::size_t not_in_run = 0;        ///< frames left out: the run dropped or never reached them
  std::size_t unlike_run = 0;        ///< frames compared whose points are not as many as the run counted
  std::size_t unlike_with_mask = 0;  ///< those of them of which the run removed something
  bool interrupted = false;          ///< frames are missing at the end

  PointTally on_static_scene() const;
  /// Shares of points and of pixels; NaN where there is nothing to divide by.
  double run_actor_share() const;
  double actor_share() const;
  double removed_share() const;
  double actor_recall() const;
};

/// What is true of a frame.
struct MovingTruth {
  cv::Mat actors;   ///< CV_8UC1, nonzero on what really moves
  cv::Mat at_rest;  ///< CV_8UC1, nonzero on what can move but rests; empty = nothing
};

/// How many points a run counted in a frame.
struct CountedPoints {
  std::size_t kept = 0;
  std::size_t removed = 0;
  std::size_t beside =
      0;  ///< of those removed, next to the dilated mask: extraction keeps some pixels off it

  bool operator==(const CountedPoints&) const = default;
};

/// What a run removed from a frame, before dilation.
struct RemovedThings {
  cv::Mat mask;     ///< CV_8UC1, nonzero on what was removed; empty = nothing
  cv::Mat resting;  ///< CV_8UC1, the part of mask that the run took to be at rest; empty = nothing
  std::optional<CountedPoints> points;  ///< if they are known
};

/// Extracts the points of frames once more, without a mask and under that of a run, and counts what they lie
/// on.
class RemovalComparison {
 public:
  /// orb, margin: of the run; pixels its masks were dilated by. Throws OptionsError.
  RemovalComparison(const OrbOptions& orb, int margin);

  /// grey: CV_8UC1, the frame. A run lets points on things at rest through where it has few others, and does
  /// not tell; this is taken to be so if only then the number of points is the run's. Throws InputError if
  /// sizes or types differ.
  void add(const cv::Mat& grey, const MovingTruth& truth, const RemovedThings& run);

  const RemovalError& error() const { return error_; }

 private:
  struct Extraction;

  Extraction extract(const cv::Mat& grey, const cv::Mat& mask) const;
  Extraction extract_as_run(const cv::Mat& grey, const RemovedThings& run);

  OrbExtractor extractor_;
  int margin_;
  RemovalError error_;
};

/// A Markdown table that also reads well as plain text, and one JSON object (null where there is no value).
std::string to_markdown(const RemovalError& error);
std::string to_json(const RemovalError& error);

}  // namespace roslam
