// SPDX-License-Identifier: BSD-3-Clause
// A shared object that links libroslam, as a ROS 2 component or a Python module does, and uses its public
// headers alone.
#include <algorithm>
#include <opencv2/core.hpp>

#include "roslam/common/error.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/slam/open_slam.hpp"
#include "roslam/version.hpp"

extern "C" __attribute__((visibility("default"))) const char* plugin_version() { return roslam::kVersion; }

/// Tracks an image of random blocks with depth, three times. Returns the number of frames with a pose, or -1
/// for an error.
extern "C" __attribute__((visibility("default"))) int plugin_track() {
  try {
    const roslam::Camera camera = *roslam::camera_preset("d435");
    roslam::Options options;
    options.dynamic_objects.labels = false;
    options.dense.enabled = false;
    roslam::SlamSetup setup;
    setup.on_note = [](const std::string&) {};
    const auto slam = roslam::open_slam(camera, options, roslam::Mode::kRealTime, setup);
    roslam::Frame frame;
    cv::Mat blocks(camera.height / 8, camera.width / 8, CV_8UC3);
    cv::RNG random(1);
    random.fill(blocks, cv::RNG::UNIFORM, 0, 256);
    frame.colour.create(camera.height, camera.width, CV_8UC3);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        frame.colour.at<cv::Vec3b>(y, x) =
            blocks.at<cv::Vec3b>(std::min(y / 8, blocks.rows - 1), std::min(x / 8, blocks.cols - 1));
    frame.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(2.0));
    int tracked = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      frame.index = i;
      frame.timestamp = 0.03 * static_cast<double>(i);
      tracked += slam->process(frame).T_world_camera ? 1 : 0;
    }
    slam->finish();
    return slam->trajectory().size() == static_cast<std::size_t>(tracked) ? tracked : -1;
  } catch (const roslam::Error&) {
    return -1;
  }
}

/// 1 if an exception of the library is caught by its type across the border of the shared object.
extern "C" __attribute__((visibility("default"))) int plugin_catches() {
  try {
    roslam::read_camera("/nonexistent/camera.yaml");
  } catch (const roslam::InputError&) {
    return 1;
  } catch (...) {
    return 0;
  }
  return 0;
}
