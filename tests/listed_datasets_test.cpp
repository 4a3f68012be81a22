// SPDX-License-Identifier: BSD-3-Clause
// Folders of RGB-D datasets whose images are listed: TUM RGB-D, ICL-NUIM, OpenLORIS.
#include "roslam/datasets/tum_source.hpp"
#include "tests/dataset_scene.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
constexpr int kFrames = 10;

class Listed : public DatasetFolder {
 protected:
  void SetUp() override {
    DatasetFolder::SetUp();
    for (const char* part : {"rgb", "depth"}) fs::create_directories(folder_ / part);
  }
  void write_images(int number, const PlaneImage& image, double units) const {
    write_colour(folder_ / ("rgb/" + std::to_string(number) + ".png"), image.colour);
    write_depth(folder_ / ("depth/" + std::to_string(number) + ".png"), image.depth, units);
  }
};

class TumLayout : public Listed {
 protected:
  void SetUp() override {
    Listed::SetUp();
    std::string truth = "# timestamp tx ty tz qx qy qz qw\n";
    for (int i = 0; i < kFrames; ++i) {
      write_images(i, see_plane(plane_, camera(), pose_of_view(i)), 5000.0);
      truth += tum_line(time(i), pose_of_view(i));
    }
    put("groundtruth.txt", truth);
  }
  static double time(int i) { return 100.0 + i / 30.0; }
  static Camera camera() {
    Camera camera = small_camera();
    camera.depth_units_per_metre = 5000.0;
    return camera;
  }
  // A list of pairs, depth first or last.
  static std::string pairs(bool depth_first, const std::string& colour = "rgb/",
                           const std::string& depth = "depth/") {
    std::ostringstream text;
    text.precision(12);
    for (int i = 0; i < kFrames; ++i) {
      const std::string file = std::to_string(i) + ".png";
      if (depth_first) text << time(i) + 0.003 << " " << depth << file << " ";
      text << time(i) << " " << colour << file;
      if (!depth_first) text << " " << time(i) + 0.003 << " " << depth << file;
      text << "\n";
    }
    return text.str();
  }
};

TEST_F(TumLayout, ListsOfImagesAndPosesAreReadAsTumSourceDoes) {
  std::string colour, depth;
  for (int i = 0; i < kFrames; ++i) {
    colour += std::to_string(time(i)) + " rgb/" + std::to_string(i) + ".png\n";
    depth += std::to_string(time(i) + 0.004) + " depth/" + std::to_string(i) + ".png\n";
  }
  put("rgb.txt", colour);
  put("depth.txt", depth);
  put("associations.txt", "not needed\n");
  EXPECT_EQ(dataset_format(folder_), DatasetFormat::kTum);
  const auto source = open_dataset(folder_, camera());
  EXPECT_NE(dynamic_cast<TumSource*>(source.get()), nullptr);
  auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 10u);
  EXPECT_FALSE(frames.back().T_world_camera && frames.back().timestamp > time(kFrames - 1));
  frames.pop_back();  // its time of six decimals may lie behind the last pose
  expect_consistent(plane_, camera(), frames, 0.004, 4.0);
}

TEST_F(TumLayout, PairsInEitherOrderAndOfAnyName) {
  const std::pair<const char*, bool> lists[] = {
      {"associations.txt", true}, {"associated.txt", false}, {"assoc_fr3.txt", false}};
  for (const auto& [name, depth_first] : lists) {
    put(name, "# a comment\n" + pairs(depth_first));
    EXPECT_EQ(dataset_format(folder_), DatasetFormat::kTum);
    const auto source = open_dataset(folder_, camera());
    const auto frames = all_frames(*source);
    ASSERT_EQ(frames.size(), 10u) << name;
    expect_consistent(plane_, camera(), frames, 0.004, 4.0);
    EXPECT_NEAR(frames[2].timestamp, time(2), 1e-9);
    fs::remove(folder_ / name);
  }
}

