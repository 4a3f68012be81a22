// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>

#include "evaluation/restoration_error.hpp"
#include "roslam/semantics/segmenter.hpp"

namespace roslam::app {

struct RestorationEvaluationSettings {
  std::filesystem::path truth;     ///< images without dynamic objects
  std::filesystem::path estimate;  ///< restored images
  std::filesystem::path masks;     ///< images named as the restored ones, nonzero where they were restored;
                                   ///< empty: the provenance beside the restored ones
  std::optional<double> truth_depth_units = std::nullopt;  ///< per metre; nothing: as stated beside the truth
  Segmenter* segmenter = nullptr;  ///< labels inpainted pixels as movable or not; null: not tested
  std::size_t every = 1;           ///< every so many-th image is compared
  std::stop_token stop;
  bool quiet = false;
};

/// Compares the images that truth and estimate have in common: by timestamp if both are TUM RGB-D folders,
/// else by name. Of a folder of roslam compose or simulate the background images are the truth. Throws
/// InputError for files that are missing or do not fit, and if nothing can be compared.
evaluation::RestorationError evaluate_restoration(const RestorationEvaluationSettings& settings);

}  // namespace roslam::app
