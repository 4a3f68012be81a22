// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cameras/realsense_camera.hpp"

#include <algorithm>
#include <cmath>
#include <librealsense2/rs.hpp>
#include <tuple>

namespace roslam {

namespace {
// Calls the SDK; its errors mean that the device does not answer.
template <typename Call>
auto answer_of(const Call& call) {
  try {
    return call();
  } catch (const rs2::error& error) {
    throw CameraLost(std::string("RealSense: ") + error.what() + "; check the cable and the udev rules");
  }
}

SE3 transform_of(const rs2_extrinsics& extrinsics) {
  const Eigen::Matrix3f R = Eigen::Map<const Eigen::Matrix3f>(extrinsics.rotation);  // column by column
  return SE3(Eigen::Quaterniond(R.cast<double>()).normalized(),
             Eigen::Map<const Eigen::Vector3f>(extrinsics.translation).cast<double>());
}

// The SDK's projection applies the coefficients of the "inverse" model as those of Brown's.
Camera camera_of(const rs2_intrinsics& intrinsics) {
  Camera camera;
  std::tie(camera.width, camera.height) = std::tie(intrinsics.width, intrinsics.height);
  std::tie(camera.fx, camera.fy, camera.cx, camera.cy) =
      std::tie(intrinsics.fx, intrinsics.fy, intrinsics.ppx, intrinsics.ppy);
  const float* k = intrinsics.coeffs;
  const bool is_fisheye = intrinsics.model == RS2_DISTORTION_KANNALA_BRANDT4;
  if (intrinsics.model != RS2_DISTORTION_NONE)
    camera.set_lens(is_fisheye ? "fisheye" : "pinhole", std::vector<double>(k, k + (is_fisheye ? 4 : 5)));
  return camera;
}

// One clock for all streams, and a constant rate in the dark.
void prepare(const rs2::sensor& sensor) {
  for (const auto& [option, value] :
       {std::pair(RS2_OPTION_GLOBAL_TIME_ENABLED, 1.0F), std::pair(RS2_OPTION_ENABLE_AUTO_EXPOSURE, 1.0F),
        std::pair(RS2_OPTION_AUTO_EXPOSURE_PRIORITY, 0.0F), std::pair(RS2_OPTION_EMITTER_ENABLED, 1.0F)}) {
    try {
      if (sensor.supports(option) && !sensor.is_option_read_only(option)) sensor.set_option(option, value);
    } catch (const rs2::error&) {  // a setting that the camera refuses is no reason not to fly
    }
  }
}

std::string text_of(const rs2::device& device, rs2_camera_info info) {
  return device.supports(info) ? device.get_info(info) : "";
}

// Nanoseconds. A frame is stamped when it is read out; where the metadata tell, the middle of its exposure
// (microseconds).
std::int64_t stamp_of(const rs2::frame& frame) {
  const std::int64_t stamp = std::llround(frame.get_timestamp() * 1e6);
  const auto read_out = RS2_FRAME_METADATA_FRAME_TIMESTAMP, middle = RS2_FRAME_METADATA_SENSOR_TIMESTAMP;
  if (!frame.supports_frame_metadata(read_out) || !frame.supports_frame_metadata(middle)) return stamp;
  const auto later = frame.get_frame_metadata(read_out) - frame.get_frame_metadata(middle);
  return later > 0 && later < 100000 ? stamp - 1000 * later : stamp;
}

CameraSample sample_of(const rs2::frame& frame) {
  CameraSample sample;
  sample.stamp = stamp_of(frame);
  sample.clock = rs2_timestamp_domain_to_string(frame.get_frame_timestamp_domain());
  sample.number = frame.get_frame_number();
  const rs2_stream stream = frame.get_profile().stream_type();
  if (const auto motion = frame.as<rs2::motion_frame>()) {
    const rs2_vector data = motion.get_motion_data();
    sample.stream = stream == RS2_STREAM_GYRO ? CameraStream::kGyroscope : CameraStream::kAccelerometer;
    sample.vector = {data.x, data.y, data.z};
    return sample;
  }
  const rs2::video_frame image(frame);
  const bool is_depth = stream == RS2_STREAM_DEPTH;
  sample.stream = is_depth ? CameraStream::kDepth : CameraStream::kColour;
  const cv::Mat pixels(image.get_height(), image.get_width(), is_depth ? CV_16UC1 : CV_8UC3,
                       const_cast<void*>(image.get_data()),
                       static_cast<std::size_t>(image.get_stride_in_bytes()));
  sample.pixels = pixels.clone();  // as the SDK uses the memory again
  return sample;
}

class RealsenseCamera : public DepthCamera {
 public:
  ~RealsenseCamera() override { close(); }
  std::string kind() const override { return "realsense"; }

