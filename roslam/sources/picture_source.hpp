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

/// A picture without time, depth or camera.
struct Picture {
  std::string name;  ///< file name without its ending; of a video the frame number
  cv::Mat image;     ///< CV_8UC3, BGR
};

/// Pictures from wherever a user has them.
class PictureSource {
 public:
  PictureSource() = default;
  PictureSource(const PictureSource&) = delete;
  PictureSource& operator=(const PictureSource&) = delete;
  virtual ~PictureSource() = default;

  /// The next picture that can be read, or nothing at the end.
  virtual std::optional<Picture> next() = 0;

  /// Number of pictures, those that will be skipped included, where it is known.
  virtual std::optional<std::size_t> size() const = 0;

  /// Pictures skipped so far, by reason in words.
  virtual const std::map<std::string, std::size_t>& skipped() const = 0;
};

/// The picture files (PNG, JPEG, BMP, TIFF, WebP, PPM) of a folder, or of its subfolder images or rgb if it
/// has none itself, sorted by name; of a TUM RGB-D folder those rgb.txt names. Throws InputError if there are
/// none.
std::vector<std::filesystem::path> pictures_in(const std::filesystem::path& folder);

/// Opens picture files, folders of pictures, TUM RGB-D folders, or one video. Throws InputError naming what
/// is missing, what holds no picture, and two pictures of the same name.
std::unique_ptr<PictureSource> open_pictures(const std::vector<std::filesystem::path>& inputs);

}  // namespace roslam
