// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/sensors/counts.hpp"

namespace roslam {

/// "640x480".
inline std::string size_in_words(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

/// Reads the images of a recording and counts by reason those that cannot be used.
class ROSLAM_EXPORT FrameImages {
 public:
  Counts skipped;        ///< colour images
  Counts skipped_depth;  ///< depth images

  /// An image as CV_8UC3 (BGR), or an empty one if it cannot be used. camera: the size it must have.
  cv::Mat colour(const std::filesystem::path& file, const cv::Size& camera);

  /// The same as CV_8UC1 of a right camera; one that cannot be used is counted with the depth images.
  cv::Mat right(const std::filesystem::path& file, const cv::Size& camera);

  /// An image as CV_32FC1 metres, 0 = unknown, or an empty one if it cannot be used. size: that it must have;
  /// of: whose size that is, for the message.
  cv::Mat depth(const std::filesystem::path& file, double units_per_metre, const cv::Size& size,
                const std::string& of = "the colour image");

  /// Adds what was found out about the images read so far.
  void add_to(Counts& notes) const;

 private:
  cv::Mat read(const std::filesystem::path& file, const cv::Size& camera, const std::string& kind,
               Counts& unused);

  int bits_ = 8;                            // of a channel of the colour images so far
  std::size_t saturated_depth_pixels_ = 0;  // taken as unknown
};

}  // namespace roslam
