// SPDX-License-Identifier: BSD-3-Clause
// EuRoC in the ASL layout: mav0/cam0 and cam1 with data.csv ("time in ns, file") and sensor.yaml (T_BS maps
// the sensor to the body), state_groundtruth_estimate0/data.csv (time, position, quaternion w x y z of the
// body), imu0/data.csv (time, turn rate, acceleration).
#include <cmath>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/datasets/formats.hpp"
#include "roslam/datasets/inertial_lists.hpp"
#include "roslam/datasets/text_numbers.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/geometry/camera_formats.hpp"
#include "roslam/sensors/ground_truth.hpp"

namespace roslam::datasets {

namespace {
constexpr double kNanosecond = 1e-9;
constexpr double kStereoDifference = 0.005;  // seconds; the cameras are triggered together

// The folder of the sensors: mav0, or the folder given.
Path sensors_of(const Path& folder) {
  return is_present(folder / "mav0" / "cam0" / "data.csv") ? folder / "mav0" : folder;
}

struct Sensor {
  Camera camera;
  SE3 T_body_sensor;
};

CalibrationPart open_sensor(const Path& folder) {
  return open_calibration(folder / "sensor.yaml", "it comes with the sequence");
}

// given: in place of the calibration.
Sensor read_sensor(const Path& folder, const GivenCamera& given) {
  const CalibrationPart file = open_sensor(folder);
  return {given ? *given : read_asl_camera(file).camera, file.transform("T_BS")};
}

TimedFileList read_images(const Path& folder) {
  TimedFileList list;
  const Path file = folder / "data.csv";
  for_each_line(file, "is the dataset complete?", [&](std::size_t number, std::string_view line) {
    const auto words = words_of(line);
    const auto time = words.size() == 2 ? number_from(words[0]) : std::nullopt;
    if (!time) {
      throw InputError(file.string() + ":" + std::to_string(number) +
                       ": expected 'timestamp,file'; correct or remove the line");
    }
    if (std::isfinite(*time)) {
      list.entries.push_back({*time * kNanosecond, folder / "data" / words[1]});
    } else {
      ++list.without_time;
    }
  });
  if (list.entries.empty()) throw InputError(file.string() + ": names no image; is the dataset complete?");
  return list;
}

// Poses of the body.
Trajectory read_body_poses(const Path& file, Counts& notes) {
  Trajectory poses;
  std::size_t skipped = 0;
  for_each_line(file, "is the dataset complete?", [&](std::size_t, std::string_view line) {
    const auto n = numbers_of(line);
    const bool has_pose = n && n->size() >= 8;
    const Eigen::Quaterniond rotation =
        has_pose ? Eigen::Quaterniond((*n)[4], (*n)[5], (*n)[6], (*n)[7]) : Eigen::Quaterniond::Identity();
    const double time = has_pose ? n->front() * kNanosecond : 0.0;
    const bool is_later = poses.empty() || time > poses.back().timestamp;
    if (has_pose && std::isfinite(time) && is_later && std::abs(rotation.norm() - 1.0) < 0.1 &&
        Eigen::Vector3d((*n)[1], (*n)[2], (*n)[3]).allFinite()) {
      poses.push_back({time, SE3(rotation, Eigen::Vector3d((*n)[1], (*n)[2], (*n)[3]))});
    } else {
      ++skipped;
    }
  });
  count(notes, "line of the ground truth that is no pose, skipped", skipped);
  return poses;
}

void add_right_camera(const Path& sensors, const Sensor& left, FolderListing& listing) {
  if (!is_present(sensors / "cam1" / "data.csv") || !is_present(sensors / "cam1" / "sensor.yaml")) return;
  const Sensor right = read_sensor(sensors / "cam1", std::nullopt);
  Counts skipped;  // right images are not frames
  const auto files =
      ordered_entries("cam1/data.csv", "right image", read_images(sensors / "cam1"), listing.notes, skipped);
  std::vector<TimedFile> times;
  for (const auto& frame : listing.frames) times.push_back({frame.timestamp, {}, 0});
  const auto pairs = associate_by_time(times, files, kStereoDifference);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i] >= 0) listing.frames[i].right = files[static_cast<std::size_t>(pairs[i])].file;
  }
  listing.right = {right.camera, left.T_body_sensor.inverse() * right.T_body_sensor};
}

void add_inertial(const Path& folder, const Sensor& left, FolderListing& listing) {
  if (!is_present(folder / "data.csv") || !is_present(folder / "sensor.yaml")) return;
  listing.inertial = read_inertial_table(folder / "data.csv", kNanosecond, listing.notes);
  if (listing.inertial.empty() || listing.camera.imu) return;
  listing.camera.imu = read_asl_unit(open_sensor(folder), left.T_body_sensor.inverse());
}
}  // namespace

bool is_euroc(const Path& folder) { return is_present(sensors_of(folder) / "cam0" / "data.csv"); }

FolderListing list_euroc(const Path& folder, const GivenCamera& camera) {
  const Path sensors = sensors_of(folder);
  const Sensor left = read_sensor(sensors / "cam0", camera);
  FolderListing listing{folder.string(), left.camera, {}};
  for (const TimedFile& entry : ordered_entries(
           "cam0/data.csv", "colour image", read_images(sensors / "cam0"), listing.notes, listing.skipped))
    listing.frames.push_back({entry.timestamp, entry.segment, entry.file, {}, {}, std::nullopt});
  if (listing.frames.back().segment > 0)
    throw InputError(folder.string() + ": the clock restarts in cam0/data.csv; split the recording there");
  add_right_camera(sensors, left, listing);
  add_inertial(sensors / "imu0", left, listing);
  const Path truth_file = sensors / "state_groundtruth_estimate0" / "data.csv";
  if (!is_present(truth_file)) return listing;
  const Trajectory truth = read_body_poses(truth_file, listing.notes);
  for (auto& frame : listing.frames) {
    if (const auto body = true_pose_at(truth, frame.timestamp))
      frame.T_world_camera = *body * left.T_body_sensor;
  }
  return listing;
}

}  // namespace roslam::datasets
