// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "roslam/geometry/trajectory.hpp"
#include "roslam/map/keyframe_pose.hpp"
#include "roslam/map/map.hpp"
#include "roslam/slam/frame_result.hpp"
#include "roslam/tracking/keyframe_policy.hpp"
#include "roslam/tracking/tracker.hpp"

namespace roslam {

/// What became of every frame of a session. A frame's pose is kept relative to its reference keyframe, so
/// that corrections of the map move it too. Functions that take a map expect the one of the session; the
/// caller holds its mutex.
class TrajectoryLog {
 public:
  /// index: of the frame in its source.
  void add(const TrackedFrame& frame, std::size_t index, const Map& map);
  /// Withdraws the poses of frames later than that (seconds) before the one last added. Returns how many.
  std::size_t withdraw_after(double timestamp);
  std::size_t withdrawn() const { return withdrawn_; }  ///< so far

  /// Of the frame last added: landmarks that were in view, and those of them that are on dynamic objects.
  void add_evidence(const LandmarksInView& landmarks);

  /// Submaps, other than the main one, whose landmarks turned out to be on dynamic objects in most cases.
  std::set<SubmapId> submaps_on_objects(const Map& map) const;

  void add_rejected(RejectReason reason) { ++rejected_[reason]; }
  void add_clock_reset() { ++clock_resets_; }

  std::size_t frames() const { return records_.size(); }  ///< that were used
  const std::map<TrackingState, std::size_t>& by_state() const { return by_state_; }
  const std::map<RejectReason, std::size_t>& rejected() const { return rejected_; }
  std::size_t clock_resets() const { return clock_resets_; }

  /// Poses of the frames tracked in a submap, in the order of frames. A pose that was predicted while the
  /// scene was hidden is interpolated between the measured ones before and after it, if there are such.
  Trajectory trajectory(const Map& map, SubmapId submap) const;

  /// The same in steps, as the map's mutex must not be held for as long as all frames take: the poses of all
  /// keyframes in one state of the map; the records of frames [begin, end), which never change but by
  /// withdrawal; and the poses of these frames, for which no mutex is needed.
  static std::vector<KeyframePose> keyframe_poses(const Map& map);
  struct Record;
  void copy(std::size_t begin, std::size_t end, std::vector<Record>& records) const;
  static Trajectory placed(const std::vector<Record>& records, const std::vector<KeyframePose>& keyframes,
                           SubmapId submap);

  /// The pose of a keyframe in the camera frame of an earlier frame: T_frame_keyframe. Nothing if that frame
  /// has no pose, is of another submap or is more than max_age (seconds) older than the newest frame.
  std::optional<SE3> T_frame_keyframe(const Map& map, std::size_t frame_index, KeyframeId keyframe,
                                      double max_age) const;

  std::map<SubmapId, std::size_t> frames_by_submap(const Map& map) const;

  /// Of several submaps: one of the map that was loaded, if any frame was tracked in it, else the one with
  /// most frames.
  SubmapId main_submap(const Map& map) const;

  /// True if a frame was tracked in the map that was loaded.
  bool found_in_loaded_map(const Map& map) const;

  struct Record {
    std::size_t index;     ///< of the frame in its source
    double timestamp;      ///< seconds
    KeyframeId reference;  ///< invalid: not tracked
    SE3 T_camera_reference;
    float share_on_objects = 0.0F;  ///< of the landmarks in view
    TrackingState state = TrackingState::kLost;

    bool is_measured() const { return state == TrackingState::kTracking; }
  };

 private:
  struct OfReference {  // of the frames that refer to a keyframe
    std::size_t frames = 0;
    int measured = 0;
    double share_on_objects = 0.0;  // sum over the measured ones
  };
  OfReference* of_reference(const Record& record);

  std::vector<Record> records_;
  std::vector<OfReference> of_references_;  // by keyframe id
  std::map<TrackingState, std::size_t> by_state_;
  std::map<RejectReason, std::size_t> rejected_;
  std::size_t clock_resets_ = 0;
  std::size_t withdrawn_ = 0;
};

}  // namespace roslam
