// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/ros/recording_contents.hpp"

namespace roslam {

/// Topics to take, where there is a choice; empty: the one that fits.
struct RecordingChoice {
  std::string colour, depth;
  std::string inertial;
  std::string truth;  ///< poses; of tf: TOPIC:CHILD_FRAME
};

/// What of a recording makes frames.
struct RecordingStreams {
  RecordedImages colour, depth;
  Camera camera;  ///< of colour; depth_units_per_metre is that of 16-bit depth; 0 where depth is in metres
  Camera depth_camera;
  std::optional<SE3> T_colour_depth;    ///< where depth has to be registered to colour
  std::vector<RecordedTopic> inertial;  ///< one, or an accelerometer and then a gyroscope
  std::optional<RecordedTopic> truth;
  std::string truth_child;  ///< frame whose pose is taken of tf; empty: the one that messages name
  FrameTree frames;
  std::map<std::string, std::size_t> notes;  ///< what was assumed, in words
};

/// Chooses streams. Colour before grey before infra-red, depth that is registered to colour before other
/// depth, raw images before compressed ones. file: for messages. camera: given by the user, in place of what
/// the recording says. Throws InputError naming the topics and the remedy if there is no or no clear choice,
/// depth cannot be brought to colour, or the clocks of the two differ; CalibrationError for a calibration
/// that cannot be.
ROSLAM_EXPORT RecordingStreams choose_streams(const RecordingContents& contents,
                                              const RecordingChoice& choice,
                                              const std::optional<Camera>& camera, const std::string& file);

}  // namespace roslam
