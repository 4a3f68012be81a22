// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

struct ROSLAM_EXPORT RestorationOptions {
  bool reproject = true;         ///< fill from source images of other times
  bool inpaint = true;           ///< inpaint the rest; false: leave it black and without depth
  double min_certainty = 0.004;  ///< 0 to 1; reprojected pixels below it are inpainted
  int margin = 8;                ///< pixels, dilation of the removed area: object outlines are blurred

  // Source images; each takes 2.9 MB at 640x480. For larger images proportionally fewer are kept.
  double source_interval = 0.5;  ///< seconds between source frames of a recorded run, beside its keyframes
  int max_sources = 200;         ///< of a recorded run; if there are more every n-th is used
  int recent_sources = 40;       ///< online: the newest keyframes

  int queue = 4;  ///< keyframes that may wait for restoration online; the oldest are dropped

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Diffusion-based inpainting of OpenCV, without a network.
enum class ClassicMethod {
  kTelea,        ///< Telea: "An Image Inpainting Technique Based on the Fast Marching Method", JGT 2004
  kNavierStokes  ///< Bertalmio, Bertozzi, Sapiro: "Navier-Stokes, Fluid Dynamics, and Image and Video
                 ///< Inpainting", CVPR 2001; leaves pixels at the border of the image unchanged
};

struct ROSLAM_EXPORT InpaintingOptions {
  ClassicMethod classic = ClassicMethod::kTelea;  ///< where no network is used; not in the YAML file
  int max_crops = 4;       ///< largest holes inpainted by the network; `classic` fills the rest
  int min_width = 8;       ///< pixels; narrower holes are filled by `classic`
  int joined_within = 24;  ///< pixels between holes that share a crop
  double context = 1.8;    ///< side of the crop over that of the hole
  int min_crop = 160;      ///< pixels, side of the smallest crop

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT DepthCompletionOptions {
  int cell = 8;   ///< pixels, side of the cells whose median depth is used
  int guard = 4;  ///< pixels around a hole whose depth is ignored: it may be of the removed object
  double plane_tolerance = 0.03;  ///< relative to the depth, largest residual of an inlier cell
  int max_planes = 6;             ///< fitted around a hole
  double min_votes = 0.2;         ///< share of a cell's rays (weighted by 1/distance) that must hit a surface

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// How source images are reprojected into a target image.
struct ROSLAM_EXPORT ReprojectionOptions {
  int views = 10;                   ///< source images per target at most
  bool align = true;                ///< refine each source's pose by direct image alignment
  double depth_tolerance = 0.03;    ///< relative depth difference of two images of one surface ...
  double tolerance_growth = 0.005;  ///< ... plus this per metre of depth (1/metre)
  double angle_scale = 5.0;         ///< degrees between viewing rays at which a source's weight is 1/e
  double age_scale = 20.0;          ///< seconds between two images at which a source's weight is 1/e
  double colour_tolerance = 25.0;   ///< grey levels by which blended sources may differ
  double max_gain = 2.0;            ///< largest exposure gain between two images

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
