// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/slam/slam.hpp"

namespace roslam::recording {

/// Number of points by class of the object they are on; kBesideMask for points in the margin of a mask.
using PointCounts = std::map<std::string, std::size_t>;
inline constexpr const char* kBesideMask = "margin";

/// The removed points of a frame, by class.
PointCounts removed_by_class(const FrameResult& result, const cv::Size& image);

/// Removal summed over the frames of a run.
struct RemovalTally {
  std::size_t frames = 0;

  std::size_t low_quality = 0;  ///< frames with a tracking quality below 0.5
  std::size_t predicted = 0;    ///< frames with a predicted pose, as dynamic objects hid the scene
  double removed_area = 0.0;    ///< sum of the shares of the images
  std::size_t kept_points = 0;
  PointCounts removed_points;     ///< by class
  std::size_t masks_dropped = 0;  ///< masks that were not written, as the disk was too slow
  std::size_t lines_dropped = 0;  ///< frames of which nothing was written, as the disk was too slow for long
  std::vector<int> label_ages;    ///< age of the labels in frames, for each frame with labels

  void add(const FrameResult& result, const cv::Size& image, const PointCounts& removed);
  void merge(const RemovalTally& other);
};

/// One line of descriptors.jsonl: the dynamic objects of a frame (see docs/run_folder.md). mask_file:
/// relative to the run folder; empty if there is none.
std::string descriptor_line(const FrameResult& result, const cv::Size& image, const PointCounts& removed,
                            const std::string& mask_file);

/// Files of a run folder.
inline constexpr const char* kDescriptorFile = "descriptors.jsonl";
inline constexpr const char* kMaskFolder = "masks";

/// The mask file of a frame, relative to the run folder. Frames less than a microsecond apart share it.
std::string mask_name(double timestamp);

/// The objects of a frame in one image: CV_8UC1, 0 = none, else the index of the object plus one. Objects
/// from the 255th on share the value 255.
cv::Mat object_image(const std::vector<MovableObject>& objects, const cv::Size& size);

}  // namespace roslam::recording
