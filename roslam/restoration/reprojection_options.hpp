// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace roslam {

/// How what was seen at other times is carried into a picture.
struct ReprojectionOptions {
  int views = 10;                   ///< pictures that a hole is filled from at most
  bool align = true;                ///< lay each picture over the one to fill by its brightness before use
  double depth_tolerance = 0.03;    ///< share of the depth by which two views of one surface may differ ...
  double tolerance_growth = 0.005;  ///< 1/metre, added to that share for each metre
  double angle_scale = 5.0;         ///< degrees between two lines of sight at which a view counts 1/e
  double age_scale = 20.0;          ///< seconds between two pictures at which a view counts 1/e
  double colour_tolerance = 25.0;   ///< grey levels by which views that are blended may differ
  double max_gain = 2.0;            ///< factor of brightness between two pictures that is believed

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
