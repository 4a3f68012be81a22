// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/output.hpp"
#include "roslam/cameras/realsense_camera.hpp"

namespace roslam::app {

namespace {
using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

// What Linux calls the video devices (V4L2).
Json video_devices() {
  Json devices = Json::array();
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/sys/class/video4linux", error)) {
    std::string name;
    std::getline(std::ifstream(entry.path() / "name"), name);
    devices.push_back({{"device", "/dev/" + entry.path().filename().string()}, {"name", name}});
  }
  std::sort(devices.begin(), devices.end(), [](const Json& a, const Json& b) {
    return a["device"].get<std::string>() < b["device"].get<std::string>();
  });
  return devices;
}

Json realsense_devices() {
  Json devices = Json::array();
  if (!has_realsense()) return devices;
  for (const DepthCameraDevice& device : realsense_camera()->devices())
    devices.push_back({{"source", "realsense:" + device.serial},
                       {"name", device.name},
                       {"serial", device.serial},
                       {"firmware", device.firmware},
                       {"usb", device.usb}});
  return devices;
}

void list(bool json) {
  const Json cameras = realsense_devices(), videos = video_devices();
  if (json) {
    std::cout << Json{{"realsense_built_in", has_realsense()},
                      {"cameras", cameras},
                      {"video_devices", videos}}
                     .dump(-1, ' ', false, Json::error_handler_t::replace)
              << "\n";
    return require_written_output();
  }
  for (const Json& camera : cameras) {
    const auto usb = camera["usb"].get<std::string>();
    std::cout << camera["source"].get<std::string>() << "  " << camera["name"].get<std::string>()
              << ", firmware " << camera["firmware"].get<std::string>() << (usb.empty() ? "" : ", USB " + usb)
              << "\n";
    if (usb.starts_with("2"))
      std::cout << "note: connected by USB 2, which carries 15 images a second; use a USB 3 cable and port\n";
  }
  if (cameras.empty()) std::cout << "no RealSense camera is connected\n";
  if (!has_realsense())
    std::cout
        << "note: this program was built without librealsense and sees no RealSense cameras (docs/live.md)\n";
  for (const Json& video : videos)
    std::cout << video["device"].get<std::string>() << "  " << video["name"].get<std::string>()
              << " (video device; not a source of depth)\n";
  require_written_output();
}
}  // namespace

void add_camera_list_command(CLI::App& camera) {
  const auto json = std::make_shared<bool>(false);
  CLI::App* command = camera.add_subcommand("list", "List the cameras that are connected");
  command->footer(
      "Example:\n"
      "  roslam camera list\n"
      "Exit code: 0 success, also if there is none, 1 the driver failed, 2 wrong usage.");
  command->add_flag("--json", *json, "Print one JSON object on stdout");
  command->callback([json] { list(*json); });
}

}  // namespace roslam::app
