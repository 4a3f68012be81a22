// SPDX-License-Identifier: BSD-3-Clause
// Camera files of other programs: what is read from them, and what is refused.
#include "roslam/geometry/camera_import.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/core/persistence.hpp>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/geometry/camera_export.hpp"
#include "tests/camera_files.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

using Numbers = std::vector<double>;

class CameraImport : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  std::string put(const std::string& text, const std::string& name = "camera.yaml") const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  static void expect(const Camera& camera, int width, int height, const Numbers& intrinsics,
                     const char* model, const Numbers& coefficients) {
    EXPECT_EQ(camera.width, width);
    EXPECT_EQ(camera.height, height);
    EXPECT_EQ((Numbers{camera.fx, camera.fy, camera.cx, camera.cy}), intrinsics);
    EXPECT_EQ(lens_model_name(camera.model), model);
    EXPECT_EQ(camera.coefficients(), coefficients);
  }

  // The unit whose pose kCameraOfUnit gives.
  static void expect_unit(const Camera& camera) {
    ASSERT_TRUE(camera.imu);
    const Eigen::Vector3d ahead = camera.imu->T_camera_imu * Eigen::Vector3d(2.0, 0.0, 0.0);
    EXPECT_LT((ahead - Eigen::Vector3d(0.0, 0.0, 2.1)).norm(), 1e-12);
    const Eigen::Vector3d left = camera.imu->T_camera_imu * Eigen::Vector3d(0.0, 1.0, 0.0);
    EXPECT_LT((left - Eigen::Vector3d(-1.0, 0.0, 0.1)).norm(), 1e-12);
  }

  // The message has one line and these words.
  void expect_refused(const std::string& text, const std::vector<std::string>& words,
                      const std::string& choice = {}) const {
    const std::string file = put(text);
    try {
      import_camera(file + choice);
      ADD_FAILURE() << "accepted:\n" << text;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      EXPECT_EQ(message.find(file), 0U) << message;
      for (const std::string& word : words)
        EXPECT_NE(message.find(word), std::string::npos) << word << ": " << message;
    }
  }

  static std::string with(std::string text, const std::string& old, const std::string& now) {
    const std::size_t at = text.find(old);
    EXPECT_NE(at, std::string::npos) << old;
    return at == std::string::npos ? text : text.replace(at, old.size(), now);
  }

  const fs::path folder_ = scratch_path();
};

TEST_F(CameraImport, Kalibr) {
  const std::string file = put(kKalibr);
  const ImportedCamera first = import_camera(file);
  EXPECT_EQ(first.format, "a Kalibr camera chain");
  expect(first.camera, 752, 480, {458.5, 457.25, 367.5, 248.75}, "pinhole",
         {-0.28, 0.07, 0.0002, 1.8e-05, 0});
  EXPECT_EQ(first.camera.depth_units_per_metre, 0.0);
  EXPECT_FALSE(first.camera.imu);
  EXPECT_EQ(load_camera(file + "#cam0"), first.camera);
  EXPECT_EQ(read_camera(file), first.camera);
  const Camera second = load_camera(file + "#cam1");
  expect(second, 512, 512, {190.5, 190.25, 254.5, 256.75}, "fisheye", {0.0034, 0.0007, -0.002, 0.0002});
  const Camera none = load_camera(
      put(with(with(kKalibr, "radtan", "none"), "[-0.28, 0.07, 0.0002, 1.8e-05]", "[]"), "none.yaml"));
  EXPECT_FALSE(none.has_distortion());
}

TEST_F(CameraImport, KalibrWithInertialUnit) {
  const ImportedCamera imported = import_camera(put("cam0:\n" + kCameraOfUnit + kCamera));
  expect_unit(imported.camera);
  EXPECT_EQ(imported.camera.imu->gyroscope_noise, ImuCalibration{}.gyroscope_noise);
  std::string notes;
  for (const auto& note : imported.notes) notes += note + "\n";
  EXPECT_NE(notes.find("timeshift_cam_imu (0.0045"), std::string::npos) << notes;
}

