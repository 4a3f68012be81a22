// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace roslam::app {

/// An image of a sequence, or of a folder of images.
struct SequenceImage {
  std::string name;                 ///< of the file, without extension
  std::optional<double> timestamp;  ///< seconds; nothing in a folder of images
  std::filesystem::path colour;
  std::filesystem::path depth;  ///< 16 bit; empty = none
};

/// The images of a folder: those listed in its rgb.txt and depth.txt, else the files in it or in its rgb/.
/// Throws InputError if there are none.
std::vector<SequenceImage> images_of(const std::filesystem::path& folder);

/// The same without dynamic objects: those listed in its background.txt (roslam compose) or in its
/// background/ (roslam simulate); else the images of the folder.
std::vector<SequenceImage> background_of(const std::filesystem::path& folder);

/// Whether the folder has such background images, so that background_of() differs from images_of().
bool knows_background(const std::filesystem::path& folder);

/// Value of the depth images of background_of(folder) at one metre, from composition.json (roslam compose) or
/// camera.yaml; nothing if there is neither. Throws as read_camera() does.
std::optional<double> depth_units_beside(const std::filesystem::path& folder);

}  // namespace roslam::app
