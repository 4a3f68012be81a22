// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roslam/features/orb_extractor.hpp"

namespace roslam::evaluation {

/// Numbers of features that a mask keeps and removes.
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

/// How completely features on actors (objects that really move) were removed, and what else was removed.
/// Tallies count the features extracted without a mask, since with one the extractor spends the freed budget
/// elsewhere.
struct RemovalError {
  PointTally on_actors;
  PointTally near_actors;  ///< on the static scene, at most kNearActor pixels from an actor
  PointTally beyond;       ///< on the static scene, farther away
  PointTally at_rest;      ///< on movable objects at rest: neither an error, nor part of the static scene

  std::size_t run_points = 0;  ///< features that the run kept with its masks
  std::size_t run_points_on_actors = 0;

  std::uint64_t pixels = 0;
  std::uint64_t actor_pixels = 0;
  std::uint64_t removed_pixels = 0;        ///< in the mask as dilated by the run
  std::uint64_t removed_actor_pixels = 0;  ///< pixels of actors in that mask

  std::size_t frames = 0;            ///< compared
  std::size_t with_mask = 0;         ///< frames compared of which the run removed something
  std::size_t without_truth = 0;     ///< frames skipped: the true mask is missing or unusable
  std::size_t without_mask = 0;      ///< frames skipped: the mask of the run is missing or unusable
  std::size_t not_in_run = 0;        ///< frames skipped: the run dropped or never reached them
  std::size_t unlike_run = 0;        ///< frames compared whose number of points differs from the run's
  std::size_t unlike_with_mask = 0;  ///< those of them of which the run removed something
  bool interrupted = false;          ///< the last frames are missing

  PointTally on_static_scene() const;
  /// Shares of points and of pixels; NaN for an empty denominator.
  double run_actor_share() const;
  double actor_share() const;
  double removed_share() const;
  double actor_recall() const;
};

/// True masks of a frame, of its size.
struct MovingTruth {
  cv::Mat actors;   ///< CV_8UC1, nonzero on objects that really move
  cv::Mat at_rest;  ///< CV_8UC1, nonzero on movable objects at rest; empty = none
};

/// Numbers of features that a run counted in a frame.
struct CountedPoints {
  std::size_t kept = 0;
  std::size_t removed = 0;
  std::size_t beside = 0;  ///< of those removed, outside the dilated mask but within the extractor's margin

  bool operator==(const CountedPoints&) const = default;
};

/// What a run removed from a frame, before dilation.
struct RemovedThings {
  cv::Mat mask;     ///< CV_8UC1, nonzero on what was removed; empty = nothing
  cv::Mat resting;  ///< CV_8UC1, the part of mask that the run classified as at rest; empty = nothing
  std::optional<CountedPoints> points;  ///< nullopt = not known
};

/// Extracts the features of frames again, without a mask and with that of a run, and counts what they lie on.
class RemovalComparison {
 public:
  /// orb, margin: options of the run; margin: pixels by which it dilated its masks. Throws OptionsError.
  RemovalComparison(const OrbOptions& orb, int margin);

  /// grey: CV_8UC1, the frame. A run keeps features on objects at rest if it has few others, but does not
  /// record that; it is assumed if only then the number of features equals the run's. Throws InputError if
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

}  // namespace roslam::evaluation
