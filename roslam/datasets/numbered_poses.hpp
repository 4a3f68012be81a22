// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>

#include "roslam/datasets/folder_source.hpp"

namespace roslam::datasets {

/// Adds frames for the numbers that have a colour image: time = number / fps (such sets have no times), depth
/// and pose of the same number. poses: files of a 4x4 matrix, camera to world; one that is no rigid
/// transform, such as -inf where the camera was lost, is no truth and is counted in the notes.
void list_numbered(const std::map<long, std::filesystem::path>& colour,
                   const std::map<long, std::filesystem::path>& depth,
                   const std::map<long, std::filesystem::path>& poses, double fps, FolderListing& listing);

}  // namespace roslam::datasets
