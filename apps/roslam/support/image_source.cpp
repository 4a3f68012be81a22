// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/image_source.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <opencv2/videoio.hpp>
#include <string_view>
#include <system_error>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam {

namespace {
namespace fs = std::filesystem;

bool has_ending(const fs::path& file, const auto& endings) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

bool is_image(const fs::path& file) {
  constexpr std::array<std::string_view, 9> kEndings{".png",  ".jpg",  ".jpeg", ".bmp", ".tif",
                                                     ".tiff", ".webp", ".ppm",  ".pgm"};
  return has_ending(file, kEndings);
}

bool is_video(const fs::path& file) {
  constexpr std::array<std::string_view, 8> kEndings{".mp4",  ".avi", ".mkv", ".mov",
                                                     ".webm", ".m4v", ".mpg", ".mjpg"};
  return has_ending(file, kEndings);
}

std::vector<fs::path> image_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_regular_file(error) && is_image(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

class ImageFiles : public ImageSource {
 public:
  explicit ImageFiles(std::vector<fs::path> files) : files_(std::move(files)) {}

  std::optional<Image> next() override {
    while (position_ < files_.size()) {
      const fs::path& file = files_[position_++];
      ImageFile read = read_colour_image(file);
      if (read.error.empty()) return Image{file.stem().string(), read.image};
      ++skipped_["image " + read.error];
    }
    return std::nullopt;
  }

  std::optional<std::size_t> size() const override { return files_.size(); }
  const std::map<std::string, std::size_t>& skipped() const override { return skipped_; }

 private:
  std::vector<fs::path> files_;
  std::size_t position_ = 0;
  std::map<std::string, std::size_t> skipped_;
};

class VideoImages : public ImageSource {
 public:
  explicit VideoImages(const fs::path& file) : video_(file.string(), cv::CAP_FFMPEG) {
    if (!video_.isOpened()) {
      throw InputError(file.string() +
                       ": is no video that can be decoded; convert it to MP4 (H.264) or to images");
    }
  }

  std::optional<Image> next() override {
    cv::Mat image;
    if (!video_.read(image)) return std::nullopt;
    char name[16];
    std::snprintf(name, sizeof(name), "%06zu", frames_++);
    return Image{name, image};
  }

  std::optional<std::size_t> size() const override {
    const double count = video_.get(cv::CAP_PROP_FRAME_COUNT);
    if (count < 1.0) return std::nullopt;
    return static_cast<std::size_t>(count);
  }

  const std::map<std::string, std::size_t>& skipped() const override { return skipped_; }

 private:
  cv::VideoCapture video_;
  std::size_t frames_ = 0;
  std::map<std::string, std::size_t> skipped_;
};

// Results are named after the images: one would overwrite the other.
void reject_equal_names(const std::vector<fs::path>& files) {
  std::map<std::string, fs::path> seen;
  for (const auto& file : files) {
    const auto [other, is_new] = seen.emplace(file.stem().string(), file);
    if (!is_new) {
      throw InputError(file.string() + ": has the same name as " + other->second.string() +
                       "; label them in separate calls");
    }
  }
}
}  // namespace

std::vector<fs::path> images_in(const fs::path& folder) {
  if (TumSource::recognises(folder)) {
    std::vector<fs::path> files;
    for (const auto& entry : read_tum_list(folder / "rgb.txt")) files.push_back(folder / entry.file);
    return files;
  }
  for (const auto& path : {folder, folder / "images", folder / "rgb"}) {
    if (auto files = image_files(path); !files.empty()) return files;
  }
  throw InputError(folder.string() +
                   ": holds no images (PNG, JPEG, BMP, TIFF, WebP) and is no TUM RGB-D folder");
}

std::unique_ptr<ImageSource> open_images(const std::vector<fs::path>& inputs) {
  std::vector<fs::path> files;
  for (const auto& input : inputs) {
    std::error_code error;
    if (fs::is_directory(input, error)) {
      const auto found = images_in(input);
      files.insert(files.end(), found.begin(), found.end());
    } else if (!fs::exists(input, error)) {
      throw InputError(input.string() + ": no such image, folder or video");
    } else if (is_video(input)) {
      if (inputs.size() > 1) throw InputError(input.string() + ": a video must be given alone");
      return std::make_unique<VideoImages>(input);
    } else {
      files.push_back(input);
    }
  }
  reject_equal_names(files);
  return std::make_unique<ImageFiles>(std::move(files));
}

}  // namespace roslam
