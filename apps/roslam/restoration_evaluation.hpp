// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>

#include "roslam/evaluation/restoration_error.hpp"
#include "roslam/semantics/segmenter.hpp"

namespace roslam::app {

struct RestorationEvaluationSettings {
  std::filesystem::path truth;     ///< pictures without what moves
  std::filesystem::path estimate;  ///< restored pictures
  std::filesystem::path masks;     ///< images named as the restored ones, nonzero where they were restored;
                                   ///< empty: the provenance beside the restored ones
  std::optional<double> truth_depth_units =
      std::nullopt;                ///< a metre; nothing: as the camera.yaml beside the truth says
  Segmenter* segmenter = nullptr;  ///< says what in the invented pixels may move; null: is not asked
  std::size_t every = 1;           ///< of the pictures, one in so many is compared
  std::stop_token stop;
  bool quiet = false;
};

/// Compares the pictures that truth and estimate have in common: by the time, where both are sequences in the
/// TUM format, else by the name. A truth that roslam compose or simulate wrote is that without its actors.
/// Throws InputError for what is missing, does not fit, or tells nothing.
RestorationError evaluate_restoration(const RestorationEvaluationSettings& settings);

}  // namespace roslam::app
