// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/frame_images.hpp"

#include <algorithm>

#include "roslam/sensors/image_file.hpp"

namespace roslam {

cv::Mat FrameImages::colour(const std::filesystem::path& file, const cv::Size& camera) {
  const ImageFile read = read_colour_image(file, bits_);
  if (!read.error.empty()) {
    ++skipped["colour image " + read.error];
    return {};
  }
  if (read.image.size() != camera) {
    ++skipped["colour image is " + size_in_words(read.image.size()) + " but the camera " +
              size_in_words(camera) + " pixels"];
    return {};
  }
  bits_ = std::max(bits_, read.bits);
  return read.image;
}

cv::Mat FrameImages::depth(const std::filesystem::path& file, double units_per_metre, const cv::Size& size,
                           const std::string& of) {
  const ImageFile read = read_depth_image(file);
  if (!read.error.empty()) {
    ++skipped_depth["depth image " + read.error];
    return {};
  }
  if (read.image.size() != size) {
    ++skipped_depth["depth image is " + size_in_words(read.image.size()) + " but " + of + " " +
                    size_in_words(size) + " pixels"];
    return {};
  }
  std::size_t saturated = 0;
  cv::Mat metres = depth_to_metres(read.image, units_per_metre, &saturated);
  saturated_depth_pixels_ += saturated;
  return metres;
}

void FrameImages::add_to(Counts& notes) const {
  if (bits_ > 8) ++notes["colour images of " + std::to_string(bits_) + " bits a channel were reduced to 8"];
  count(notes, "depth pixel at the end of the sensor's range, taken as unknown", saturated_depth_pixels_);
}

}  // namespace roslam
