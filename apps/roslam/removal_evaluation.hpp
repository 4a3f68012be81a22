// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>

#include "apps/roslam/sources.hpp"
#include "roslam/evaluation/removal_error.hpp"

namespace roslam::app {

struct RemovalEvaluationSettings {
  std::stop_token stop;  ///< ends it early, with what was compared so far
  bool quiet = true;     ///< no progress on stderr
};

/// How well a run removed what moves from the source it was made from. run_folder: as `roslam run` wrote it;
/// a run with --dynamic none had no masks, so that every point survives. Nothing if the source does not know
/// what moves in it. Throws InputError or CalibrationError, naming the file, if source or folder are
/// unusable, if no frame can be compared, or if the run was made from another source.
std::optional<RemovalError> evaluate_removal_of_run(const SourceArguments& source,
                                                    const std::filesystem::path& run_folder,
                                                    const RemovalEvaluationSettings& settings = {});

}  // namespace roslam::app
