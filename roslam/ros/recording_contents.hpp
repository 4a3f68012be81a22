// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/recordings/recording.hpp"
#include "roslam/ros/frame_tree.hpp"
#include "roslam/ros/ros_images.hpp"
#include "roslam/ros/ros_messages.hpp"

namespace roslam {

/// The topic (std_msgs/String) in which recordings of RO-SLAM hold the whole camera file of their colour
/// images.
constexpr const char* kCameraTopic = "/roslam/camera";

/// A topic of images, with what the recording says about it.
struct RecordedImages {
  RecordedTopic topic;
  bool is_compressed = false;
  PixelKind kind = PixelKind::kUnknown;
  std::string encoding;                            ///< of the first image, or its format
  cv::Size size;                                   ///< pixels; empty if not known
  std::string frame;                               ///< coordinate frame of the camera
  std::string clock;                               ///< that stamps them, where the recording names it
  std::optional<RosCameraInfo> info;               ///< its calibration
  std::optional<double> units_per_metre;           ///< of depth
  std::vector<std::int64_t> stamps;                ///< nanoseconds; of those that were looked at
  std::map<std::string, std::size_t> faults = {};  ///< messages that cannot be read, by reason

  double nominal_rate = 0.0;  ///< images a second as asked for; 0: not known

  /// Images a second by the median interval of the stamps, whole where it is nearly so; of few the nominal
  /// rate; 0 if neither is known.
  double rate() const;
};

/// What is in a recording.
struct RecordingContents {
  std::vector<RecordedImages> images;
  std::vector<RecordedTopic> inertial;         ///< sensor_msgs/Imu
  std::map<int, std::string> inertial_frames;  ///< coordinate frame by topic
  std::vector<RecordedTopic> poses;            ///< that may be ground truth
  std::vector<RecordedTopic> transforms;       ///< of tf
  FrameTree frames;
  std::optional<Camera> camera;               ///< of kCameraTopic
  std::map<std::string, std::size_t> faults;  ///< messages of other topics that cannot be read, by reason
  bool is_realsense = false;                  ///< written by the RealSense SDK
  bool is_whole = true;                       ///< false: what follows the part that was looked at may differ
};

/// How much of a recording to look at.
enum class LookAt { kBeginning, kWhole };

/// Looks at a recording: at its beginning, until all cameras, their calibrations and rates are known, or at
/// all of it. Leaves it at its beginning, with all topics selected.
ROSLAM_EXPORT RecordingContents contents_of(Recording& recording, LookAt part = LookAt::kBeginning);

/// How the messages of a topic are encoded. Throws InputError if it is neither ROS 1 nor CDR.
RosEncoding encoding_of(const RecordedTopic& topic);

/// Decodes a message of images. Corrects what the RealSense SDK names otherwise than ROS.
RosImage decode_image_of(const RecordedImages& images, std::span<const std::uint8_t> message,
                         bool is_realsense);

}  // namespace roslam
