// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

#include "roslam/common/export.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam {

/// Layouts of folders that datasets are published in (docs/datasets.md).
enum class DatasetFormat { kTum, kSevenScenes, kScanNet, kIclNuim, kOpenLoris, kEuroc, kKitti };

/// What a folder is opened for.
enum class DatasetUse {
  kSlam,   ///< frames with depth, or rectified stereo pairs
  kImages  ///< the images as they are in the folder, of stereo pairs not rectified
};

/// The format of a folder by its content; nothing if none is recognised.
ROSLAM_EXPORT std::optional<DatasetFormat> dataset_format(const std::filesystem::path& folder);

/// As the dataset is called, e.g. "7-Scenes".
ROSLAM_EXPORT std::string_view name_of(DatasetFormat format);

/// True if folders of a format have depth; those of the others are stereo pairs.
ROSLAM_EXPORT bool has_depth(DatasetFormat format);

/// Opens a folder. camera: as the user gave it, or nothing: then the calibration that the folder or its
/// format has is taken, of stereo pairs in place of that of the left camera. Frames carry the ground truth as
/// poses of the camera, where the folder has it. Throws InputError if the folder is missing, not recognised
/// or malformed, if its camera is not known (the message names fitting presets), or if it has neither depth
/// nor a right camera and use is kSlam; CalibrationError if the camera is invalid, has no
/// depth_units_per_metre, or makes no usable pair with the right one.
ROSLAM_EXPORT std::unique_ptr<FrameSource> open_dataset(const std::filesystem::path& folder,
                                                        const std::optional<Camera>& camera,
                                                        DatasetUse use = DatasetUse::kSlam);

}  // namespace roslam
