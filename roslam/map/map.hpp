// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/map/ids.hpp"

namespace roslam {

/// A frame kept in the map.
struct Keyframe {
  KeyframeId id;
  std::size_t frame_index = 0;                ///< index of the frame in its source
  double timestamp = 0.0;                     ///< seconds
  SE3 T_camera_world;                         ///< in its world; poses in different worlds cannot be compared
  std::shared_ptr<const ObservedFrame> view;  ///< its points
  std::vector<LandmarkId> landmarks;          ///< landmark each point of the view shows, or none
  WorldId world{0};
  std::uint32_t flight = 0;  ///< which of the flights that made the map it is of; timestamps are the flight's
};

/// Which point of which keyframe shows a landmark.
struct Observation {
  KeyframeId keyframe;
  std::uint32_t point = 0;  ///< index into the keyframe's view
};

/// Two keyframes that were found to show one place, and how they lie to each other.
struct LoopClosure {
  KeyframeId from;
  KeyframeId to;
  SE3 T_to_from;
};

/// A point of the world.
struct Landmark {
  LandmarkId id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world frame, metres
  Eigen::Vector3d normal =
      Eigen::Vector3d::Zero();            ///< mean unit direction from the landmark to its observers
  Descriptor descriptor{};                ///< most typical of its observations
  float min_distance = 0.0F;              ///< metres, nearest distance at which it can be recognised
  float max_distance = 0.0F;              ///< metres, farthest
  std::vector<Observation> observations;  ///< in the order of keyframes
  KeyframeId created_by;
  std::uint32_t predicted = 0;     ///< frames that should have seen it
  std::uint32_t found = 0;         ///< frames that did
  std::uint32_t contradicted = 0;  ///< frames that saw it on something that moves, or saw through it
  cv::Vec3b colour;                ///< BGR
};

/// Keyframes, landmarks and who sees what. Data only: the algorithms live in tracking and mapping. Not thread
/// safe: whoever shares a map guards it.
class Map {
 public:
  /// scales: ratio of the full image to each pyramid level, from which the distances a landmark can be
  /// recognised at follow.
  explicit Map(std::vector<float> scales) : scales_(std::move(scales)) {}

  /// A new keyframe of the flight at hand, that sees no landmark yet.
  KeyframeId add_keyframe(std::size_t frame_index, double timestamp, const SE3& T_camera_world,
                          std::shared_ptr<const ObservedFrame> view, WorldId world = WorldId{0});

  /// A new landmark first seen by that point of that keyframe.
  LandmarkId add_landmark(const Eigen::Vector3d& position, KeyframeId keyframe, std::uint32_t point);

  /// Takes a keyframe as it is but for its id, which is new, and the landmarks it sees, which insert brings.
  KeyframeId insert(Keyframe keyframe);

  /// Takes a landmark as it is but for its id, which is new. Its observations must be of keyframes that live,
  /// in their order, of points that see no other landmark.
  LandmarkId insert(Landmark landmark);

  /// Takes over all that lives in another map, with new ids without gaps, as worlds and flights of its own.
  void append(const Map& other);

  /// Notes that a point of a keyframe shows a landmark. Does nothing and returns false if the point is taken,
  /// or if the keyframe sees the landmark already.
  bool add_observation(LandmarkId landmark, KeyframeId keyframe, std::uint32_t point);

  void remove_observation(LandmarkId landmark, KeyframeId keyframe);
  void remove_landmark(LandmarkId landmark);

  /// Removes a keyframe and its observations. Its pose relative to `anchor` is kept, so that the poses of
  /// frames that refer to it can still be told.
  void remove_keyframe(KeyframeId keyframe, KeyframeId anchor);

  /// Moves all observations of one landmark to another and removes the first.
  void merge_landmarks(LandmarkId from, LandmarkId into);

  /// Notes that two keyframes show one place.
  void add_loop(KeyframeId from, KeyframeId to, const SE3& T_to_from) {
    loops_.push_back({from, to, T_to_from});
  }

  /// All that were noted, between living keyframes: those of removed ones hang on their anchors.
  std::vector<LoopClosure> loops() const;

