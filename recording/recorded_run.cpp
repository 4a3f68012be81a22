// SPDX-License-Identifier: BSD-3-Clause
#include "recording/recorded_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "roslam/common/error.hpp"

namespace roslam::recording {

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kSameTime = 2e-6;  // seconds; files have six decimals

Camera camera_from(const Json& json) {
  Camera camera;
  json.at("width").get_to(camera.width);
  json.at("height").get_to(camera.height);
  json.at("fx").get_to(camera.fx);
  json.at("fy").get_to(camera.fy);
  json.at("cx").get_to(camera.cx);
  json.at("cy").get_to(camera.cy);
  camera.set_lens(json.value("model", "pinhole"), json.at("distortion").get<std::vector<double>>());
  json.at("depth_units_per_metre").get_to(camera.depth_units_per_metre);
  json.at("fps").get_to(camera.fps);
  camera.baseline = json.value("baseline", 0.0);
  if (json.contains("T_body_camera")) {
    const auto T = json["T_body_camera"].get<std::array<double, 16>>();
    const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(T.data());
    camera.T_body_camera = SE3(matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>());
  }
  camera.validate();
  return camera;
}

template <typename Read>
void read_report(const fs::path& folder, const Read& read) {
  const fs::path file = folder / "run.json";
  try {
    read(Json::parse(std::ifstream(file)));
  } catch (const Json::exception&) {
    throw InputError(file.string() + ": does not name the source and the camera of the run; repeat the run");
  }
}

// A run without tracked frames leaves an empty file.
Trajectory trajectory_of(const fs::path& file) {
  std::error_code error;
  if (fs::is_regular_file(file, error) && fs::file_size(file, error) == 0) return {};
  return read_trajectory(file).trajectory;
}
}  // namespace

RunSource source_of_run(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_regular_file(folder / "run.json", error)) {
    throw InputError((folder / "run.json").string() +
                     ": no such file; give the folder that roslam run wrote with --out");
  }
  RunSource source;
  read_report(folder, [&](const Json& json) {
    json.at("source").get_to(source.name);
    if (json.contains("flight")) json["flight"].get_to(source.flight);
    source.camera = camera_from(json.at("camera"));
    source.is_whole = json.value("finished", true) && !json.value("interrupted", false);
  });
  return source;
}

Camera camera_of_run(const fs::path& folder) {
  Camera camera;
  read_report(folder, [&](const Json& json) { camera = camera_from(json.at("camera")); });
  return camera;
}

bool RecordedRun::recognises(const fs::path& folder) {
  std::error_code error;
  return fs::is_regular_file(folder / "run.json", error) &&
         fs::is_regular_file(folder / "trajectory.txt", error);
}

RecordedRun::RecordedRun(const fs::path& folder)
    : removal_(folder),
      trajectory_(trajectory_of(folder / "trajectory.txt")),
      keyframes_(trajectory_of(folder / "keyframes.txt")),
      source_(source_of_run(folder)) {}

std::optional<SE3> RecordedRun::pose_at(double timestamp) const {
  const auto later =
      std::lower_bound(trajectory_.begin(), trajectory_.end(), timestamp - kSameTime,
                       [](const StampedPose& pose, double time) { return pose.timestamp < time; });
  if (later == trajectory_.end() || std::abs(later->timestamp - timestamp) > kSameTime) return std::nullopt;
  return later->T_world_camera;
}

}  // namespace roslam::recording
