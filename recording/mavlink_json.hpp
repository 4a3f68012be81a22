// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "telemetry/mavlink/mavlink_report.hpp"

namespace roslam::recording {

/// The section mavlink of run.json.
nlohmann::ordered_json mavlink_json(const telemetry::MavlinkReport& report);

/// The same in one line.
std::string in_words(const telemetry::MavlinkReport& report);

}  // namespace roslam::recording
