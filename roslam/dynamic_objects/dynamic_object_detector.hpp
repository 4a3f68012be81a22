// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roslam/dynamic_objects/cell_assignment.hpp"
#include "roslam/dynamic_objects/cell_grid.hpp"
#include "roslam/dynamic_objects/depth_consistency.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/dynamic_objects/dynamic_objects.hpp"
#include "roslam/dynamic_objects/flow_consistency.hpp"
#include "roslam/dynamic_objects/movable_object.hpp"
#include "roslam/dynamic_objects/object_tracker.hpp"
#include "roslam/dynamic_objects/optical_flow.hpp"
#include "roslam/semantics/segmenter.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam {

/// The semantic segmentation of a frame, which may be some frames old.
struct LabelledFrame {
  std::size_t index = 0;  ///< of the frame in its source
  Segmentation segmentation;
};

/// Detects dynamic objects in each frame before features are extracted: combines the newest labels,
/// propagated to the frame, with depth and flow consistency, grows the masks over the objects and refines
/// them by depth. Not thread safe.
class DynamicObjectDetector {
 public:
  struct Settings {
    DynamicObjectOptions dynamic_objects;
    DepthOptions depth;
    MeasurementNoise noise;
    PoseOptimiserOptions pose;
  };

  DynamicObjectDetector(const Camera& camera, const Settings& settings);

  /// grey: CV_8UC1, the frame's grey image. predicted_T_camera_world: by the motion model, if known. labels:
  /// new ones of this or an earlier frame, if any. Frames must come in order.
  /// examine_geometry: false saves the time of depth and flow consistency; what earlier frames found is
  /// carried to this one.
  DynamicObjects detect(const Frame& frame, const cv::Mat& grey,
                        const std::optional<SE3>& predicted_T_camera_world,
                        const std::optional<LabelledFrame>& labels, bool examine_geometry = true);

  /// Stores the frame last detected in for later ones: its pose, if tracked, and the corners (pixels, as
  /// taken) outside and inside the mask.
  void remember(const std::optional<SE3>& T_camera_world, const std::vector<cv::Point2f>& points,
                const std::vector<cv::Point2f>& removed_points);

  /// The estimated noise of the depth camera. Where it is less than the settings say it changes nothing:
  /// among frames of some seconds the errors of poses and calibration outweigh it.
  void set_depth_noise(const DepthNoise& noise);

  /// Applies a correction of the map to the stored frames; T_new_old maps old to new world coordinates.
  void apply_correction(const SE3& T_new_old);

  /// To be called when the submap changes: the poses of stored frames are of no use, as they are relative to
  /// the other submap.
  void leave_submap();

  /// Forgets all earlier frames, as after a reset of the source's clock.
  void reset();

  /// How many labels could not be used so far, by reason.
  const std::map<std::string, std::size_t>& faults() const { return faults_; }
  std::size_t flickers() const { return object_tracker_.flickers(); }  ///< see ObjectTracker

 private:
  void begin_frame(const Frame& frame, const cv::Mat& grey,
                   const std::optional<SE3>& predicted_T_camera_world);
  CellScene gather_evidence(bool examine_geometry);
  void reject_contradicted_motion(CellScene& scene) const;
  std::optional<std::vector<MovableObject>> labelled_objects(const LabelledFrame& labels);
  void assess_objects(CellScene& scene);
  void add_unlabelled(CellScene& scene);
  DynamicObjects compose_masks(const CellScene& scene);
  cv::Mat still_part(const CellScene& scene, const cv::Mat& mask) const;
  const PastFrame* past_frame(std::size_t index) const;
  const PastFrame* flow_reference() const;

  Camera camera_;
  Settings settings_;
  CellGrid grid_;
  CornerSelection corners_;
  FlowConsistency flow_;
  DepthConsistency history_;
  ObjectTracker object_tracker_;
  PastFrame current_;
  CellImages cells_;                   // of the current frame
  cv::Mat mask_;                       // of the current frame; empty = nothing is removed
  cv::Mat still_;                      // likewise
  std::optional<SE3> pose_from_flow_;  // of the current frame
  std::deque<PastFrame> past_;
  std::optional<std::size_t> labelled_index_;  // of the newest frame whose labels were used
  bool is_everything_labelled_ = false;        // by the newest labels
  std::map<std::string, std::size_t> faults_;
};

}  // namespace roslam
