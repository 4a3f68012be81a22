// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/faulty_camera_source.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace roslam::simulation {

namespace {
constexpr std::array<std::pair<std::string_view, CameraFault>, 9> kFaults{
    {{"depth-too-large", CameraFault::kDepthTooLarge},
     {"depth-too-small", CameraFault::kDepthTooSmall},
     {"shifted-depth", CameraFault::kShiftedDepth},
     {"plain-depth", CameraFault::kPlainDepth},
     {"distorted", CameraFault::kDistorted},
     {"no-distortion", CameraFault::kNoDistortion},
     {"inverse-distortion", CameraFault::kInverseDistortion},
     {"late-depth", CameraFault::kLateDepth},
     {"early-depth", CameraFault::kEarlyDepth}}};

// The image of so many frames before; the first ones repeat.
cv::Mat delayed(std::deque<cv::Mat>& images, const cv::Mat& image, std::size_t frames) {
  images.push_back(image);
  if (images.size() > frames + 1) images.pop_front();
  return images.front();
}
}  // namespace

std::string_view name_of(CameraFault fault) {
  return std::find_if(kFaults.begin(), kFaults.end(), [&](const auto& kind) { return kind.second == fault; })
      ->first;
}

std::optional<CameraFault> camera_fault_from(std::string_view name) {
  for (const auto& [known, fault] : kFaults)
    if (known == name) return fault;
  return std::nullopt;
}

std::vector<std::string> camera_fault_names() {
  std::vector<std::string> names;
  for (const auto& kind : kFaults) names.emplace_back(kind.first);
  return names;
}

FaultyCameraSource::FaultyCameraSource(std::unique_ptr<FrameSource> source,
                                       const std::vector<CameraFault>& faults)
    : WrappedSource(*source), owned_(std::move(source)), camera_(owned_->camera()) {
  constexpr std::size_t kDelay = 2;
  for (const CameraFault fault : faults) {
    switch (fault) {
      case CameraFault::kDepthTooLarge:
        depth_factor_ *= 5.0;
        break;
      case CameraFault::kDepthTooSmall:
        depth_factor_ /= 5.0;
        break;
      case CameraFault::kShiftedDepth:
        set_depth_camera(1.0, 0.05);
        break;
      case CameraFault::kPlainDepth:
        set_depth_camera(390.0 / 613.0, 0.015);
        break;
      case CameraFault::kLateDepth:
        depth_delay_ = kDelay;
        break;
      case CameraFault::kEarlyDepth:
        colour_delay_ = kDelay;
        break;
      default:
        set_lens(fault);
    }
  }
  camera_.depth_units_per_metre /= depth_factor_;
}

void FaultyCameraSource::set_depth_camera(double focal_ratio, double beside) {
  Camera depth = source().camera();
  depth.fx *= focal_ratio;
  depth.fy *= focal_ratio;
  to_depth_camera_ = std::make_unique<DepthRegistration>(
      source().camera(), depth, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(beside, 0.0, 0.0)));
}

void FaultyCameraSource::set_lens(CameraFault fault) {
  if (!camera_.has_distortion()) {
    camera_.set_lens("pinhole", {-0.12, 0.03, 0.0005, -0.0003, 0.0});
    pixels_.create(camera_.height, camera_.width, CV_32FC2);
    for (int y = 0; y < pixels_.rows; ++y) {
      for (int x = 0; x < pixels_.cols; ++x) {
        const Eigen::Vector2f pixel = camera_.undistort({x, y}).cast<float>();
        pixels_.at<cv::Vec2f>(y, x) = {pixel.x(), pixel.y()};
      }
    }
  }
  if (fault == CameraFault::kNoDistortion) camera_.set_lens("pinhole", {});
  if (fault == CameraFault::kInverseDistortion)
    for (double& coefficient : camera_.distortion) coefficient = -coefficient;
}

std::optional<Frame> FaultyCameraSource::next() {
  std::optional<Frame> frame = source().next();
  if (!frame) return frame;
  if (!frame->depth.empty()) {
    if (to_depth_camera_) frame->depth = (*to_depth_camera_)(frame->depth);
    if (!pixels_.empty()) {
      cv::Mat depth;
      cv::remap(frame->depth, depth, pixels_, {}, cv::INTER_NEAREST);
      frame->depth = depth;
    }
    const cv::Mat scaled = frame->depth * depth_factor_;  // not in place, as the image is the source's
    frame->depth = delayed(depths_, scaled, depth_delay_);
  }
  if (!pixels_.empty()) {
    cv::Mat colour;
    cv::remap(frame->colour, colour, pixels_, {}, cv::INTER_LINEAR);
    frame->colour = colour;
  }
  frame->colour = delayed(colours_, frame->colour, colour_delay_);
  return frame;
}

}  // namespace roslam::simulation
