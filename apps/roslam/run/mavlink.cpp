// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/run/mavlink.hpp"

#include <charconv>
#include <cstdint>
#include <iostream>

#include "roslam/common/error.hpp"

namespace roslam::app {

using namespace telemetry;

namespace {
MavlinkId id_from(const std::string& text) {
  MavlinkId id;
  const char* const end = text.data() + text.size();
  const auto [comma, error] = std::from_chars(text.data(), end, id.system);
  const bool has_system = error == std::errc() && comma != end && *comma == ',';
  bool is_read = false;
  if (has_system) {
    const auto [rest, wrong] = std::from_chars(comma + 1, end, id.component);
    is_read = wrong == std::errc() && rest == end;
  }
  if (!is_read || id.system == 0 || id.component == 0)
    throw InputError("--mavlink-id " + text +
                     ": is not SYSTEM,COMPONENT, two numbers from 1 to 255, such as 1,197");
  return id;
}
}  // namespace

void add_stream_options(CLI::App& command, MavlinkArguments& arguments) {
  command
      .add_option("--frame", arguments.frame,
                  "Pose that an autopilot is sent: odom, which no correction of the map moves, or map, which "
                  "jumps with each of them and then raises the reset counter")
      ->check(CLI::IsMember({"odom", "map"}))
      ->capture_default_str();
  command.add_flag("--send-predicted", arguments.send_predicted,
                   "Also send poses that are extrapolated while dynamic objects hide the scene");
}

void add_mavlink_options(CLI::App& command, MavlinkArguments& arguments) {
  CLI::Option* mavlink = command.add_option(
      "--mavlink", arguments.address,
      "Send poses to an autopilot by MAVLink 2: udp:HOST:PORT[:LOCAL_PORT] or serial:DEVICE:BAUD, such as "
      "serial:/dev/ttyTHS1:921600 (docs/autopilot.md)");
  add_stream_options(command, arguments);
  command
      .add_option("--origin", arguments.origin,
                  "LAT,LON,ALT (degrees, metres above the sea) of the place where the flight begins, for "
                  "the autopilot to take for its origin; default none")
      ->needs(mavlink);
  command.add_option("--mavlink-id", arguments.id, "System and component number to send as")
      ->needs(mavlink)
      ->capture_default_str();
  command.get_option("--frame")->needs(mavlink);
  command.get_option("--send-predicted")->needs(mavlink);
}

OdometryStreamOptions stream_options(const MavlinkArguments& arguments) {
  OdometryStreamOptions options;
  options.frame = arguments.frame == "map" ? PoseFrame::kMap : PoseFrame::kOdom;
  options.sends_predicted = arguments.send_predicted;
  return options;
}

std::unique_ptr<MavlinkSender> open_mavlink(const MavlinkArguments& arguments, const Slam& slam) {
  if (arguments.address.empty()) return nullptr;
  MavlinkSenderOptions options;
  options.stream = stream_options(arguments);
  options.stream.mode = slam.mode();
  options.stream.is_inertial = slam.camera().imu.has_value();
  options.fps = slam.camera().fps;
  options.id = id_from(arguments.id);
  if (!arguments.origin.empty()) options.origin = GeodeticOrigin::from(arguments.origin);
  const MavlinkAddress address = MavlinkAddress::from(arguments.address);
  auto sender = std::make_unique<MavlinkSender>(address, options, [&slam] { return slam.loops(); });
  if (slam.mode() == Mode::kDeterministic)
    std::cerr << "note: --mavlink without --real-time: time_usec is the timestamp of the frame, not on the "
                 "clock of TIMESYNC\n";
  return sender;
}

}  // namespace roslam::app
