// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "roslam/cameras/depth_camera.hpp"
#include "roslam/common/export.hpp"
#include "roslam/recordings/mcap_writer.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam {

struct ROSLAM_EXPORT CameraRecorderOptions {
  McapWriterOptions file;
  std::size_t waiting_bytes =
      256U << 20U;              ///< of messages that wait for the disk; more are lost, or waited for
  bool waits_for_disk = false;  ///< add() waits until there is room, for what is not live
};

/// Records what a camera gives, or the frames of another source, to an MCAP file without loss, in the topics
/// of ROS 2 drivers, and the camera file in /roslam/camera, so that RecordingSource reads the same frames. A
/// thread of its own compresses and writes. Of a program that is killed, what came until a second before is
/// in the file.
///
/// Thread safety: all but close() may be called from several threads.
class ROSLAM_EXPORT CameraRecorder {
 public:
  /// Throws OutputError.
  CameraRecorder(const std::filesystem::path& file, const DepthCameraCalibration& calibration,
                 const CameraRecorderOptions& options = {});
  ~CameraRecorder();
  CameraRecorder(const CameraRecorder&) = delete;
  CameraRecorder& operator=(const CameraRecorder&) = delete;

  /// Records a sample as it came. Does not wait for the disk: a message that has no room is lost and counted.
  /// Does nothing once the disk has failed.
  void add(const CameraSample& sample);

  /// Records a frame whose depth is registered to colour: its inertial samples, images and true pose.
  void add(const Frame& frame);

  /// Writes what waits and ends the file. Throws OutputError if not everything that was accepted could be
  /// written.
  void close();

  std::size_t lost() const;     ///< messages that had no room
  bool has_failed() const;      ///< the disk is full or has failed; nothing is recorded any more
  std::uint64_t bytes() const;  ///< in the file

 private:
  enum class Topic;
  struct Message {
    Topic topic;
    std::int64_t time;
    std::vector<std::uint8_t> content;
  };

  std::vector<Message> described(std::int64_t time);
  std::int64_t next_time(std::int64_t time);
  void put(std::vector<Message> messages);
  void write_waiting(const std::stop_token& stop);
  void write(const Message& message);

  CameraRecorderOptions options_;
  DepthCameraCalibration calibration_;
  std::int64_t wall_start_;  // ns since 1970, at steady_start_
  std::chrono::steady_clock::time_point steady_start_;

  // Of the thread that writes, while it runs.
  McapWriter writer_;
  std::map<Topic, int> ids_;  // of the topics that have messages

  mutable std::mutex mutex_;  // guards all below
  std::condition_variable_any changed_;
  std::deque<Message> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::optional<std::int64_t> last_time_;  // of the recording
  std::int64_t offset_ = 0;                // of the recording's time from that of the frames
  std::size_t lost_ = 0;
  std::uint64_t bytes_ = 0;
  std::string failure_;

  std::jthread thread_;  // last, so that it ends before what it uses
};

}  // namespace roslam
