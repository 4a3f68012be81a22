// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/cloud/dense_mapper.hpp"
#include "roslam/cloud/dense_view.hpp"
#include "roslam/cloud/occupancy.hpp"
#include "roslam/cloud/surface.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/pipeline/keyframe_jobs.hpp"
#include "roslam/pipeline/keyframe_worker.hpp"
#include "roslam/pipeline/options.hpp"
#include "roslam/pipeline/statistics.hpp"
#include "roslam/removal/dynamic_removal.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"
#include "roslam/sources/frame_source.hpp"

namespace roslam {

/// A keyframe as the dense map takes it.
struct DenseKeyframe {
  Frame frame;  ///< as taken; its images must not be changed afterwards
  Removal removal;
  cv::Mat labels;                 ///< of this frame or an earlier one, CV_8UC1; empty: none are known
  SE3 T_labelled_camera;          ///< where the camera was to where it was when the labels were taken
  bool has_older_labels = false;  ///< the labels are of an earlier frame
  bool is_restored = false;       ///< comes in two parts: the second is what restored() tells of it
};

/// The dense map of a flight and what it took.
struct DenseMap {
  Surface surface;                    ///< world frame of the flight
  std::vector<SurfacePoint> removed;  ///< what was left out of it, as keyframes saw it; without normals
  std::shared_ptr<const Occupancy> occupancy;  ///< null if there are no surfaces
  double voxel_size = 0.0;                     ///< metres; 0: no keyframe had depth
  int times_coarsened = 0;    ///< by a factor of two each, to stay within DenseOptions::max_memory
  std::size_t keyframes = 0;  ///< that were fused
  std::size_t dropped = 0;    ///< keyframes there was no time for
  std::size_t moved = 0;      ///< times that a keyframe was fused anew as it had moved
  std::size_t voxel_bytes = 0, view_bytes = 0;
  std::map<std::string, std::size_t> faults;  ///< what cost keyframes, in words
};

/// Why a map without surfaces has none, in words.
std::string_view why_empty(const DenseMap& map);

/// Fuses keyframes into a dense map as they come, on a thread of its own: the tracker never waits, and what
/// goes wrong costs a keyframe and nothing else. In deterministic mode each is fused at once.
class DenseWorker {
 public:
  /// places_of: called on the worker's thread. Throws CalibrationError or OptionsError.
  DenseWorker(const Camera& camera, const Options& options, Mode mode, PlacesOf places_of);

  void submit(KeyframeId keyframe, DenseKeyframe input);

  /// What became of the static scene in a keyframe that waits for it; null: nothing, it keeps its holes.
  void restored(KeyframeId keyframe, const RestoredView* view);

  /// Waits until all are fused, and lets the map follow the keyframes to where they are in the end.
  void drain();

  /// The map by then. Only after drain().
  DenseMap result(WorldId world) const;

  StageTimes times() const { return worker_.times(); }

 private:
  struct Job {
    DenseKeyframe input;
    std::optional<RestoredView> restored;
  };
  // A point of something that was removed, in the camera frame of its keyframe.
  struct RemovedPoint {
    Eigen::Vector3f position;
    cv::Vec3b colour;
  };

  void queue(KeyframeId keyframe, Job job);
  void work(KeyframeId keyframe, StageTimes& times);
  void fuse(KeyframeId keyframe, const Job& job);
  std::vector<RemovedPoint> removed_points(const Frame& frame, const cv::Mat& hidden) const;
  std::map<KeyframeId, KeyframePlace> places(const std::vector<KeyframeId>& ids) const;
  void follow(double share);
  void add_occupancy(WorldId world, DenseMap& map) const;

  DenseOptions options_;
  DepthOptions depth_;
  int margin_;  // pixels
  Mode mode_;
  PlacesOf places_of_;
  ViewReducer reducer_;

  // By the worker's thread.
  DenseMapper mapper_;
  std::map<KeyframeId, std::vector<RemovedPoint>> removed_;
  std::size_t since_followed_ = 0;  // keyframes
  std::size_t moved_ = 0;

  std::mutex mutex_;  // guards what follows
  std::map<KeyframeId, DenseKeyframe> unrestored_;

  KeyframeJobs<Job> jobs_;

  KeyframeWorker worker_;  // last, so that its thread stops before what it uses goes away
};

}  // namespace roslam
