// SPDX-License-Identifier: BSD-3-Clause
// OpenLORIS-Scene, the RealSense D435i of a sequence: color.txt and aligned_depth.txt (lists as in TUM RGB-D,
// millimetres), sensors.yaml (intrinsics fx cx fy cy), trans_matrix.yaml (a list of parent_frame, child_frame
// and the matrix that maps child to parent), groundtruth.txt (poses of the robot's base_link, TUM format),
// d400_gyroscope.txt and d400_accelerometer.txt (time and three numbers a line).
#include <algorithm>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/datasets/formats.hpp"
#include "roslam/datasets/inertial_lists.hpp"
#include "roslam/datasets/paired_lists.hpp"
#include "roslam/datasets/text_numbers.hpp"
#include "roslam/geometry/camera_formats.hpp"
#include "roslam/sensors/ground_truth.hpp"

namespace roslam::datasets {

namespace {
constexpr const char* kColourFrame = "d400_color_optical_frame";
constexpr double kMaxTimeDifference = 0.02;  // seconds

Camera camera_of(const Path& folder) {
  const CalibrationPart file =
      open_calibration(folder / "sensors.yaml", "it comes with the sequence, or give --camera FILE");
  if (!file.has(kColourFrame)) file.fail("has no '" + std::string(kColourFrame) + "'; give --camera FILE");
  const CalibrationPart part = file.part(kColourFrame);
  const auto intrinsics = part.numbers("intrinsics", 4);
  Camera camera;
  camera.width = part.pixels("width");
  camera.height = part.pixels("height");
  camera.fx = intrinsics[0];
  camera.cx = intrinsics[1];
  camera.fy = intrinsics[2];
  camera.cy = intrinsics[3];
  const std::string model = part.text("distortion_model", "none");
  set_lens(camera, part, model,
           model == "none" ? std::vector<double>{} : part.numbers("distortion_coefficients"));
  camera.fps = part.number("fps", camera.fps);
  camera.depth_units_per_metre = 1000.0;
  camera.depth_noise = camera_preset("d435")->depth_noise;
  return camera;
}

// T_base_sensor of a frame of trans_matrix.yaml, through its parents; nothing if they do not lead to the
// base.
std::optional<SE3> mounted_at(const Path& folder, std::string frame) {
  if (!is_present(folder / "trans_matrix.yaml")) return std::nullopt;
  const CalibrationPart file = open_calibration(folder / "trans_matrix.yaml", "it comes with the sequence");
  if (!file.has("trans_matrix") || !file.node()["trans_matrix"].IsSequence()) return std::nullopt;
  std::vector<CalibrationPart> entries;
  for (const YAML::Node& entry : file.node()["trans_matrix"]) entries.emplace_back(file.name(), "", entry);
  SE3 T_parent_sensor;
  constexpr int kMostParents = 20;  // of a chain without a circle
  for (int i = 0; i < kMostParents && frame != "base_link"; ++i) {
    const auto found = std::find_if(entries.begin(), entries.end(), [&](const CalibrationPart& entry) {
      return entry.text("child_frame", "") == frame;
    });
    if (found == entries.end()) return std::nullopt;
    T_parent_sensor = found->transform("matrix") * T_parent_sensor;
    frame = found->text("parent_frame", "");
  }
  return frame == "base_link" ? std::make_optional(T_parent_sensor) : std::nullopt;
}

void add_truth(const Path& folder, double seconds, const std::optional<SE3>& T_base_camera,
               FolderListing& listing) {
  if (!is_present(folder / "groundtruth.txt")) return;
  if (!T_base_camera) {
    ++listing.notes["the ground truth is not used, as trans_matrix.yaml does not lead from base_link to " +
                    std::string(kColourFrame)];
    return;
  }
  const Trajectory truth = read_ground_truth(folder / "groundtruth.txt", seconds, listing.notes);
  for (auto& frame : listing.frames) {
    if (const auto base = true_pose_at(truth, frame.timestamp)) frame.T_world_camera = *base * *T_base_camera;
  }
}

void add_inertial(const Path& folder, double seconds, const std::optional<SE3>& T_base_camera,
                  FolderListing& listing) {
  const Path gyroscope = folder / "d400_gyroscope.txt";
  const Path accelerometer = folder / "d400_accelerometer.txt";
  if (!is_present(gyroscope) || !is_present(accelerometer)) return;
  if (!listing.camera.imu) {
    std::optional<SE3> T_base_imu;
    for (const char* name : {"d400_gyroscope", "d400_imu", "d400_imu_optical_frame", "d400_accelerometer"}) {
      if (!T_base_imu) T_base_imu = mounted_at(folder, name);
    }
    if (!T_base_imu || !T_base_camera) {
      ++listing.notes
            ["the inertial samples are not used, as trans_matrix.yaml does not tell how the unit is "
             "mounted"];
      return;
    }
    listing.camera.imu.emplace().T_camera_imu = T_base_camera->inverse() * *T_base_imu;
  }
  listing.inertial = read_inertial_lists(gyroscope, accelerometer, seconds, listing.notes);
}
}  // namespace

bool is_open_loris(const Path& folder) {
  return is_present(folder / "color.txt") &&
         (is_present(folder / "aligned_depth.txt") || is_present(folder / "depth.txt"));
}

FolderListing list_open_loris(const Path& folder, const GivenCamera& camera) {
  FolderListing listing{folder.string(), camera ? *camera : camera_of(folder), {}};
  const bool is_aligned = is_present(folder / "aligned_depth.txt");
  if (!is_aligned) ++listing.notes["aligned_depth.txt is missing; the depth of depth.txt is not registered"];
  const double seconds =
      list_by_time(folder / "color.txt", folder / (is_aligned ? "aligned_depth.txt" : "depth.txt"),
                   kMaxTimeDifference, listing);
  const auto T_base_camera = mounted_at(folder, kColourFrame);
  add_truth(folder, seconds, T_base_camera, listing);
  add_inertial(folder, seconds, T_base_camera, listing);
  return listing;
}

}  // namespace roslam::datasets
