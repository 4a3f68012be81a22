// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace roslam::app {

/// A picture of a sequence, or of a folder of pictures.
struct SequencePicture {
  std::string name;                 ///< of the file, without ending
  std::optional<double> timestamp;  ///< seconds; nothing in a folder of pictures
  std::filesystem::path colour;
  std::filesystem::path depth;  ///< 16 bit; empty = none
};

/// The pictures of a folder: as its rgb.txt and depth.txt list them, or those that lie in it or its rgb/.
/// Throws InputError if there are none.
std::vector<SequencePicture> pictures_of(const std::filesystem::path& folder);

/// The same without what moves, where the folder knows it: as its background.txt says (roslam compose), or
/// from its background/ (roslam simulate); else the pictures of the folder.
std::vector<SequencePicture> background_of(const std::filesystem::path& folder);

/// Whether the folder knows that: background_of then gives other pictures than pictures_of.
bool knows_background(const std::filesystem::path& folder);

/// Value of the depth images of background_of(folder) at one metre, as composition.json (roslam compose) or
/// camera.yaml beside them says; nothing if neither does. Throws as read_camera does.
std::optional<double> depth_units_beside(const std::filesystem::path& folder);

}  // namespace roslam::app
