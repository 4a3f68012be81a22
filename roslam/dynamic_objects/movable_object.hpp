// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/semantics/label_set.hpp"
#include "roslam/semantics/segmenter.hpp"

namespace roslam {

class CellGrid;

/// A movable or moving object in one frame.
struct ROSLAM_EXPORT MovableObject {
  int id = 0;  ///< track id, the same from frame to frame, from 1
  Movable kind = Movable::kUnknown;
  cv::Rect box;                     ///< pixels
  cv::Mat mask;                     ///< CV_8UC1 of the box's size, 255 on the object
  float confidence = 0.0F;          ///< mean probability of its class, 0 to 1; 0 if found by geometry
  float decayed_confidence = 0.0F;  ///< the larger of confidence and the decayed one of earlier labels
  float median_depth = 0.0F;        ///< metres, 0 = unknown
  bool is_at_rest = false;          ///< geometry saw it static for DynamicObjectOptions::rest
  bool is_confirmed = true;         ///< false: geometry rejects it, it is not removed
  int times_seen = 1;               ///< labels, or for unlabelled objects frames, that showed it
  double last_seen = 0.0;           ///< seconds, time of the last of these
  int misses = 0;                   ///< labels, or for unlabelled objects frames, since then
};

/// The objects of a segmentation: connected components of a class, cut at depth discontinuities. Those below
/// min_share of the image are dropped. Ids are 0. depth: of cells.
ROSLAM_EXPORT std::vector<MovableObject> find_objects(const Segmentation& segmentation, const cv::Mat& depth,
                                                      const CellGrid& grid, double min_share);

/// Sets an object's pixels to a value, in a mask of the image's size (CV_8UC1).
ROSLAM_EXPORT void draw_object(const MovableObject& object, cv::Mat& image, int value = 255);

/// Sets box and mask from the nonzero pixels of a mask of the image's size. False, with the object unchanged,
/// if there are none.
ROSLAM_EXPORT bool take_mask(MovableObject& object, const cv::Mat& image);

/// False for unlabelled objects seen only once, which may be noise.
ROSLAM_EXPORT bool is_seen_repeatedly(const MovableObject& object);

/// Pixels two objects have in common, and their share of the smaller one.
ROSLAM_EXPORT int common_pixels(const MovableObject& a, const MovableObject& b);
ROSLAM_EXPORT double overlap(const MovableObject& a, const MovableObject& b);

/// Median of the known depth (of cells) under the object's mask; 0 if none is known.
ROSLAM_EXPORT float median_depth(const MovableObject& object, const cv::Mat& depth, const CellGrid& grid);

}  // namespace roslam
