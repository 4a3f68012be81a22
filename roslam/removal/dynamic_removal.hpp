// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roslam/removal/cell_grid.hpp"
#include "roslam/removal/cell_owners.hpp"
#include "roslam/removal/flow_check.hpp"
#include "roslam/removal/free_space.hpp"
#include "roslam/removal/movable_object.hpp"
#include "roslam/removal/object_memory.hpp"
#include "roslam/removal/optical_flow.hpp"
#include "roslam/removal/removal_options.hpp"
#include "roslam/semantics/segmenter.hpp"
#include "roslam/sources/frame_source.hpp"

namespace roslam {

/// What a network said about a frame, which may lie some frames back.
struct LabelledFrame {
  std::size_t index = 0;  ///< of the frame in its source
  Segmentation segmentation;
};

/// What is to be removed from a frame.
struct Removal {
  cv::Mat mask;     ///< CV_8UC1, nonzero where no point may come from (eq. 11); empty = nothing is removed
  cv::Mat resting;  ///< CV_8UC1, nonzero on movable things at rest, a part of mask; empty = there are none
  std::vector<MovableObject> objects;  ///< what the mask is made of, before its dilation
  int label_age = -1;                  ///< frames since the labels it rests on; -1 = none so far
  std::optional<SE3> T_camera_world;   ///< where the flow says the camera is, better than a prediction
};

/// Where the things that were removed hide the scene, and so many pixels around (CV_8UC1, nonzero there):
/// their outlines are blurred. Empty if nothing was removed.
cv::Mat removed_area(const Removal& removal, const cv::Size& picture, int margin);

/// Finds what moves in each frame, before its points are extracted: joins the newest labels, carried to the
/// frame, with what geometry finds, fits the masks to depth and lets them grow over the things they belong
/// to.
class DynamicRemoval {
 public:
  struct Settings {
    RemovalOptions removal;
    DepthOptions depth;
    MeasurementNoise noise;
    PoseOptimiserOptions pose;
  };

  DynamicRemoval(const Camera& camera, const Settings& settings);

  /// grey: CV_8UC1, the frame without colour. predicted: the pose as the motion so far suggests it, if known.
  /// labels: new ones of this frame or an earlier one, if there are any. Frames must come in order.
  Removal find(const Frame& frame, const cv::Mat& grey, const std::optional<SE3>& predicted_T_camera_world,
               const std::optional<LabelledFrame>& labels);

  /// What became of the frame: the pose, if tracking found it, and the corners kept and removed.
  void remember(const std::optional<SE3>& T_camera_world, std::vector<cv::Point2f> points,
                std::vector<cv::Point2f> removed_points);

  /// Tells that the map was corrected: what was remembered lies elsewhere now.
  void move_world(const SE3& T_new_old);

  /// Tells that the camera is in another world, which lies to the one remembered nobody knows how.
  void leave_world();

  /// Labels that could not be used so far, by reason in words.
  const std::map<std::string, std::size_t>& faults() const { return faults_; }
  std::size_t flickers() const { return memory_.flickers(); }

 private:
  void begin(const Frame& frame, const cv::Mat& grey, const std::optional<SE3>& predicted_T_camera_world);
  CellScene gather_evidence() const;
  void drop_contradicted(CellScene& scene) const;
  std::optional<std::vector<MovableObject>> usable_objects(const LabelledFrame& labels);
  void weigh(CellScene& scene);
  void add_unlabelled(CellScene& scene);
  Removal finished(const CellScene& scene);
  const PastFrame* past_frame(std::size_t index) const;
  const PastFrame* anchor() const;

  Camera camera_;
  Settings settings_;
  CellGrid grid_;
  FlowCheck flow_;
  FreeSpaceHistory history_;
  ObjectMemory memory_;
  PastFrame current_;
  cv::Mat depth_cells_;                // of the current frame
  std::optional<SE3> pose_from_flow_;  // of the current frame
  std::deque<PastFrame> past_;
  std::optional<std::size_t> labelled_index_;  // of the newest frame whose labels were used
  std::map<std::string, std::size_t> faults_;
};

}  // namespace roslam
