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
#include "roslam/ros/missing_depth.hpp"
#include "roslam/ros/recording_streams.hpp"
#include "roslam/sensors/depth_registration.hpp"
#include "roslam/sensors/frame_source.hpp"

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
  std::map<std::string, std::size_t> skipped() const override { return skipped_; }
  std::map<std::string, std::size_t> skipped_depth() const override;
  std::map<std::string, std::size_t> notes() const override;

  /// What was chosen.
  const RecordingStreams& streams() const { return streams_; }

 private:
  // An image that waits for its partner.
  struct Waiting {
    std::int64_t stamp = 0;  // nanoseconds
    int segment = 0;
    std::size_t index = 0;
    std::vector<std::uint8_t> message;
  };
  // The images of a topic that wait, and where its clock is.
  struct Queue {
    std::deque<Waiting> images;
    std::optional<std::int64_t> last, before;  // the newest stamp, and that of the image before
    std::optional<Waiting> candidate;          // may be the first after a restart of the clock
    int segment = 0;
    std::size_t count = 0;
  };

  bool read_message();
  void put(const RecordedImages& images, std::span<const std::uint8_t> message, Queue& queue,
           std::map<std::string, std::size_t>& skipped);
  void accept(Waiting image, Queue& queue, std::map<std::string, std::size_t>& skipped);
  void add_inertial(const RecordedTopic& topic, std::span<const std::uint8_t> message);
  void add_truth(std::span<const std::uint8_t> message);
  bool is_decided() const;
  std::optional<Waiting> take_depth(const Waiting& colour);
  void add_missing_depth(const Waiting& colour);
  std::optional<Frame> frame_of(const Waiting& colour, const std::optional<Waiting>& depth);
  cv::Mat depth_image(const Waiting& depth);
  void take_inertial(Frame& frame);
  const SE3& place_camera(const std::string& child);
  std::optional<SE3> truth_at(double timestamp);

  std::unique_ptr<Recording> recording_;
  RecordingStreams streams_;
  bool is_realsense_ = false;
  std::optional<DepthRegistration> registration_;
  std::int64_t half_interval_ = 0;  // nanoseconds
  bool is_at_end_ = false;
  Queue colour_, depth_;
  std::optional<std::pair<int, std::int64_t>> passed_depth_;  // segment and stamp, taken or left behind
  MissingDepth missing_depth_;
  std::deque<InertialSample> inertial_;
  std::optional<Eigen::Vector3d> acceleration_;  // newest of an accelerometer of its own
  std::deque<StampedPose> truth_;                // of the camera
  std::optional<SE3> T_child_camera_;            // from the camera to the frame whose pose truth is
  std::map<std::string, std::size_t> skipped_, skipped_depth_, notes_;
  std::size_t saturated_ = 0;  // pixels of depth
};

}  // namespace roslam
