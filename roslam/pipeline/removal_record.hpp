// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "roslam/pipeline/slam.hpp"

namespace roslam {

/// How many points, by the class of what they lie on; kBesideMask is what lies beside it.
using PointCounts = std::map<std::string, std::size_t>;
inline constexpr const char* kBesideMask = "margin";

/// What the points that were removed from a frame lay on.
PointCounts removed_by_class(const FrameResult& result, const cv::Size& picture);

/// Sums over the frames of a run of what was removed.
struct RemovalTally {
  std::size_t frames = 0;

  std::size_t low_trust = 0;  ///< frames whose pose is trusted less than half
  std::size_t predicted = 0;  ///< frames whose pose is a prediction, as what moves hid the scene
  double removed_area = 0.0;  ///< sum of the shares of the pictures
  std::size_t kept_points = 0;
  PointCounts removed_points;     ///< by class
  std::size_t masks_dropped = 0;  ///< masks and pictures not written, as the disk was too slow
  std::vector<int> label_ages;    ///< frames, one a frame with labels

  void add(const FrameResult& result, const cv::Size& picture, const PointCounts& removed);
};

/// One line of descriptors.jsonl: what was removed from a frame (see docs/run_folder.md). mask_file: relative
/// to the run folder; empty if nothing was removed.
std::string descriptor_line(const FrameResult& result, const cv::Size& picture, const PointCounts& removed,
                            const std::string& mask_file);

/// Files of a run folder.
inline constexpr const char* kDescriptorFile = "descriptors.jsonl";
inline constexpr const char* kMaskFolder = "masks";

/// The file of a frame's mask, relative to the run folder. Frames less than a microsecond apart share it.
std::string mask_name(double timestamp);

/// The objects of a frame in one image: CV_8UC1, 0 = none, else the position of the object in the list plus
/// one. From the 255th on they share the number 255.
cv::Mat object_image(const std::vector<MovableObject>& objects, const cv::Size& picture);

}  // namespace roslam
