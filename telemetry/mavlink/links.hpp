// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "telemetry/mavlink/mavlink_link.hpp"

namespace roslam::telemetry {

// The kinds of links; each throws InputError as open_mavlink_link() says.
std::unique_ptr<MavlinkLink> open_udp_link(const MavlinkAddress& address);
std::unique_ptr<MavlinkLink> open_serial_link(const MavlinkAddress& address);

/// Whether a serial port can be told this rate.
bool is_baud(int baud);

/// The rates, in words.
std::string bauds_in_words();

}  // namespace roslam::telemetry
