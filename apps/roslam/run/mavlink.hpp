// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "roslam/slam/slam.hpp"
#include "telemetry/mavlink/mavlink_sender.hpp"

namespace roslam::app {

/// Options of what an autopilot is sent.
struct MavlinkArguments {
  std::string address;         ///< udp:HOST:PORT or serial:DEVICE:BAUD; empty: nothing is sent
  std::string frame = "odom";  ///< or map
  bool send_predicted = false;
  std::string origin;        ///< LAT,LON,ALT; empty: none
  std::string id = "1,197";  ///< system and component number of the sender
};

/// Adds --frame and --send-predicted, which roslam telemetry check has as well.
void add_stream_options(CLI::App& command, MavlinkArguments& arguments);

/// Adds --mavlink and all that belongs to it.
void add_mavlink_options(CLI::App& command, MavlinkArguments& arguments);

/// What the arguments ask for; the rest as by default.
telemetry::OdometryStreamOptions stream_options(const MavlinkArguments& arguments);

/// Opens the link; null if no address is given. Throws InputError.
std::unique_ptr<telemetry::MavlinkSender> open_mavlink(const MavlinkArguments& arguments, const Slam& slam);

}  // namespace roslam::app
