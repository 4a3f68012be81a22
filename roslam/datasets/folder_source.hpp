// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/sensors/frame_images.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam {

/// The files of a frame.
struct ROSLAM_EXPORT ListedFrame {
  double timestamp = 0.0;  ///< seconds
  int segment = 0;         ///< restarts of the clock before it
  std::filesystem::path colour;
  std::filesystem::path depth;        ///< empty: none
  std::filesystem::path right;        ///< the image of the right camera; empty: none
  std::optional<SE3> T_world_camera;  ///< ground truth, if known
};

/// What a folder holds, in the terms that all formats share.
struct ROSLAM_EXPORT FolderListing {
  std::string folder;  ///< for messages
  Camera camera;
  std::vector<ListedFrame> frames;
  cv::Size colour_size = {};  ///< of the colour files where it is not the camera's
  cv::Size depth_size = {};   ///< of the depth files where it is not that of the colour files

  /// Where the files are not what the camera has: changes a colour image (CV_8UC3) and its depth (CV_32FC1,
  /// metres; may be empty) so that both have the camera's size and geometry.
  std::function<void(cv::Mat& colour, cv::Mat& depth)> transform = {};

  std::vector<InertialSample> inertial = {};  ///< in order of time
  std::optional<RightCamera> right = {};
  Counts notes = {};          ///< what was found out about the folder
  Counts skipped = {};        ///< colour images that are not in frames
  Counts skipped_depth = {};  ///< depth images that are not in frames
};

/// A folder of images in any layout for which there is a listing. Images that are missing, truncated or of
/// the wrong size are skipped and counted, as are frames whose time does not increase; a colour image without
/// a usable depth image is returned with an empty depth.
class ROSLAM_EXPORT FolderSource : public FrameSource {
 public:
  /// Throws InputError if no frame is listed; CalibrationError if the camera is invalid, or has no
  /// depth_units_per_metre while there is depth.
  explicit FolderSource(FolderListing listing);

  std::optional<Frame> next() override;
  const Camera& camera() const override { return listing_.camera; }
  std::optional<std::size_t> size() const override { return size_; }
  std::map<std::string, std::size_t> skipped() const override { return images_.skipped; }
  std::map<std::string, std::size_t> skipped_depth() const override { return images_.skipped_depth; }
  std::map<std::string, std::size_t> notes() const override;

  /// The files of a frame returned by next(). index: its Frame::index.
  const ListedFrame& files(std::size_t index) const { return listing_.frames.at(index); }

  std::optional<RightCamera> right() const override { return listing_.right; }

 private:
  void drop_frames_out_of_order();
  std::optional<Frame> read(std::size_t index);
  cv::Mat read_right(const ListedFrame& files);
  cv::Mat read_depth(const ListedFrame& files, const cv::Size& colour_size);

  FolderListing listing_;
  FrameImages images_;
  bool has_depth_ = false;  // some frames have
  std::size_t size_ = 0;    // frames listed
  std::size_t position_ = 0;
  std::size_t next_inertial_ = 0;
};

}  // namespace roslam
