// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/commands.hpp"

namespace roslam::app {

void add_evaluate_command(CLI::App&) {}

}  // namespace roslam::app
