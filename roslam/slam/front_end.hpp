// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "roslam/dynamic_objects/dynamic_object_detector.hpp"
#include "roslam/features/brightness.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/map/map.hpp"
#include "roslam/options/options.hpp"
#include "roslam/sensors/depth_check.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/slam/camera_noise.hpp"
#include "roslam/features/stereo_matcher.hpp"
#include "roslam/tracking/tracker.hpp"
#include "roslam/workers/load_control.hpp"
#include "roslam/workers/segmentation_worker.hpp"

namespace roslam {

/// What the front end makes of a frame.
struct FrontEndResult {
  DynamicObjects dynamic_objects;
  std::shared_ptr<const ObservedFrame> view;
  std::vector<cv::Point2f> points;          ///< as FrameResult
  std::vector<cv::Point2f> removed_points;  ///< as FrameResult
  std::vector<std::string> warnings;        ///< as FrameResult::warnings
  double hidden_share = 0.0;                ///< of the image, covered by dynamic objects
  std::vector<std::uint8_t> rested;         ///< as FrameHint
  bool may_start = true;                    ///< as FrameHint
  double detection_seconds = 0.0;           ///< processor time
  double extraction_seconds = 0.0;          ///< processor time
};

/// Labels and geometry give the mask of dynamic objects, ORB features are extracted outside it (eq. 11) and
/// depth is joined to them. Also keeps which revision of the map its poses are of: a loop closure moves the
/// map under the depth and poses of earlier frames that the detection compares with. Used by the tracking
/// thread only.
class FrontEnd {
 public:
  /// segmenter: null, or what labels frames. load: null, or what reduces the work.
  FrontEnd(const Camera& camera, const Options& options, Mode mode, std::shared_ptr<Segmenter> segmenter,
           const LoadControl* load = nullptr);

  /// True if dynamic objects are detected at all.
  bool detects() const;

  /// True if they are detected by depth.
  bool needs_depth() const;

  /// predicted_T_camera_world: pose that the motion so far suggests, if known. mask: empty, or CV_8UC1 of the
  /// frame's size, nonzero where no feature may be extracted. frame_count: frames used so far.
  FrontEndResult observe(const Frame& frame, const cv::Mat& mask,
                         const std::optional<SE3>& predicted_T_camera_world, std::size_t frame_count);

  /// Takes over corrections of the map since the last call: tracked_T_camera_world is the pose of the last
  /// measured frame as the map has it now. Returns false if there were none. The caller holds the map's
  /// mutex.
  bool follow_corrections(const Map& map, const std::optional<SE3>& tracked_T_camera_world);

  /// Tells what tracking made of the frame that observe() was called for. The caller holds the map's mutex.
  void remember(const TrackedFrame& frame, const Map& map, const FrontEndResult& observation,
                bool is_keyframe);

  /// Ends a wait for labels; there are none any more. May be called from any thread.
  void cancel() { segmentation_.cancel(); }

  /// To be called when poses of earlier frames are of no use: they were wrong, or are of another submap.
  void forget_poses();

  /// Forgets earlier frames, as after a reset of the source's clock.
  void reset();

  /// The newest labels that were accepted (CV_8UC1, empty if none so far) and the frame they are of.
  const cv::Mat& labels() const { return labels_; }
  std::size_t labelled_index() const { return labelled_index_; }

  std::vector<float> level_scales() const;
  std::map<std::string, std::size_t> faults() const;

  const CameraNoise& noise() const { return noise_; }

  /// What is doubtful about the input so far, in words, and in how many frames.
  std::map<std::string, std::size_t> warnings() const;
  StageTimes times() const { return segmentation_.times(); }

 private:
  DynamicObjects detect(const Frame& frame, const cv::Mat& grey,
                        const std::optional<SE3>& predicted_T_camera_world, std::size_t frame_count);
  bool fills_image(const Frame& frame, const FrontEndResult& observation);
  void check_input(const Frame& frame, const cv::Mat& grey, FrontEndResult& observation);
  void extract(const Frame& frame, const cv::Mat& grey, const cv::Mat& mask, std::size_t frame_count,
               FrontEndResult& observation);

  Camera camera_;
  Options options_;
  Mode mode_;
  const LoadControl* load_;
  BrightnessNormaliser brightness_;
  DepthCheck depth_check_;
  CameraNoise noise_;
  std::set<std::string> warned_;  // warnings that were handed out
  SegmentationWorker segmentation_;
  DynamicObjectDetector detector_;
  OrbExtractor extractor_;
  std::optional<StereoMatcher> stereo_;  // of a stereo camera
  cv::Mat labels_;
  std::size_t labelled_index_ = 0;
  int last_inliers_ = 0;
  std::optional<double> first_timestamp_;  // seconds
  // The last frame whose pose was measured: pose in the map as it was by then, and how often it was corrected
  // by then.
  std::optional<SE3> measured_T_camera_world_;
  cv::Mat depth_;  // of the frame observed last
  std::size_t map_revision_ = 0;
  KeyframeId last_reference_;
};

}  // namespace roslam
