// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/frame_images.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "roslam/sensors/image_file.hpp"

namespace roslam {

cv::Mat FrameImages::colour(const std::filesystem::path& file, const cv::Size& camera) {
  return read(file, camera, "colour image ", skipped);
}

cv::Mat FrameImages::right(const std::filesystem::path& file, const cv::Size& camera) {
  cv::Mat grey;
  const cv::Mat image = read(file, camera, "right image ", skipped_depth);
  if (!image.empty()) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

cv::Mat FrameImages::read(const std::filesystem::path& file, const cv::Size& camera, const std::string& kind,
                          Counts& unused) {
  const ImageFile read = read_colour_image(file, bits_);
  if (read.error.empty() && read.image.size() == camera) {
    bits_ = std::max(bits_, read.bits);
    return read.image;
  }
  ++unused[kind + (read.error.empty() ? "is " + size_in_words(read.image.size()) + " but the camera " +
                                            size_in_words(camera) + " pixels"
                                      : read.error)];
  return {};
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