TEST_F(TumLayout, DepthImagesAreToldByTheirBitsWhereTheirNameDoesNot) {
  fs::rename(folder_ / "depth", folder_ / "d");
  put("associations.txt", pairs(true, "rgb/", "d/"));
  const auto frames = all_frames(*open_dataset(folder_, camera()));
  ASSERT_EQ(frames.size(), 10u);
  expect_consistent(plane_, camera(), frames, 0.004, 4.0);
}

TEST_F(TumLayout, BadListsOfPairs) {
  EXPECT_NE(refused(camera()).find("is no dataset that is known"), std::string::npos);
  put("associations.txt", "");
  EXPECT_NE(refused(camera()).find("associations.txt: names no image"), std::string::npos);
  put("associations.txt", "1 rgb/0.png 1 depth/0.png\n1 rgb/0.png 1\n");
  EXPECT_NE(refused(camera()).find("associations.txt:2: expected 'timestamp file timestamp file'"),
            std::string::npos);
  put("associations.txt", std::string(100'000, 'x'));
  EXPECT_NE(refused(camera()).find("has a line of more than 64 kB"), std::string::npos);
  put("associations.txt", "nan rgb/5.png 1 depth/5.png\n" + pairs(false));
  const auto source = open_dataset(folder_, camera());
  EXPECT_EQ(source->skipped().at("colour image without a time"), 1u);
  EXPECT_EQ(source->size(), 11u);
  put("groundtruth.txt", "this is no trajectory\n");
  const auto without = open_dataset(folder_, camera());
  EXPECT_EQ(all_frames(*without).size(), 10u);
  EXPECT_NE(without->notes().begin()->first.find("the ground truth is not used"), std::string::npos);
}

TEST_F(TumLayout, TheCameraMustBeGivenAndTheErrorSaysWhich) {
  put("associations.txt", pairs(true));
  EXPECT_NE(refused().find("needs --camera with a preset ("), std::string::npos);
  EXPECT_NE(refused().find("tum-fr1 tum-fr2 tum-fr3"), std::string::npos);
  const fs::path named = folder_ / "rgbd_dataset_freiburg2_desk";
  fs::create_directory(named);
  fs::copy(folder_ / "associations.txt", named / "associations.txt");
  try {
    open_dataset(named, {});
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--camera with a preset (tum-fr2) or a file"),
              std::string::npos);
  }
  Camera unscaled = camera();
  unscaled.depth_units_per_metre = 0.0;
  EXPECT_THROW(open_dataset(folder_, unscaled), CalibrationError);
  EXPECT_THROW(open_dataset(folder_ / "absent", camera()), InputError);
}

// The camera of ICL-NUIM as it is published: left-handed, y up.
constexpr double kIclFx = 481.20, kIclFy = -480.00, kIclCx = 319.50, kIclCy = 239.50;
Eigen::Vector3d icl_ray(double x, double y) { return {(x - kIclCx) / kIclFx, (y - kIclCy) / kIclFy, 1.0}; }

TEST_F(Listed, IclNuimIsReadWithAnUprightImageAndAMirroredTruth) {
  std::string pairs, truth;
  for (int i = 0; i < 6; ++i) {
    const std::string n = std::to_string(i);
    write_images(i, see_plane(plane_, {640, 480}, pose_of_view(i), icl_ray), 5000.0);
    pairs += n + " depth/" + n + ".png " + n + " rgb/" + n + ".png\n";
    if (i > 0) truth += tum_line(i, pose_of_view(i));  // as published: the first image has no pose
  }
  put("associations.txt", pairs);
  put("livingRoom1.gt.freiburg", truth);
  EXPECT_EQ(dataset_format(folder_), DatasetFormat::kIclNuim);
  const auto source = open_dataset(folder_, {});
  const Camera camera = source->camera();
  EXPECT_EQ(camera.fy, 480.0);
  auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 6u);
  EXPECT_NEAR(frames[2].timestamp, 2.0 / 30.0, 1e-9);
  EXPECT_FALSE(frames[0].T_world_camera);
  frames.erase(frames.begin());
  for (const Frame& frame : frames)
    EXPECT_NEAR(frame.T_world_camera->rotation().toRotationMatrix().determinant(), 1.0, 1e-9);
  EXPECT_EQ(cv::norm(frames[0].colour, cv::imread((folder_ / "rgb/1.png").string()), cv::NORM_INF), 0.0);

  PaintedPlane mirrored = plane_;  // where the plane is in the right-handed world; compare() needs no more
  mirrored.normal.y() *= -1.0;
  expect_consistent(mirrored, camera, frames, 0.002, 3.0);

  // The alternatives of icl_nuim.cpp. The poses as they are contradict the images as they are...
  std::vector<Frame> unchanged = frames;
  for (int i = 0; i < 5; ++i) unchanged[static_cast<std::size_t>(i)].T_world_camera = pose_of_view(i + 1);
  EXPECT_GT(compare(plane_, camera, unchanged[0], unchanged[3]).metres, 0.03);
  EXPECT_GT(compare(plane_, camera, unchanged[0], unchanged[3]).metres_from_plane, 0.1);
  // ... and fit images turned upside down, in which the room is mirrored.
  Camera turned = camera;
  turned.cy = 479.0 - kIclCy;
  for (Frame& frame : unchanged) {
    cv::Mat colour, depth;
    cv::flip(frame.colour, colour, 0);
    cv::flip(frame.depth, depth, 0);
    frame.colour = colour;
    frame.depth = depth;
  }
  expect_consistent(plane_, turned, unchanged, 0.002, 3.0);
}

