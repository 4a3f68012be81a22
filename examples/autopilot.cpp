// SPDX-License-Identifier: BSD-3-Clause
// Sends the poses of a flight to an autopilot by MAVLink. Here a recording takes the place of the camera.
#include <iostream>

#include "roslam/common/error.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/slam/open_slam.hpp"
#include "roslam/slam/run.hpp"
#include "telemetry/mavlink/mavlink_sender.hpp"

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: autopilot TUM_FOLDER CAMERA udp:HOST:PORT|serial:DEVICE:BAUD\n";
    return 2;
  }
  try {
    roslam::TumSource source(argv[1], roslam::load_camera(argv[2]));
    const auto slam = roslam::open_slam(source.camera(), {}, roslam::Mode::kRealTime);
    roslam::telemetry::MavlinkSender sender(roslam::telemetry::MavlinkAddress::from(argv[3]), {},
                                            [&] { return slam->loops(); });
    roslam::run_slam(source, *slam, [&](const roslam::Frame&, const roslam::FrameResult& result) {
      sender.add(roslam::telemetry::TrackingReport(result));  // never waits
      for (const std::string& warning : sender.take_warnings()) std::cerr << warning << "\n";
    });
    sender.finish();
    const auto report = sender.report();
    std::cout << report.stream.odometry << " poses, " << report.dropped << " messages dropped\n";
  } catch (const roslam::Error& error) {
    std::cerr << "error: " << error.what() << "\n";
    return 1;
  }
}
