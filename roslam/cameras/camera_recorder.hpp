// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "roslam/cameras/depth_camera.hpp"
#include "roslam/common/export.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam {

class McapWriter;

struct ROSLAM_EXPORT CameraRecorderOptions {
  bool compresses = true;               ///< chunks of messages, if a method was built in
  std::size_t chunk_bytes = 1U << 20U;  ///< of messages, after which a chunk ends; > 0
  std::size_t waiting_bytes =
      256U << 20U;              ///< of messages that wait for the disk; more are lost, or waited for
  bool waits_for_disk = false;  ///< add() waits until there is room, for what is not live
};

/// Records what a camera gives, or the frames of another source, to an MCAP file without loss, in the topics
/// of ROS 2 drivers, and the camera file in /roslam/camera, so that RecordingSource reads the same frames. A
/// thread of its own compresses and writes, and once a second waits until the disk has it: of a power cut,
/// what came a second before it and what waited for the disk is lost.
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

  /// Records a frame whose depth is registered to colour: its inertial samples, images and true pose. stop:
  /// ends waiting for the disk (waits_for_disk).
  void add(const Frame& frame, const std::stop_token& stop = {});

  /// Writes what waits and ends the file. Throws OutputError if not everything that was accepted could be
  /// written.
  void close();

  std::size_t lost() const;     ///< messages that had no room, or could not be written
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
  std::vector<Message> messages_of(const CameraSample& sample) const;
  std::int64_t next_time(std::int64_t time);
  void put(std::vector<Message> messages, const std::stop_token& stop = {});
  void write_waiting(const std::stop_token& stop);

  void write(const Message& message);

  CameraRecorderOptions options_;
  DepthCameraCalibration calibration_;
  std::int64_t wall_start_;  // ns since 1970, at steady_start_
  std::chrono::steady_clock::time_point steady_start_;

  // Of the thread that writes, while it runs.
  std::unique_ptr<McapWriter> writer_;
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
  bool is_closed_ = false;

  std::jthread thread_;  // last, so that it ends before what it uses
};

}  // namespace roslam
