// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

namespace roslam::app {

/// Adds `check` to the command `camera`.
void add_camera_check_command(CLI::App& camera);

}  // namespace roslam::app