  /// Notes that keyframes moved that no landmark ties together, as after a loop. What was worked out on an
  /// older state of the map does not fit it any more.
  void note_correction() { ++corrections_; }
  std::size_t corrections() const { return corrections_; }

  /// A world that no keyframe is in yet. The first, 0, is always there.
  WorldId new_world() { return WorldId{++newest_world_}; }

  /// The worlds that have keyframes, oldest first.
  std::vector<WorldId> worlds() const;

  /// The world of a keyframe, also of one that was removed.
  WorldId world_of(KeyframeId id) const { return find(T_camera_anchor(id).first)->world; }

  WorldId world_of(const Landmark& landmark) const {
    return find(landmark.observations.front().keyframe)->world;
  }

  /// Poses of a flight's living keyframes in a world, in the order they were made.
  Trajectory trajectory(std::uint32_t flight, WorldId world) const;

  /// Makes two worlds one that lie to each other by now as they should.
  void join_worlds(WorldId from, WorldId into);

  /// The oldest keyframe of each world, which holds it in place.
  std::set<KeyframeId> origins() const;

  /// Keyframes that follow are of a new flight.
  void begin_flight() { ++flight_; }
  std::uint32_t flight() const { return flight_; }

  /// Nullptr if there is none, or no longer.
  Keyframe* find(KeyframeId id);
  const Keyframe* find(KeyframeId id) const;
  Landmark* find(LandmarkId id);
  const Landmark* find(LandmarkId id) const;

  /// The landmark that took over a merged one's observations; the id itself if it was never merged.
  LandmarkId resolve(LandmarkId id) const;

  /// Pose of a keyframe relative to the living one that it hangs on: itself, unless it was removed.
  std::pair<KeyframeId, SE3> T_camera_anchor(KeyframeId id) const;

  /// Pose of a keyframe, also of one that was removed.
  SE3 T_camera_world(KeyframeId id) const;

  /// Recomputes descriptor, normal and distance limits from the observations.
  void refresh(LandmarkId id);

  /// Recomputes normal and distance limits only: what a move of the landmark or its keyframes changes.
  void refresh_geometry(LandmarkId id);

  /// Keyframes that see landmarks this one sees, and how many; most first, then oldest first.
  std::vector<std::pair<KeyframeId, int>> covisible(KeyframeId id, int min_shared = 1) const;

  /// Living keyframes in the order they were made.
  std::vector<KeyframeId> keyframe_ids() const;
  std::vector<LandmarkId> landmark_ids() const;
  std::size_t keyframe_count() const { return keyframe_count_; }
  std::size_t landmark_count() const { return landmark_count_; }
  std::size_t keyframe_slots() const { return keyframes_.size(); }  ///< ids given out so far
  std::size_t landmark_slots() const { return landmarks_.size(); }  ///< ids given out so far

  std::span<const float> scales() const { return scales_; }
  float scale(int level) const { return scales_[static_cast<std::size_t>(level)]; }

  /// What a point of a view measures.
  Measurement measurement(const ObservedFrame& view, std::uint32_t point,
                          const MeasurementNoise& noise) const {
    return Measurement::make(view.pixels[point], view.depths[point], scale(view.levels[point]), noise);
  }

  /// Level at which a landmark would be found from that distance (metres).
  int predict_level(const Landmark& landmark, double distance) const;

 private:
  struct Anchor {
    KeyframeId keyframe;
    SE3 T_camera_anchor;
  };
  std::vector<float> scales_;
  std::vector<std::unique_ptr<Keyframe>> keyframes_;  // by id; empty once removed
  std::vector<Anchor> anchors_;                       // by keyframe id; where a removed keyframe's pose hangs
  std::vector<std::unique_ptr<Landmark>> landmarks_;  // by id; empty once removed
  std::vector<LandmarkId> merged_into_;               // by landmark id
  std::vector<LoopClosure> loops_;
  std::size_t corrections_ = 0;
  std::uint32_t newest_world_ = 0;
  std::uint32_t flight_ = 0;
  std::size_t keyframe_count_ = 0;
  std::size_t landmark_count_ = 0;
};

}  // namespace roslam
