// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include "evaluation/camera_check/contrast.hpp"
#include "evaluation/camera_check/edge_alignment.hpp"
#include "evaluation/camera_check/frame_run.hpp"
#include "evaluation/camera_check/lens_fit.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam::evaluation {

enum class Verdict { kFits, kDoesNotFit, kCannotTell };

/// "fits", "does not fit", "cannot tell".
std::string_view name_of(Verdict verdict);

/// One thing that was checked.
struct CameraFinding {
  Verdict verdict = Verdict::kCannotTell;
  std::string words;   ///< the figure, or why it cannot be told
  std::string remedy;  ///< what to change; empty unless it does not fit
};

/// What the data of a source say about its camera file.
struct CameraCheck {
  CameraFinding distortion;
  CameraFinding depth_scale;
  CameraFinding registration;
  CameraFinding timing;

  std::size_t runs = 0;  ///< of consecutive frames that were looked at
  std::size_t frames_read = 0;
  double interval = 0.0;         ///< seconds between frames, median
  std::optional<EdgeFit> edges;  ///< if there were depth edges
  LensFit as_given, inverse, none;
  std::optional<Contrast> scale;                ///< how many times depth is too large, by the true poses
  double near = 0.0, median = 0.0, far = 0.0;   ///< depth, metres; percentiles 5, 50 and 95
  std::optional<double> baseline, step_factor;  ///< of the depth sensor, as DepthScale has them
  double multiples_of_five = 0.0;               ///< share of depth values, in units

  bool fits() const;  ///< whether nothing was found not to fit
};

struct CameraCheckOptions {
  FrameRunOptions runs = {};
};

/// Compares a source of colour and depth with its camera. Reads a bounded number of frames and keeps one run
/// of them in memory, and of each run what is measured in it. name: of the source, for errors. Throws
/// InputError if the source has no depth or too few consecutive frames, or if a stop was requested.
CameraCheck check_camera(FrameSource& source, const std::string& name, const CameraCheckOptions& options,
                         const std::function<void(std::size_t, std::size_t)>& progress,
                         const std::stop_token& stop);

}  // namespace roslam::evaluation
