// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace roslam {

/// An image without time, depth or camera.
struct Image {
  std::string name;  ///< file name without extension; of a video the frame number
  cv::Mat image;     ///< CV_8UC3, BGR
};

/// Images from files, folders or a video.
class ImageSource {
 public:
  ImageSource() = default;
  ImageSource(const ImageSource&) = delete;
  ImageSource& operator=(const ImageSource&) = delete;
  virtual ~ImageSource() = default;

  /// The next readable image, or nothing at the end.
  virtual std::optional<Image> next() = 0;

  /// Number of images including those that will be skipped, if known.
  virtual std::optional<std::size_t> size() const = 0;

  /// Images skipped so far, by reason in words.
  virtual const std::map<std::string, std::size_t>& skipped() const = 0;
};

/// The image files (PNG, JPEG, BMP, TIFF, WebP, PPM) of a folder, or of its subfolder images or rgb if it
/// has none itself, sorted by name; of a TUM RGB-D folder those rgb.txt names. Throws InputError if there are
/// none.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// Opens image files, folders of images, TUM RGB-D folders, or one video. Throws InputError naming what
/// is missing, what holds no image, and two images of the same name.
std::unique_ptr<ImageSource> open_images(const std::vector<std::filesystem::path>& inputs);

}  // namespace roslam
