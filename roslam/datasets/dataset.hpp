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
  kDepth,       ///< frames with colour and depth
  kImagesOnly,  ///< images are enough: folders of stereo pairs give the left ones, with an empty depth
};

/// The format of a folder by its content; nothing if none is recognised.
ROSLAM_EXPORT std::optional<DatasetFormat> dataset_format(const std::filesystem::path& folder);

/// As the dataset is called, e.g. "7-Scenes".
ROSLAM_EXPORT std::string_view name_of(DatasetFormat format);

/// True if folders of a format have depth; those of the others are stereo pairs.
ROSLAM_EXPORT bool has_depth(DatasetFormat format);

/// Opens a folder. camera: as the user gave it, or nothing: then the calibration that the folder or its
/// format has is taken. Frames carry the ground truth as poses of the camera, where the folder has it. Throws
/// InputError if the folder is missing, not recognised or malformed, if its camera is not known (the message
/// names fitting presets), or if it has no depth and use is kDepth; CalibrationError if the camera is invalid
/// or has no depth_units_per_metre.
ROSLAM_EXPORT std::unique_ptr<FrameSource> open_dataset(const std::filesystem::path& folder,
                                                        const std::optional<Camera>& camera,
                                                        DatasetUse use = DatasetUse::kDepth);

}  // namespace roslam
