// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/estimation/measurement_model.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/map/ids.hpp"

namespace roslam {

struct MapParts;

/// A frame kept in the map.
struct ROSLAM_EXPORT Keyframe {
  KeyframeId id;
  std::size_t frame_index = 0;                ///< index of the frame in its source
  double timestamp = 0.0;                     ///< seconds
  SE3 T_camera_world;                         ///< in the world frame of its submap
  std::shared_ptr<const ObservedFrame> view;  ///< its features
  std::vector<LandmarkId> landmarks;          ///< landmark observed by each point of the view, or none
  SubmapId submap{0};
  std::uint32_t session = 0;  ///< recording session it is from; timestamps are of that session
};

/// The point of a keyframe that observes a landmark.
struct ROSLAM_EXPORT Observation {
  KeyframeId keyframe;
  std::uint32_t point = 0;  ///< index into the keyframe's view
};

/// Two keyframes that show the same place, and their relative pose.
struct ROSLAM_EXPORT LoopClosure {
  KeyframeId from;
  KeyframeId to;
  SE3 T_to_from;
};

/// A mapped point.
struct ROSLAM_EXPORT Landmark {
  LandmarkId id;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< world frame of its submap, metres
  Eigen::Vector3d normal =
      Eigen::Vector3d::Zero();            ///< mean unit direction from the landmark to its observers
  Descriptor descriptor{};                ///< most typical of its observations
  float min_distance = 0.0F;              ///< metres, nearest distance at which it can be recognised
  float max_distance = 0.0F;              ///< metres, farthest
  std::vector<Observation> observations;  ///< by ascending keyframe id; never empty
  KeyframeId created_by;
  std::uint32_t times_visible = 0;  ///< frames in whose view it was predicted to be
  std::uint32_t times_found = 0;    ///< frames that it was matched in
  std::uint32_t contradicted = 0;   ///< frames that saw it on a moving object, or saw through it
  cv::Vec3b colour;                 ///< BGR
};

/// Keyframes, landmarks and observations. Data only: the algorithms are in tracking and mapping. Not thread
/// safe: guard a shared map with a MapMutex.
class ROSLAM_EXPORT Map {
 public:
  /// scales: ratio of the full image to each pyramid level; determines the distances at which landmarks can
  /// be recognised.
  explicit Map(std::vector<float> scales) : scales_(std::move(scales)) {}

  /// Adds a keyframe of the current session, without observations.
  KeyframeId add_keyframe(std::size_t frame_index, double timestamp, const SE3& T_camera_world,
                          std::shared_ptr<const ObservedFrame> view, SubmapId submap = SubmapId{0});

  /// Adds a landmark first observed by a point of a keyframe. position: world frame, metres.
  LandmarkId add_landmark(const Eigen::Vector3d& position, KeyframeId keyframe, std::uint32_t point);

  /// Inserts a copy of a keyframe with a new id and without observations, which inserting landmarks adds.
  KeyframeId insert(Keyframe keyframe);

  /// Inserts a copy of a landmark with a new id. Its observations must be of existing keyframes, by ascending
  /// id, and of points that observe no other landmark.
  LandmarkId insert(Landmark landmark);

  /// Inserts all elements of another map, with new ids without gaps, as separate submaps and sessions. Leaves
  /// out what refers to elements that are not among them.
  void append(const MapParts& other);

  /// Adds an observation. Does nothing and returns false if the point observes another landmark, or if the
  /// keyframe observes this landmark already.
  bool add_observation(LandmarkId landmark, KeyframeId keyframe, std::uint32_t point);

  void remove_observation(LandmarkId landmark, KeyframeId keyframe);
  void remove_landmark(LandmarkId landmark);

  /// Removes a keyframe and its observations. Its pose relative to `anchor` is kept, so that the poses of
  /// frames that refer to it can still be computed.
  void remove_keyframe(KeyframeId keyframe, KeyframeId anchor);

  /// Marks a keyframe whose pose turned out to be wrong: nothing may be computed from it any more. Its loops
  /// are forgotten.
  void withdraw(KeyframeId keyframe);
  bool is_withdrawn(KeyframeId keyframe) const { return withdrawn_.contains(keyframe); }

  /// Removes a withdrawn keyframe. It stays if it is the only one of its submap.
  void remove_withdrawn(KeyframeId keyframe);

  /// Moves all observations of one landmark to another and removes the first.
  void merge_landmarks(LandmarkId from, LandmarkId into);

  /// Adds a loop closure.
  void add_loop(KeyframeId from, KeyframeId to, const SE3& T_to_from) {
    loops_.push_back({from, to, T_to_from});
  }

