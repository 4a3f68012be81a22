// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>

#include "apps/roslam/support/sources.hpp"
#include "evaluation/removal_error.hpp"

namespace roslam::app {

struct RemovalEvaluationSettings {
  std::stop_token stop;  ///< ends it early with the results so far
  bool quiet = true;     ///< no progress on stderr
};

/// Compares the points a run removed with the true dynamic objects of its source. run_folder: of `roslam
/// run`; a run with --dynamic none has no masks and keeps every point. Nothing if the source has no truth of
/// the dynamic objects. Throws InputError or CalibrationError, naming the file, if source or folder are
/// unusable, if no frame can be compared, or if the run was made from another source.
std::optional<evaluation::RemovalError> evaluate_removal_of_run(
    const SourceArguments& source, const std::filesystem::path& run_folder,
    const RemovalEvaluationSettings& settings = {});

}  // namespace roslam::app
