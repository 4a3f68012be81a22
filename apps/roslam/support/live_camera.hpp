// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "roslam/cameras/camera_recorder.hpp"
#include "roslam/cameras/live_source.hpp"

namespace roslam::app {

/// True for realsense and realsense:SERIAL.
bool is_live_camera(const std::string& name);

/// Opens the camera. stream: WIDTHxHEIGHT@RATE; mount: as --mount, or empty. Throws InputError.
std::unique_ptr<LiveSource> open_live_camera(const std::string& name, const std::string& stream,
                                             const std::string& mount);

/// Records what a source gives to a file: of a camera the samples as they came, of others the frames. An
/// older file of the name is kept: it is renamed FILE.1, FILE.2 and so on.
class SourceRecorder {
 public:
  /// Throws OutputError.
  SourceRecorder(FrameSource& source, const std::string& file);
  ~SourceRecorder();
  SourceRecorder(const SourceRecorder&) = delete;
  SourceRecorder& operator=(const SourceRecorder&) = delete;

  /// To be called with each frame of the source.
  void add(const Frame& frame, const std::stop_token& stop);

  /// Ends the file. Throws OutputError.
  void close() { recorder_.close(); }

  /// What was recorded and what was lost, a line each, without a line end after the last.
  std::string in_words() const;

  const CameraRecorder& recorder() const { return recorder_; }

 private:
  std::string file_;
  LiveSource* live_;  // null: another source
  CameraRecorder recorder_;
};

}  // namespace roslam::app
