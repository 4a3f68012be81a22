// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/sensors/frame_images.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/sensors/timed_files.hpp"

namespace roslam {

struct ROSLAM_EXPORT TumOptions {
  double max_time_difference = 0.02;  ///< seconds between a colour image and the depth image paired with it
  bool ground_truth = false;          ///< frames carry the poses of groundtruth.txt, where the folder has it

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// The files that an rgb.txt or depth.txt names, as listed; lines whose time is not finite are ignored. File
/// names may be quoted and hold blanks, escaped by a backslash or not, and backslashes in place of slashes.
/// Throws InputError if the list is missing, malformed or names no image.
ROSLAM_EXPORT std::vector<TimedFile> read_tum_list(const std::filesystem::path& file);

/// Pairs each colour image with the depth image nearest in time; each depth image is used once. The result
/// holds an index into depth or -1, one for each colour image. Both lists must be sorted by time.
ROSLAM_EXPORT std::vector<int> associate_by_time(const std::vector<TimedFile>& colour,
                                                 const std::vector<TimedFile>& depth,
                                                 double max_time_difference);

/// A folder in the TUM RGB-D format: rgb.txt, depth.txt and the images they name (PNG or JPEG; depth 16-bit).
/// Lists are sorted by time; where the clock restarts (the times start anew), a segment begins. Timestamps in
/// milliseconds, microseconds, nanoseconds or numbers of frames are recognised by the camera's rate and
/// converted. A colour image without a depth image near in time is returned with an empty depth; images that
/// are missing, truncated, of the wrong size or without a plausible time are skipped and counted. notes()
/// tells what was sorted, converted or taken as unknown. If the folder has imu.txt (see read_inertial_file),
/// frames carry its samples.
class ROSLAM_EXPORT TumSource : public FrameSource {
 public:
  /// Throws InputError if the folder or a list is missing, malformed or names no image, or if the clocks of
  /// the lists restart a different number of times; CalibrationError if the camera is invalid or has no
  /// depth_units_per_metre.
  TumSource(const std::filesystem::path& folder, const Camera& camera, const TumOptions& options = {});

  std::optional<Frame> next() override;
  const Camera& camera() const override { return camera_; }
  std::optional<std::size_t> size() const override { return size_; }
  std::map<std::string, std::size_t> skipped() const override { return images_.skipped; }
  std::map<std::string, std::size_t> skipped_depth() const override { return images_.skipped_depth; }
  std::map<std::string, std::size_t> notes() const override;

  /// The file of a frame's colour image. index: of a frame returned by next().
  std::filesystem::path colour_file(std::size_t index) const { return folder_ / colour_[index].file; }

  /// The depth image paired with it, if there is one; it may not be readable.
  std::optional<std::filesystem::path> depth_file(std::size_t index) const;

  /// True if the folder looks like a TUM dataset.
  static bool recognises(const std::filesystem::path& folder);

 private:
  void open_lists();
  void pair_with_depth();
  std::optional<Frame> read(std::size_t index);
  void open_inertial(double seconds);
  void open_ground_truth(double seconds);
  void take_inertial(Frame& frame);

  std::filesystem::path folder_;
  Camera camera_;
  TumOptions options_;
  std::vector<TimedFile> colour_;
  std::vector<TimedFile> depth_;
  std::vector<int> depth_of_colour_;
  FrameImages images_;
  Counts notes_;
  std::size_t size_ = 0;  // colour images listed
  std::size_t position_ = 0;
  std::vector<InertialSample> inertial_;
  std::size_t next_inertial_ = 0;
  Trajectory truth_;
};

}  // namespace roslam
