// SPDX-License-Identifier: BSD-3-Clause
// Renders the flight that tests share (see street.hpp) into the folder given.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "roslam/geometry/trajectory.hpp"
#include "simulation/simulated_source.hpp"
#include "tests/street.hpp"

int main(int count, char** arguments) {
  namespace fs = std::filesystem;
  namespace street = roslam::street;
  if (count != 2) {
    std::cerr << "usage: record_street FOLDER\n";
    return 2;
  }
  const fs::path folder = arguments[1];
  fs::remove_all(folder);
  for (const char* name : {"rgb", "depth"}) fs::create_directories(folder / name);
  roslam::simulation::SimulatorOptions options;
  options.traffic = roslam::simulation::TrafficLevel::kNone;
  roslam::simulation::Simulator simulator(options);
  std::ofstream colours(folder / "rgb.txt");
  std::ofstream depths(folder / "depth.txt");
  roslam::Trajectory truth;
  for (std::size_t i = 0; i < street::kEnd; i = i + 1 == street::kBeforeGap ? street::kGapEnd : i + 1) {
    const roslam::Frame frame = simulator.render(i).frame;
    const std::string time = std::to_string(street::time_of(i));
    cv::Mat packed;
    frame.depth.convertTo(packed, CV_16U, simulator.camera().depth_units_per_metre);
    cv::imwrite((folder / "rgb" / (time + ".png")).string(), frame.colour, {cv::IMWRITE_PNG_COMPRESSION, 1});
    cv::imwrite((folder / "depth" / (time + ".png")).string(), packed, {cv::IMWRITE_PNG_COMPRESSION, 1});
    colours << time << " rgb/" << time << ".png\n";
    depths << time << " depth/" << time << ".png\n";
    truth.push_back({street::time_of(i), *frame.T_world_camera});
  }
  roslam::write_trajectory(folder / "groundtruth.txt", truth);
  return colours && depths ? 0 : 1;
}
