// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/datasets/dataset.hpp"

#include <string>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/datasets/formats.hpp"
#include "roslam/datasets/text_numbers.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/stereo/rectified_source.hpp"

namespace roslam {

namespace {
namespace fs = std::filesystem;
using namespace datasets;

bool is_tum(const fs::path& folder) {
  return is_present(folder / "rgb.txt") || is_present(folder / "depth.txt") || is_associated(folder);
}

struct Format {
  DatasetFormat format;
  std::string_view name;
  bool has_depth;
  bool (*recognises)(const fs::path&);
  FolderListing (*list)(const fs::path&, const std::optional<Camera>&);  // none: TUM
};

// In this order: ICL-NUIM has the layout of TUM RGB-D as well.
constexpr Format kFormats[] = {
    {DatasetFormat::kEuroc, "EuRoC", false, is_euroc, list_euroc},
    {DatasetFormat::kKitti, "KITTI odometry", false, is_kitti, list_kitti},
    {DatasetFormat::kOpenLoris, "OpenLORIS", true, is_open_loris, list_open_loris},
    {DatasetFormat::kScanNet, "ScanNet", true, is_scannet, list_scannet},
    {DatasetFormat::kSevenScenes, "7-Scenes", true, is_seven_scenes, list_seven_scenes},
    {DatasetFormat::kIclNuim, "ICL-NUIM", true, is_icl_nuim, list_icl_nuim},
    {DatasetFormat::kTum, "TUM RGB-D", true, is_tum, nullptr},
};

const Format& entry_of(DatasetFormat format) {
  for (const Format& entry : kFormats) {
    if (entry.format == format) return entry;
  }
  throw UsageError("no such dataset format");
}

// The presets that the name of a folder suggests.
std::string fitting_presets(const fs::path& folder) {
  const std::string name = fs::absolute(folder).lexically_normal().string();
  for (const char* number : {"1", "2", "3"}) {
    if (name.find("freiburg" + std::string(number)) != std::string::npos)
      return std::string("tum-fr") + number;
  }
  std::string all;
  for (const auto& preset : camera_preset_names()) {
    if (preset != "simulated") all += (all.empty() ? "" : " ") + preset;
  }
  return all;
}

std::unique_ptr<FrameSource> open_tum(const fs::path& folder, const std::optional<Camera>& camera) {
  if (!camera) {
    throw InputError(folder.string() + ": needs --camera with a preset (" + fitting_presets(folder) +
                     ") or a file");
  }
  const bool has_lists = is_present(folder / "rgb.txt") && is_present(folder / "depth.txt");
  if (!has_lists && is_associated(folder))
    return std::make_unique<FolderSource>(list_associated(folder, *camera));
  TumOptions options;
  options.ground_truth = true;
  return std::make_unique<TumSource>(folder, *camera, options);
}

// The first folder within a folder that has a format.
std::optional<fs::path> dataset_within(const fs::path& folder) {
  std::optional<fs::path> first;
  std::error_code error;
  int left = 100;
  fs::directory_iterator entries(folder, error);
  for (; !error && entries != fs::directory_iterator() && left > 0; entries.increment(error), --left) {
    std::error_code ignored;
    if (!entries->is_directory(ignored) || (first && *first < entries->path())) continue;
    if (dataset_format(entries->path())) first = entries->path();
  }
  return first;
}
}  // namespace

std::optional<DatasetFormat> dataset_format(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return std::nullopt;
  for (const Format& entry : kFormats) {
    if (entry.recognises(folder)) return entry.format;
  }
  return std::nullopt;
}

std::string_view name_of(DatasetFormat format) { return entry_of(format).name; }

bool has_depth(DatasetFormat format) { return entry_of(format).has_depth; }

std::unique_ptr<FrameSource> open_dataset(const fs::path& folder, const std::optional<Camera>& camera,
                                          DatasetUse use) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(folder.string() + ": no such folder; give a folder of a dataset or simulated:street");
  const auto format = dataset_format(folder);
  if (!format) {
    const auto within = dataset_within(folder);
    throw InputError(
        folder.string() +
        (within ? ": is no sequence, but has some; give one of them, such as " + within->string()
                : ": is no dataset that is known (TUM RGB-D, 7-Scenes, ScanNet, ICL-NUIM, OpenLORIS, EuRoC, "
                  "KITTI odometry); a TUM RGB-D folder holds rgb.txt, depth.txt and the images they name"));
  }
  const Format& entry = entry_of(*format);
  if (!entry.list) return open_tum(folder, camera);
  auto source = std::make_unique<FolderSource>(entry.list(folder, camera));
  if (entry.has_depth || use == DatasetUse::kImages) return source;
  if (!source->right()) {
    throw InputError(folder.string() +
                     ": has the images of one camera only, which do not tell the scale of the map; give "
                     "stereo pairs (the second camera's folder and calibration) or images with depth");
  }
  return std::make_unique<RectifiedSource>(std::move(source));
}

}  // namespace roslam