TEST_F(CameraImport, RosCameraInfo) {
  const ImportedCamera imported = import_camera(put(kRos));
  EXPECT_EQ(imported.format, "a ROS camera_info");
  expect(imported.camera, 640, 480, {520.5, 521.5, 319.25, 241.75}, "pinhole",
         {0.25, -0.75, -0.003, 0.002, 0.9});
  const std::string five = "cols: 5\n  data: [0.25, -0.75, -0.003, 0.002, 0.9]";
  const std::string rational =
      with(with(kRos, "plumb_bob", "rational_polynomial"), five,
           "cols: 8\n  data: [0.45, -2.5, 0.0005, -0.0003, 1.5, 0.325, -2.25, 1.375]");
  EXPECT_EQ(load_camera(put(rational)).coefficients(),
            (Numbers{0.45, -2.5, 0.0005, -0.0003, 1.5, 0.325, -2.25, 1.375}));
  const std::string fisheye =
      with(with(kRos, "plumb_bob", "equidistant"), five, "cols: 4\n  data: [0.01, -0.02, 0.03, -0.01]");
  EXPECT_EQ(load_camera(put(fisheye)).model, LensModel::kFisheye);
}

TEST_F(CameraImport, RosMessageAsPrinted) {
  // ros2 topic echo camera_info
  const Camera camera = load_camera(put(R"(header:
  stamp: {sec: 1, nanosec: 2}
  frame_id: camera
height: 480
width: 640
distortion_model: plumb_bob
d:
- 0.25
- -0.75
- -0.003
- 0.002
- 0.9
k: [520.5, 0.0, 319.25, 0.0, 521.5, 241.75, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
)"));
  expect(camera, 640, 480, {520.5, 521.5, 319.25, 241.75}, "pinhole", {0.25, -0.75, -0.003, 0.002, 0.9});
}

TEST_F(CameraImport, AslSensor) {
  const std::string file = put(kAsl, "mav0/cam0/sensor.yaml");
  const ImportedCamera alone = import_camera(file);
  EXPECT_EQ(alone.format, "an ASL (EuRoC) sensor.yaml");
  expect(alone.camera, 752, 480, {458.5, 457.25, 367.5, 248.75}, "pinhole",
         {-0.28, 0.07, 0.0002, 1.8e-05, 0});
  EXPECT_EQ(alone.camera.fps, 20.0);
  expect_unit(alone.camera);
  EXPECT_EQ(alone.camera.T_body_camera, forward_camera()) << "the body of the data set is the inertial unit";
  // The unit's own file, 0.05 m to the left of the body's origin.
  put("sensor_type: imu\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.05, 0.0, "
      "0.0, "
      "1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\nrate_hz: 200\ngyroscope_noise_density: 1.7e-04\n"
      "gyroscope_random_walk: 1.9e-05\n",
      "mav0/imu0/sensor.yaml");
  const Camera camera = load_camera(file);
  EXPECT_EQ(camera.imu->gyroscope_noise, 1.7e-4);
  EXPECT_EQ(camera.imu->gyroscope_walk, 1.9e-5);
  const Eigen::Vector3d origin = camera.imu->T_camera_imu.translation();
  EXPECT_LT((origin - Eigen::Vector3d(-0.05, 0.0, 0.1)).norm(), 1e-12);
}

TEST_F(CameraImport, OpenCvYamlAndXml) {
  const ImportedCamera imported = import_camera(put(kOpenCv));
  EXPECT_EQ(imported.format, "an OpenCV calibration");
  expect(imported.camera, 1280, 720, {605.5, 604.5, 639.25, 365.75}, "pinhole",
         {0.45, -2.5, 0.00056, -0.00033, 1.5, 0.325, -2.25, 1.375});
  const ImportedCamera xml = import_camera(put(kOpenCvXml, "camera.xml"));
  EXPECT_EQ(xml.format, "an OpenCV calibration");
  expect(xml.camera, 640, 480, {520.5, 521.5, 319.25, 241.75}, "pinhole", {0.25, -0.75, -0.003, 0.002, 0.9});
}

TEST_F(CameraImport, WhatOpenCvWrites) {
  // Its own writer, in both formats, as the calibration of a fisheye camera.
  for (const char* name : {"written.yml", "written.xml"}) {
    const std::string file = (folder_ / name).string();
    {
      cv::FileStorage storage(file, cv::FileStorage::WRITE);
      storage << "image_width" << 512 << "image_height" << 500 << "fisheye_model" << 1 << "camera_matrix"
              << cv::Mat(cv::Matx33d(190.5, 0, 254.5, 0, 190.25, 256.75, 0, 0, 1))
              << "distortion_coefficients" << cv::Mat(cv::Vec4d(0.0034, 0.0007, -0.002, 0.0002))
              << "image_points" << cv::Mat(cv::Mat::ones(3, 7, CV_32FC2));
    }
    expect(load_camera(file), 512, 500, {190.5, 190.25, 254.5, 256.75}, "fisheye",
           {0.0034, 0.0007, -0.002, 0.0002});
  }
}

TEST_F(CameraImport, OpenCvStereoNeedsASize) {
  const std::string file = put(kStereo);
  expect_refused(kStereo, {"OpenCV calibration", "size of the images", "--size"});
  const std::array<int, 2> size{640, 480};
  expect(import_camera(file, size).camera, 640, 480, {500, 501, 320, 240}, "pinhole", {0.1, 0, 0, 0, 0});
  expect(import_camera(file + "#cam1", size).camera, 640, 480, {510, 511, 322, 242}, "pinhole",
         {-0.1, 0, 0, 0, 0});
  EXPECT_THROW(import_camera(file + "#cam2", size), InputError);
  EXPECT_THROW(import_camera(put(kRos), std::array{1280, 720}), InputError) << "it is of another size";
  EXPECT_EQ(import_camera(put(kRos), size).camera.width, 640);
  EXPECT_THROW(import_camera("d455", std::array{1280, 720}), InputError);
}

TEST_F(CameraImport, OrbSlam) {
  const ImportedCamera old = import_camera(put(kOrbSlam2));
  EXPECT_EQ(old.format, "ORB-SLAM settings");
  expect(old.camera, 640, 480, {517.5, 516.5, 318.5, 255.25}, "pinhole",
         {0.25, -0.95, -0.005, 0.0025, 1.125});
  EXPECT_EQ(old.camera.fps, 25.0);
  EXPECT_EQ(old.camera.depth_units_per_metre, 5000.0);
  const std::string file = put(kOrbSlam3);
  const Camera camera = load_camera(file);
  expect(camera, 512, 512, {190.5, 190.25, 254.5, 256.75}, "fisheye", {0.0034, 0.0007, -0.002, 0.0002});
  EXPECT_EQ(camera.depth_units_per_metre, 1000.0);
  EXPECT_EQ(camera.fps, 20.0);
  expect_unit(camera);
  EXPECT_EQ(camera.imu->gyroscope_noise, 0.00016);
  EXPECT_EQ(camera.imu->gyroscope_walk, 0.000022);
  expect(load_camera(file + "#cam1"), 512, 512, {191.5, 191.25, 255.5, 255.75}, "fisheye",
         {0.0035, 0.0008, -0.003, 0.0003});
  const std::string without_size =
      with(with(kOrbSlam2, "Camera.width: 640\n", ""), "Camera.height: 480\n", "");
  expect_refused(without_size, {"ORB-SLAM settings", "--size"});
  EXPECT_EQ(import_camera(put(without_size), std::array{640, 480}).camera, old.camera);
}

TEST_F(CameraImport, NamesFileFormatAndWhatIsMissing) {
  expect_refused(with(kKalibr, "  intrinsics: [458.5, 457.25, 367.5, 248.75]\n", ""),
                 {"Kalibr", "cam0", "'intrinsics'"});
  expect_refused(with(kKalibr, "[458.5, 457.25, 367.5, 248.75]", "[458.5, 457.25]"),
                 {"Kalibr", "'intrinsics'", "4"});
  expect_refused(with(kKalibr, "[458.5, 457.25", "[458.5, wide"), {"Kalibr", "'intrinsics'"});
  expect_refused(with(kKalibr, "camera_model: pinhole", "camera_model: omni"),
                 {"Kalibr", "omni", "pinhole-equi"});
  expect_refused(with(kKalibr, "radtan", "fov"), {"Kalibr", "'fov'", "equidistant"});
  expect_refused(with(kKalibr, "[752, 480]", "[752]"), {"'resolution'"});
  expect_refused(with(kKalibr, "[752, 480]", "[-752, 480]"), {"'resolution'"});
  expect_refused(with(kKalibr, "[752, 480]", "[1e300, 480]"), {"'resolution'"});
  expect_refused(kKalibr, {"Kalibr", "no cam2", "cam0 cam1"}, "#cam2");
  expect_refused(kKalibr, {"'left'", "#cam0"}, "#left");
  expect_refused("cam0:\n" + with(kCameraOfUnit, "[0.0, -1.0", "[0.0, -2.0") + kCamera,
                 {"Kalibr", "'T_cam_imu'"});
  expect_refused(with(kRos, "image_width: 640\n", ""), {"ROS camera_info", "size of the images"});
  expect_refused(with(kRos, "plumb_bob", "ftheta"), {"ROS camera_info", "'ftheta'"});
  expect_refused(with(kRos, "520.5, 0.0", "520.5, 3.0"), {"ROS camera_info", "skew"});
  expect_refused(with(kRos, "520.5", "-520.5"), {"ROS camera_info", "fx must be positive"});
  expect_refused(with(kRos, "521.5", "-521.5"), {"ROS camera_info", "upside down"});
  expect_refused(with(kRos, "camera_matrix:", "other_matrix:"), {"ROS camera_info", "'camera_matrix'"});
  expect_refused(kRos, {"one camera"}, "#cam1");
  expect_refused(with(kRos, "640", "640.5"), {"'image_width'"});
  expect_refused(with(kAsl, "sensor_type: camera", "sensor_type: imu"), {"ASL", "imu", "cam0/sensor.yaml"});
  expect_refused(with(kAsl, "intrinsics", "extrinsics"), {"ASL", "'intrinsics'"});
  expect_refused(with(kOpenCv, "1.375 ]", "1.375, 0.1, 0., 0., 0. ]"), {"OpenCV", "thin prism"});
  expect_refused(with(kOpenCv, "0., 604.5", "0., .Nan"), {"OpenCV", "'camera_matrix'"});
  expect_refused(with(kOrbSlam2, "Camera.fy: 516.5\n", ""), {"ORB-SLAM", "'Camera.fy'"});
  expect_refused(with(kOrbSlam2, "25.0", "fast"), {"ORB-SLAM", "'Camera.fps'"});
  expect_refused(with(kOrbSlam2, "5000.0", "-1"), {"ORB-SLAM", "depth_units_per_metre"});
  expect_refused(with(kOrbSlam3, "KannalaBrandt8", "Mei"), {"ORB-SLAM", "'Mei'"});
  expect_refused(with(kOpenCvXml, "</opencv_storage>", ""), {"XML"});
  expect_refused(with(kOpenCvXml, "</rows>", "</row>"), {"XML"});
  expect_refused("<?xml version=\"1.0\"?>\n<plist></plist>\n", {"XML"});
  expect_refused("<?xml", {"XML"});
  std::string deep = "<?xml version=\"1.0\"?><opencv_storage>";
  for (int i = 0; i < 5000; ++i) deep += "<a>";
  expect_refused(deep, {"XML"});
  expect_refused(std::string(2U << 20U, ' '), {"larger than a camera file"});
}

TEST_F(CameraImport, TruncatedFilesGiveAnErrorOrACamera) {
  int refused = 0, all = 0;
  for (const std::string& text : {kKalibr, kRos, kAsl, kOpenCv, kOpenCvXml, kStereo, kOrbSlam2, kOrbSlam3}) {
    for (std::size_t length = 0; length < text.size(); length += 7) {
      ++all;
      try {
        import_camera(put(text.substr(0, length))).camera.validate();
      } catch (const Error&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, all / 2);
}

TEST_F(CameraImport, WhatIsWrittenReadsBack) {
  std::vector<Camera> cameras;
  for (const auto& name : camera_preset_names()) cameras.push_back(*camera_preset(name));
  for (const std::string& text : {kKalibr, kAsl, kOpenCv, kOrbSlam2, kOrbSlam3})
    cameras.push_back(load_camera(put(text)));
  cameras.push_back(load_camera(put(kKalibr) + "#cam1"));
  for (const Camera& camera : cameras) {
    const Camera own = load_camera(put(camera_to_yaml(camera)));
    EXPECT_EQ(own.depth_units_per_metre, camera.depth_units_per_metre) << "also where it is not set";
    EXPECT_EQ(own.fps, camera.fps);
    EXPECT_EQ(own.imu.has_value(), camera.imu.has_value());
    const Camera ros = load_camera(put(camera_to_ros(camera)));
    const Camera opencv = load_camera(put(camera_to_opencv(camera)));
    for (const Camera& read : {own, ros, opencv}) {
      expect(read, camera.width, camera.height, {camera.fx, camera.fy, camera.cx, camera.cy},
             std::string(lens_model_name(camera.model)).c_str(), camera.coefficients());
    }
    const bool fits = camera.distortion[4] == 0.0 && camera.coefficients().size() < 8;
    if (!fits) {
      EXPECT_THROW(camera_to_kalibr(camera), InputError);
      continue;
    }
    const Camera kalibr = load_camera(put(camera_to_kalibr(camera)));
    expect(kalibr, camera.width, camera.height, {camera.fx, camera.fy, camera.cx, camera.cy},
           std::string(lens_model_name(camera.model)).c_str(), camera.coefficients());
    ASSERT_EQ(kalibr.imu.has_value(), camera.imu.has_value());
    if (camera.imu) {
      const SE3 difference = kalibr.imu->T_camera_imu.inverse() * camera.imu->T_camera_imu;
      EXPECT_LT(difference.log().norm(), 1e-11);
    }
  }
}

TEST_F(CameraImport, OpenCvReadsWhatIsWrittenForIt) {
  const Camera camera = load_camera(put(kOpenCv));
  const cv::FileStorage storage(put(camera_to_opencv(camera)), cv::FileStorage::READ);
  ASSERT_TRUE(storage.isOpened());
  cv::Mat K, D;
  storage["camera_matrix"] >> K;
  storage["distortion_coefficients"] >> D;
  ASSERT_EQ(K.type(), CV_64FC1);
  ASSERT_EQ(K.size(), cv::Size(3, 3));
  ASSERT_EQ(D.total(), 8U);
  EXPECT_EQ(K.at<double>(0, 0), camera.fx);
  EXPECT_EQ(K.at<double>(1, 2), camera.cy);
  EXPECT_EQ(D.at<double>(7), camera.distortion[7]);
  EXPECT_EQ(static_cast<int>(storage["image_width"]), 1280);
}

TEST_F(CameraImport, OwnFilesTakeBothModels) {
  const std::string own =
      "width: 640\nheight: 480\nfx: 300\nfy: 301\ncx: 320\ncy: 240\ndepth_units_per_metre: 1000\n";
  const ImportedCamera fisheye =
      import_camera(put(own + "model: fisheye\ndistortion: [0.01, 0.02, 0.03, 0.04]\n"));
  EXPECT_EQ(fisheye.format, "a camera file of RO-SLAM");
  expect(fisheye.camera, 640, 480, {300, 301, 320, 240}, "fisheye", {0.01, 0.02, 0.03, 0.04});
  const Camera rational = load_camera(put(own + "distortion: [0.1, 0.01, 0, 0, 0.001, 0.1, 0.02, 0.003]\n"));
  expect(rational, 640, 480, {300, 301, 320, 240}, "pinhole", {0.1, 0.01, 0, 0, 0.001, 0.1, 0.02, 0.003});
  expect_refused(own + "model: omnidirectional\n", {"'omnidirectional'", "pinhole or fisheye"});
  expect_refused(own + "model: fisheye\ndistortion: [0.1, 0.2]\n",
                 {"distortion has 2 values", "k1 k2 k3 k4"});
  expect_refused(own + "model: fisheye\n", {"distortion has 0 values"});
  expect_refused(own + "distortion: [1, 2, 3, 4, 5, 6]\n", {"distortion has 6 values"});
  EXPECT_EQ(load_camera(put(with(own, "1000", "none"))).depth_units_per_metre, 0.0);
}

TEST_F(CameraImport, RealSensorFile) {
  const fs::path file = fs::path(ROSLAM_TEST_DATA) / "slam/euroc_mh01/mav0/cam1/sensor.yaml";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not here";
  const Camera camera = load_camera(file.string());
  expect(camera, 752, 480, {457.587, 456.134, 379.999, 255.238}, "pinhole",
         {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05, 0});
  ASSERT_TRUE(camera.imu);
  EXPECT_EQ(camera.imu->gyroscope_noise, 1.6968e-4);
  const Eigen::Vector3d camera_in_unit = camera.imu->T_camera_imu.inverse().translation();
  EXPECT_LT((camera_in_unit - Eigen::Vector3d(-0.0198435579556, 0.0453689425024, 0.00786212447038)).norm(),
            1e-6);
}

}  // namespace
}  // namespace roslam