class OpenLoris : public Listed {
 protected:
  const SE3 T_base_mount_{so3_exp({0.1, -0.2, 0.3}), {0.2, 0.05, 0.9}};
  const SE3 T_mount_colour_{so3_exp({-1.2, 1.2, -1.2}), {0.01, 0.02, 0.03}};
  const SE3 T_base_imu_{so3_exp({-1.1, 1.3, -1.2}), {0.21, 0.04, 0.92}};

  static double time(int i) { return 1560000000.0 + i / 30.0; }

  void SetUp() override {
    Listed::SetUp();
    Camera camera = small_camera();
    std::ostringstream colour, depth, truth, rates, accelerations;
    for (auto* text : {&colour, &depth, &truth, &rates, &accelerations}) text->precision(17);
    truth << "#Time px py pz qx qy qz qw\n";
    for (int i = 0; i < kFrames; ++i) {
      write_images(i, see_plane(plane_, camera, pose_of_view(i)), 1000.0);
      colour << time(i) << " rgb/" << i << ".png\n";
      depth << time(i) + 0.002 << " depth/" << i << ".png\n";
      const SE3 base = pose_of_view(i) * (T_base_mount_ * T_mount_colour_).inverse();
      const auto& q = base.rotation();
      truth << time(i) << " " << base.translation().transpose() << " " << q.x() << " " << q.y() << " "
            << q.z() << " " << q.w() << "\n";
      rates << time(i) + 0.01 << " " << i << " 0.5 -1\n";
      accelerations << time(i) << " " << 3 * i << " 1 9.8\n";
    }
    put("color.txt", colour.str());
    put("aligned_depth.txt", depth.str());
    put("groundtruth.txt", truth.str());
    put("d400_gyroscope.txt", rates.str());
    put("d400_accelerometer.txt", "# time ax ay az\n" + accelerations.str());
    put("sensors.yaml",
        "%YAML:1.0\n---\nd400_color_optical_frame:\n   sensor_type: camera\n   fps: 30\n   width: 64\n"
        "   height: 48\n   model: pinhole\n   intrinsics: !!opencv-matrix\n      rows: 1\n      cols: 4\n"
        "      dt: d\n      data: [ 61., 30.5,\n          58., 25. ]\n   distortion_model: "
        "radial-tangential\n"
        "   distortion_coefficients: !!opencv-matrix\n      rows: 1\n      cols: 5\n      dt: d\n"
        "      data: [ 0., 0., 0., 0., 0. ]\n");
    put("trans_matrix.yaml", "%YAML:1.0\n---\ntrans_matrix:\n" +
                                 transform("d400_mount", "d400_color_optical_frame", T_mount_colour_) +
                                 transform("base_link", "d400_mount", T_base_mount_) +
                                 transform("base_link", "d400_imu", T_base_imu_));
  }
  static std::string transform(const std::string& parent, const std::string& child, const SE3& T) {
    std::ostringstream text;
    text.precision(12);
    text << "   -\n      parent_frame: " << parent << "\n      child_frame: " << child
         << "\n      matrix: !!opencv-matrix\n         rows: 4\n         cols: 4\n         dt: d\n"
            "         data: [";
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = T.matrix();
    for (int i = 0; i < 16; ++i) text << (i > 0 ? ", " : " ") << matrix.data()[i];
    text << " ]\n";
    return text.str();
  }
};

