// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/ros/recording_streams.hpp"
#include "roslam/sensors/depth_registration.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/sensors/inertial_queue.hpp"
#include "roslam/sensors/missing_depth.hpp"
#include "roslam/sensors/stream_pairing.hpp"

namespace roslam {

/// Frames of a recording of a robot: a ROS 1 bag, a rosbag2 SQLite file or an MCAP file, of the RealSense SDK
/// or of the topics of ROS drivers. Colour and depth images are paired by their own time stamps, not by when
/// they were recorded, within half a frame; depth of another camera is registered to colour. Images that
/// cannot be used are skipped and counted. Memory does not grow with the file: as many images wait as lie
/// between two that belong together, at most 60.
class ROSLAM_EXPORT RecordingSource : public FrameSource {
 public:
  /// camera: in place of the calibration in the file. T_body_camera: in place of its mount. Throws InputError
  /// and CalibrationError as open_recording and choose_streams do.
  RecordingSource(const std::filesystem::path& path, const RecordingChoice& choice,
                  const std::optional<Camera>& camera, const std::optional<SE3>& T_body_camera = {});
  ~RecordingSource() override;

  std::optional<Frame> next() override;
  const Camera& camera() const override { return streams_.camera; }
  std::optional<std::size_t> size() const override { return streams_.colour.topic.messages; }
  std::map<std::string, std::size_t> skipped() const override;
  std::map<std::string, std::size_t> skipped_depth() const override;
  std::map<std::string, std::size_t> notes() const override;

  /// What was chosen.
  const RecordingStreams& streams() const { return streams_; }

 private:
  using Pairing = StreamPairing<std::vector<std::uint8_t>>;  // of messages

  bool read_message();
  std::int64_t stamp_of(const RecordedImages& images, std::span<const std::uint8_t> message) const;
  void add_inertial(const RecordedTopic& topic, std::span<const std::uint8_t> message);
  void add_truth(std::span<const std::uint8_t> message);
  std::optional<Frame> frame_of(const Pairing::Pair& images);
  cv::Mat depth_image(const Pairing::Image& depth);
  const SE3& place_camera(const std::string& child);
  std::optional<SE3> truth_at(double timestamp);

  std::unique_ptr<Recording> recording_;
  RecordingStreams streams_;
  bool is_realsense_ = false;
  std::optional<DepthRegistration> registration_;
  Pairing pairing_;
  MissingDepth missing_depth_;
  bool is_at_end_ = false;
  InertialQueue inertial_;
  std::deque<StampedPose> truth_;      // of the camera
  std::optional<SE3> T_child_camera_;  // from the camera to the frame whose pose truth is
  std::map<std::string, std::size_t> skipped_, skipped_depth_, notes_;
  std::size_t saturated_ = 0;  // pixels of depth
};

}  // namespace roslam
