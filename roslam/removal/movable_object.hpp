// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/removal/cell_grid.hpp"
#include "roslam/semantics/label_set.hpp"
#include "roslam/semantics/segmenter.hpp"

namespace roslam {

/// A thing that may move, as one frame shows it.
struct MovableObject {
  int id = 0;  ///< the same from frame to frame, counted from 1
  Movable kind = Movable::kUnknown;
  cv::Rect box;             ///< pixels
  cv::Mat mask;             ///< CV_8UC1 of the box's size, 255 where the thing is
  float confidence = 0.0F;  ///< mean probability of its class where it is, 0 to 1; 0 where geometry found it
  float sureness = 0.0F;    ///< confidence now or, fading, some labels ago
  float median_depth = 0.0F;  ///< metres, 0 = unknown
  bool is_at_rest = false;    ///< geometry has seen it stay where it is (RemovalOptions::rest)
  bool is_believed = true;    ///< false: labelled or suspected, but geometry shows it does not move
  int sightings = 1;          ///< frames or labels that showed it
  double last_seen = 0.0;     ///< seconds, time of the frame that showed it last
  int misses = 0;             ///< labels, or for unlabelled things frames, since it was seen last
};

/// Things the labels tell apart: connected areas of a class, cut where the depth jumps. Areas below min_share
/// of the picture are left out. Ids are 0. depth: of cells.
std::vector<MovableObject> find_objects(const Segmentation& segmentation, const cv::Mat& depth,
                                        const CellGrid& grid, double min_share);

/// Sets an object's pixels in an image of the picture's size (CV_8UC1).
void paint(const MovableObject& object, cv::Mat& image, int value = 255);

/// Takes box and mask from the nonzero pixels of an image of the picture's size. False, and the object is
/// left as it is, if there are none.
bool take_mask(MovableObject& object, const cv::Mat& image);

/// False for what geometry alone has seen no more than once: that may be noise.
bool is_confirmed(const MovableObject& object);

/// Pixels two objects have in common, and their share of the smaller one.
int common_pixels(const MovableObject& a, const MovableObject& b);
double overlap(const MovableObject& a, const MovableObject& b);

/// Median of the known depth (of cells) under the object's mask; 0 if none is known.
float median_depth(const MovableObject& object, const cv::Mat& depth, const CellGrid& grid);

}  // namespace roslam