TEST_F(OpenLoris, TruthIsThatOfTheCameraAndInertialSamplesAreJoined) {
  EXPECT_EQ(dataset_format(folder_), DatasetFormat::kOpenLoris);
  const auto source = open_dataset(folder_, {});
  const Camera camera = source->camera();
  EXPECT_EQ(camera.cx, 30.5);
  EXPECT_EQ(camera.fy, 58.0);
  ASSERT_TRUE(camera.imu);
  const SE3 expected = (T_base_mount_ * T_mount_colour_).inverse() * T_base_imu_;
  EXPECT_LT((camera.imu->T_camera_imu.inverse() * expected).log().norm(), 1e-9);
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 10u);
  expect_consistent(plane_, camera, frames, 0.004, 4.0);
  EXPECT_TRUE(frames[0].inertial.empty());
  ASSERT_EQ(frames[4].inertial.size(), 1u);
  const InertialSample& sample = frames[4].inertial[0];
  EXPECT_NEAR(sample.timestamp, time(3) + 0.01, 1e-6);
  EXPECT_EQ(sample.turn_rate, Eigen::Vector3d(3, 0.5, -1));
  EXPECT_NEAR(sample.acceleration.x(), 9.0 + 3.0 * 0.01 * 30.0, 1e-4);
  EXPECT_EQ(source->notes().at("sample of the gyroscope without one of the accelerometer, left out"), 1u);
}

TEST_F(OpenLoris, WhatIsMissingIsTold) {
  fs::remove(folder_ / "trans_matrix.yaml");
  fs::rename(folder_ / "aligned_depth.txt", folder_ / "depth.txt");
  const auto source = open_dataset(folder_, {});
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 10u);
  EXPECT_FALSE(frames[3].T_world_camera);
  EXPECT_TRUE(frames[3].inertial.empty());
  EXPECT_EQ(source->notes().size(), 3u);
  put("trans_matrix.yaml", "trans_matrix:\n" + transform("a", "d400_color_optical_frame", {}) +
                               transform("d400_color_optical_frame", "a", {}));  // a circle
  EXPECT_EQ(open_dataset(folder_, {})->notes().size(), 3u);
  put("trans_matrix.yaml",
      "trans_matrix:\n- {parent_frame: base_link, child_frame: d400_color_optical_frame, matrix: [1, 2]}\n");
  EXPECT_NE(refused().find("trans_matrix.yaml: has no rigid transform in 'matrix'"), std::string::npos);
  put("sensors.yaml", "d400_color_optical_frame: {width: 64, height: 48}\n");
  EXPECT_NE(refused().find("sensors.yaml: d400_color_optical_frame has no 'intrinsics'"), std::string::npos);
  fs::remove(folder_ / "sensors.yaml");
  EXPECT_NE(refused().find("give --camera FILE"), std::string::npos);
}

}  // namespace
}  // namespace roslam
