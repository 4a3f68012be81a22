// SPDX-License-Identifier: BSD-3-Clause
#include "recording/mcap_export.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "recording/display_messages.hpp"
#include "recording/removal_record.hpp"
#include "roslam/common/error.hpp"
#include "roslam/sensors/image_file.hpp"

namespace roslam::recording {

namespace {
namespace fs = std::filesystem;

constexpr const char* kTruthFrame = "ground_truth";

const TopicDescription kFixedTransforms{"/tf_static", "tf2_msgs/msg/TFMessage", true};
const TopicDescription kTransforms{"/tf", "tf2_msgs/msg/TFMessage"};
const TopicDescription kOdometry{"/odometry", "nav_msgs/msg/Odometry"};
const TopicDescription kCameraPose{"/camera_pose", "geometry_msgs/msg/PoseStamped"};
const TopicDescription kPath{"/path", "nav_msgs/msg/Path", true};
const TopicDescription kTruth{"/ground_truth/path", "nav_msgs/msg/Path", true};
const TopicDescription kLandmarks{"/map/landmarks", "sensor_msgs/msg/PointCloud2", true};
const TopicDescription kDense{"/map/dense", "sensor_msgs/msg/PointCloud2", true};
const TopicDescription kImage{"/camera/image/compressed", "sensor_msgs/msg/CompressedImage"};
const TopicDescription kRemoved{"/camera/removed/compressed", "sensor_msgs/msg/CompressedImage"};
const TopicDescription kCameraInfo{"/camera/camera_info", "sensor_msgs/msg/CameraInfo"};

RosMessage encode_jpeg(const RosHeader& header, const cv::Mat& image, int quality) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return encode_compressed_image(header, "jpeg", bytes);
}

// The removed objects in red, half transparent.
cv::Mat tinted(const cv::Mat& image, const cv::Mat& objects) {
  cv::Mat result = image.clone();
  cv::Mat red(image.size(), CV_8UC3, cv::Scalar(40, 40, 255));
  cv::addWeighted(image, 0.5, red, 0.5, 0.0, red);
  red.copyTo(result, objects != 0);
  return result;
}

// At most as many poses, the last one among them.
std::vector<StampedPose> thinned(std::span<const StampedPose> poses, std::size_t most) {
  if (poses.size() <= most) return {poses.begin(), poses.end()};
  std::vector<StampedPose> result;
  for (std::size_t k = 0; k + 1 < most; ++k) result.push_back(poses[k * poses.size() / most]);
  result.push_back(poses.back());
  return result;
}
}  // namespace

void McapExportOptions::validate() const {
  if (jpeg_quality < 1 || jpeg_quality > 100)
    throw OptionsError("jpeg_quality: has to be from 1 to 100, not " + std::to_string(jpeg_quality));
}

McapExport::McapExport(const fs::path& file, RunContents run, const McapExportOptions& options)
    : run_(std::move(run)), options_(options), poses_(poses_of_frames(run_)), file_(file) {
  options_.validate();
  // The path grows while it is played. So many messages take less room than the images.
  constexpr std::int64_t kMessages = 100, kSecond = 1'000'000'000;
  if (!poses_.empty())
    path_interval_ = std::max(kSecond, (poses_.back().stamp - poses_.front().stamp) / kMessages);
}

void McapExport::write_truth(std::int64_t stamp, std::vector<RosTransform>& fixed) {
  if (run_.truth.empty()) return;
  if (const auto T_map_truth = place_of_truth(run_)) {
    fixed.push_back({{stamp, kMapFrame}, kTruthFrame, *T_map_truth});
  } else {
    ++left_out_["ground truth is not placed in the map: no pose of the run is of its time"];
  }
  file_.write(kTruth, stamp, encode_path(stamp, kTruthFrame, run_.truth));
}

// What does not change.
void McapExport::begin(std::int64_t stamp) {
  if (std::exchange(has_begun_, true)) return;
  if (!poses_.empty()) stamp = std::min(stamp, poses_.front().stamp);
  std::vector<RosTransform> fixed{{{stamp, kBodyFrame}, kCameraFrame, run_.source.camera.T_body_camera}};
  write_truth(stamp, fixed);
  file_.write(kFixedTransforms, stamp, encode_transforms(fixed));
  const auto write_points = [&](const TopicDescription& topic, std::vector<ColouredPoint>& points) {
    if (!points.empty()) file_.write(topic, stamp, encode_points({stamp, kMapFrame}, points));
    points = {};
  };
  write_points(kLandmarks, run_.landmarks);
  write_points(kDense, run_.dense);
}

void McapExport::write_path(std::int64_t stamp) {
  ++path_length_;
  const bool is_last = path_length_ == run_.trajectory.size();
  if (path_stamp_ && stamp - *path_stamp_ < path_interval_ && !is_last) return;
  path_stamp_ = stamp;
  constexpr std::size_t kMostPoses = 1000;  // of all messages but the last
  const std::span<const StampedPose> so_far(run_.trajectory.data(), path_length_);
  file_.write(kPath, stamp,
              encode_path(stamp, kMapFrame, is_last ? run_.trajectory : thinned(so_far, kMostPoses)));
}

void McapExport::write_poses(const FramePoses& poses) {
  std::vector<RosTransform> transforms;
  if (poses.T_map_odom) transforms.push_back({{poses.stamp, kMapFrame}, kOdomFrame, *poses.T_map_odom});
  transforms.push_back({{poses.stamp, kOdomFrame}, kBodyFrame, poses.T_odom_body});
  file_.write(kTransforms, poses.stamp, encode_transforms(transforms));
  if (poses.odometry) file_.write(kOdometry, poses.stamp, encode_odometry(run_.odometry[*poses.odometry]));
  if (!poses.T_map_camera) return;
  const RosTransform camera{{poses.stamp, kMapFrame}, kCameraFrame, *poses.T_map_camera};
  file_.write(kCameraPose, poses.stamp, encode_pose(camera));
  write_path(poses.stamp);
}

void McapExport::write_removed(const RosHeader& header, const Frame& frame) {
  if (run_.masks.empty()) return;
  const fs::path mask = run_.masks.parent_path() / mask_name(frame.timestamp);
  cv::Mat image = frame.colour;
  std::error_code error;
  if (fs::exists(mask, error)) {  // else no objects were removed
    const cv::Mat objects = read_label_image(mask).image;
    if (objects.size() == image.size()) {
      image = tinted(image, objects);
    } else {
      ++left_out_["mask cannot be read or is not of the size of its image"];
    }
  }
  file_.write(kRemoved, header.stamp, encode_jpeg(header, image, options_.jpeg_quality));
}

void McapExport::add(const Frame& frame) {
  const Camera& camera = run_.source.camera;
  if (frame.colour.size() != cv::Size(camera.width, camera.height))
    throw InputError(run_.source.name +
                     ": its images are not of the size of the run's camera; was it changed since the run?");
  const RosHeader header{ros_stamp(frame.timestamp), kCameraFrame};
  begin(header.stamp);
  while (next_ < poses_.size() && poses_[next_].stamp <= header.stamp) write_poses(poses_[next_++]);
  file_.write(kImage, header.stamp, encode_jpeg(header, frame.colour, options_.jpeg_quality));
  write_removed(header, frame);
  file_.write(kCameraInfo, header.stamp, encode_camera_info(header, camera));
}

void McapExport::finish() {
  begin(poses_.empty() ? 0 : poses_.front().stamp);
  while (next_ < poses_.size()) write_poses(poses_[next_++]);
  file_.finish();
}

}  // namespace roslam::recording
