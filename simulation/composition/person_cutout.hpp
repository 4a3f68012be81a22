// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace roslam::simulation {

/// An image of one standing person, cropped to the person.
struct PersonCutout {
  std::string name;  ///< of the file, without its ending
  cv::Mat colour;    ///< CV_8UC3, BGR
  cv::Mat mask;      ///< CV_8UC1 of the same size, 255 = person, 0 = background
};

/// An image and its mask.
struct PersonFiles {
  std::filesystem::path image;  ///< NAME.jpg, NAME.jpeg or NAME.png
  std::filesystem::path mask;   ///< NAME_mask.png
};

/// The images of people in a folder, sorted by name. Throws InputError if there is no such folder, no
/// image in it, or an image has no mask.
std::vector<PersonFiles> people_in(const std::filesystem::path& folder);

/// Reads a person. Throws InputError naming the file that cannot be read, whose size differs or that marks no
/// person.
PersonCutout read_person(const PersonFiles& files);

}  // namespace roslam::simulation