  std::vector<DepthCameraDevice> devices() override {
    std::vector<DepthCameraDevice> found;
    for (const rs2::device& one : answer_of([&] { return context_.query_devices(); })) {
      try {
        found.push_back({text_of(one, RS2_CAMERA_INFO_NAME), text_of(one, RS2_CAMERA_INFO_SERIAL_NUMBER),
                         text_of(one, RS2_CAMERA_INFO_FIRMWARE_VERSION),
                         text_of(one, RS2_CAMERA_INFO_USB_TYPE_DESCRIPTOR)});
      } catch (const rs2::error&) {  // one that is starting or broken
      }
    }
    return found;
  }

  void open(const std::string& serial, const DepthCameraMode& mode) override {
    answer_of([&] {
      pipeline_ = rs2::pipeline(context_);
      rs2::config config = config_of(serial, mode, true);
      has_inertial_ = !avoids_inertial_ && config.can_resolve(*pipeline_);
      if (!has_inertial_) config = config_of(serial, mode, false);
      if (!config.can_resolve(*pipeline_))
        throw InputError("realsense:" + serial + ": has no images of " + in_words(mode));
      for (const auto& one : config.resolve(*pipeline_).get_device().query_sensors()) prepare(one);
      queue_ = rs2::frame_queue(64);  // of all streams
      profile_ = pipeline_->start(config, queue_);
      serial_ = serial;
      has_frames_ = false;
    });
  }

  DepthCameraCalibration calibration() const override {
    return answer_of([&] {
      const auto colour = profile_.get_stream(RS2_STREAM_COLOR).as<rs2::video_stream_profile>();
      const auto depth = profile_.get_stream(RS2_STREAM_DEPTH).as<rs2::video_stream_profile>();
      DepthCameraCalibration calibration;
      calibration.colour = camera_of(colour.get_intrinsics());
      calibration.depth = camera_of(depth.get_intrinsics());
      calibration.T_colour_depth = transform_of(depth.get_extrinsics_to(colour));
      calibration.colour.depth_units_per_metre =
          1.0 / profile_.get_device().first<rs2::depth_sensor>().get_depth_scale();
      if (has_inertial_)
        calibration.colour.imu.emplace().T_camera_imu =
            transform_of(profile_.get_stream(RS2_STREAM_GYRO).get_extrinsics_to(colour));
      return calibration;
    });
  }

  std::vector<CameraSample> wait(std::chrono::milliseconds at_most) override {
    return answer_of([&] {
      std::vector<CameraSample> samples;
      rs2::frame frame;
      if (!queue_.try_wait_for_frame(&frame, static_cast<unsigned>(at_most.count()))) {
        if (std::ranges::none_of(devices(), [&](const auto& one) { return one.serial == serial_; }))
          throw CameraLost("RealSense: it was unplugged");
        return samples;
      }
      has_frames_ = true;
      do {
        const auto set = frame.as<rs2::frameset>();
        if (!set) samples.push_back(sample_of(frame));
        for (std::size_t i = 0; set && i < set.size(); ++i) samples.push_back(sample_of(set[i]));
      } while (queue_.poll_for_frame(&frame));
      return samples;
    });
  }

  void reset(const std::string& serial) override {
    answer_of([&] {
      for (rs2::device device : context_.query_devices())
        if (text_of(device, RS2_CAMERA_INFO_SERIAL_NUMBER) == serial) device.hardware_reset();
    });
  }

  void close() noexcept override {
    try {
      if (pipeline_) pipeline_->stop();
    } catch (const rs2::error&) {  // it was not started, or is gone
    }
    // An inertial unit that gives nothing keeps the images back: it is left out next time.
    avoids_inertial_ |= pipeline_ && has_inertial_ && !has_frames_;
    pipeline_.reset();
    profile_ = {};
  }

 private:
  static rs2::config config_of(const std::string& serial, const DepthCameraMode& mode, bool has_inertial) {
    rs2::config config;
    config.enable_device(serial);
    config.enable_stream(RS2_STREAM_COLOR, mode.width, mode.height, RS2_FORMAT_BGR8, mode.fps);
    config.enable_stream(RS2_STREAM_DEPTH, mode.width, mode.height, RS2_FORMAT_Z16, mode.fps);
    if (!has_inertial) return config;
    for (const rs2_stream stream : {RS2_STREAM_ACCEL, RS2_STREAM_GYRO})
      config.enable_stream(stream, RS2_FORMAT_MOTION_XYZ32F);  // at the rate that it has
    return config;
  }

  rs2::context context_;
  std::optional<rs2::pipeline> pipeline_;
  rs2::pipeline_profile profile_;
  rs2::frame_queue queue_;
  std::string serial_;
  bool has_inertial_ = false, avoids_inertial_ = false, has_frames_ = false;
};
}  // namespace

bool has_realsense() { return true; }
std::unique_ptr<DepthCamera> realsense_camera() { return answer_of(std::make_unique<RealsenseCamera>); }

}  // namespace roslam