  /// All loop closures, between existing keyframes: those of removed ones are transferred to their anchors.
  std::vector<LoopClosure> loops() const;

  /// Records a global correction, such as a loop closure or the merging of submaps: results computed on an
  /// older state of the map no longer fit it.
  void note_correction() { ++corrections_; }
  std::size_t corrections() const { return corrections_; }

  /// Id of a new submap, without keyframes. The first submap, 0, always exists.
  SubmapId new_submap() { return SubmapId{++newest_submap_}; }

  /// The submaps that have keyframes, oldest first.
  std::vector<SubmapId> submaps() const;

  /// The submap of a keyframe, also of a removed one. Throws UsageError for an id that was never given out.
  SubmapId submap_of(KeyframeId id) const { return find(T_camera_anchor(id).first)->submap; }

  SubmapId submap_of(const Landmark& landmark) const {
    return find(landmark.observations.front().keyframe)->submap;
  }

  /// Poses of a session's existing keyframes in a submap, in order of creation.
  Trajectory trajectory(std::uint32_t session, SubmapId submap) const;

  /// Moves all of a submap into another world frame.
  void transform(SubmapId submap, const SE3& T_new_old);

  /// Merges two submaps whose poses are already aligned.
  void merge_submaps(SubmapId from, SubmapId into);

  /// The oldest keyframe of each submap, which fixes the gauge of bundle adjustment.
  std::set<KeyframeId> origins() const;

  /// Starts a new session, to which keyframes added from now on belong.
  void begin_session() { ++session_; }
  std::uint32_t session() const { return session_; }

  /// Nullptr if it does not exist or was removed.
  Keyframe* find(KeyframeId id);
  const Keyframe* find(KeyframeId id) const;
  Landmark* find(LandmarkId id);
  const Landmark* find(LandmarkId id) const;

  /// The landmark that took over a merged one's observations; the id itself if it was never merged.
  LandmarkId resolve(LandmarkId id) const;

  /// Pose of a keyframe relative to its existing anchor, which is itself unless it was removed. Throws
  /// UsageError for an id that was never given out.
  std::pair<KeyframeId, SE3> T_camera_anchor(KeyframeId id) const;

  /// Pose of a keyframe, also of a removed one. Throws UsageError for an id that was never given out.
  SE3 T_camera_world(KeyframeId id) const;

  /// Recomputes descriptor, normal and distance limits from the observations.
  void refresh(LandmarkId id);

  /// Recomputes normal and distance limits only, after the landmark or its keyframes moved.
  void refresh_geometry(LandmarkId id);

  /// Keyframes that share landmarks with this one, and how many; most first, then oldest first.
  std::vector<std::pair<KeyframeId, int>> covisible(KeyframeId id, int min_shared = 1) const;

  /// Existing keyframes in order of creation.
  std::vector<KeyframeId> keyframe_ids() const;
  std::vector<LandmarkId> landmark_ids() const;
  std::size_t keyframe_count() const { return keyframe_count_; }
  std::size_t landmark_count() const { return landmark_count_; }
  std::size_t keyframe_slots() const { return keyframes_.size(); }  ///< ids assigned so far
  std::size_t landmark_slots() const { return landmarks_.size(); }  ///< ids assigned so far

  std::span<const float> scales() const { return scales_; }
  float scale(int level) const { return scales_[static_cast<std::size_t>(level)]; }

  /// The measurement of a point, with its noise.
  Measurement measurement(const ObservedFrame& view, std::uint32_t point,
                          const MeasurementNoise& noise) const {
    return Measurement::make(view.pixels[point], view.depths[point], scale(view.levels[point]),
                             noise.known_of(view.pixel_sigma, view.depth_noise),
                             view.inverse_depth_sigma(point));
  }

  /// Pyramid level at which a landmark is expected from a distance (metres).
  int predict_level(const Landmark& landmark, double distance) const;

 private:
  struct Anchor {
    KeyframeId keyframe;
    SE3 T_camera_anchor;
  };
  std::vector<float> scales_;
  std::vector<std::unique_ptr<Keyframe>> keyframes_;  // by id; empty once removed
  std::set<KeyframeId> withdrawn_;
  std::vector<Anchor> anchors_;                       // by keyframe id; set for removed keyframes
  std::vector<std::unique_ptr<Landmark>> landmarks_;  // by id; empty once removed
  std::vector<LandmarkId> merged_into_;               // by landmark id
  std::vector<LoopClosure> loops_;
  std::size_t corrections_ = 0;
  std::uint32_t newest_submap_ = 0;
  std::uint32_t session_ = 0;
  std::size_t keyframe_count_ = 0;
  std::size_t landmark_count_ = 0;
};

}  // namespace roslam
