// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "roslam/datasets/folder_source.hpp"

/// One function a format to recognise a folder and one to list it. camera: as the user gave it; nothing: the
/// calibration of the folder or the format. Listings throw InputError for a folder that cannot be used.
namespace roslam::datasets {

using Path = std::filesystem::path;
using GivenCamera = std::optional<Camera>;

/// Colour and depth images paired by a list (associations.txt), in the layout of TUM RGB-D.
bool is_associated(const Path& folder);
FolderListing list_associated(const Path& folder, const Camera& camera);

bool is_seven_scenes(const Path& folder);
FolderListing list_seven_scenes(const Path& folder, const GivenCamera& camera);

bool is_scannet(const Path& folder);
FolderListing list_scannet(const Path& folder, const GivenCamera& camera);

bool is_icl_nuim(const Path& folder);
FolderListing list_icl_nuim(const Path& folder, const GivenCamera& camera);

bool is_open_loris(const Path& folder);
FolderListing list_open_loris(const Path& folder, const GivenCamera& camera);

bool is_euroc(const Path& folder);
FolderListing list_euroc(const Path& folder, const GivenCamera& camera);

bool is_kitti(const Path& folder);
FolderListing list_kitti(const Path& folder, const GivenCamera& camera);

}  // namespace roslam::datasets
