// SPDX-License-Identifier: BSD-3-Clause
// Folders of RGB-D datasets: written here from a plane seen along a path, and read again.
#include <opencv2/imgproc.hpp>

#include "roslam/datasets/tum_source.hpp"
#include "tests/dataset_scene.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
constexpr int kFrames = 10;
constexpr double kRounding = 0.004;  // metres, of depth in millimetres and of bilinear samples

std::string numbered(const char* format, int number) {
  char text[64];
  std::snprintf(text, sizeof(text), format, number);
  return text;
}

class SevenScenes : public DatasetFolder {
 protected:
  void write(int frames = kFrames) const {
    for (int i = 0; i < frames; ++i) {
      const PlaneImage image = see_plane(plane_, small_camera(), pose_of_view(i));
      write_colour(folder_ / numbered("frame-%06d.color.png", i), image.colour);
      write_depth(folder_ / numbered("frame-%06d.depth.png", i), image.depth, 1000.0);
      put(numbered("frame-%06d.pose.txt", i), matrix_text(pose_of_view(i).matrix()));
    }
  }
  Camera camera() const {
    Camera camera = small_camera();
    camera.depth_units_per_metre = 1000.0;
    return camera;
  }
};

TEST_F(SevenScenes, DepthTruthAndCameraAgree) {
  write();
  EXPECT_EQ(dataset_format(folder_), DatasetFormat::kSevenScenes);
  const auto source = open_dataset(folder_, camera());
  EXPECT_EQ(source->size(), 10u);
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 10u);
  expect_consistent(plane_, camera(), frames, kRounding, 4.0);
  EXPECT_NEAR(frames[7].timestamp, 7.0 / 30.0, 1e-12);
  EXPECT_TRUE(source->skipped().empty());
  EXPECT_EQ(source->notes().count(
                "the depth of 7-Scenes as published is not registered to colour, and is used as it is"),
            1u);
}

TEST_F(SevenScenes, KnowsItsCamera) {
  write(2);
  const auto source = open_dataset(folder_, {});
  EXPECT_EQ(source->camera(), *camera_preset("7scenes"));
  EXPECT_FALSE(source->next());  // the images of this test are smaller
  EXPECT_EQ(source->skipped().at("colour image is 64x48 but the camera 640x480 pixels"), 2u);
}

TEST_F(SevenScenes, CountsWhatIsMissingOrDamaged) {
  write();
  fs::remove(folder_ / "frame-000001.depth.png");
  fs::remove(folder_ / "frame-000002.pose.txt");
  put("frame-000003.pose.txt", "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n0 0 0 1\n");
  put("frame-000004.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n");  // a mirror is no pose
  put("frame-000005.pose.txt", "1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  put("frame-000006.color.png", "no image");
  write_depth(folder_ / "frame-000007.depth.png", cv::Mat::ones(24, 32, CV_64FC1), 1000.0);
  write_colour(folder_ / "frame-000008.color.png", cv::Mat(24, 32, CV_8UC3));
  fs::remove(folder_ / "frame-000009.color.png");
  cv::Mat raw(48, 64, CV_16UC1, cv::Scalar(1500));
  raw.at<std::uint16_t>(3, 5) = 65535;
  raw.at<std::uint16_t>(3, 6) = 0;
  cv::imwrite((folder_ / "frame-000000.depth.png").string(), raw);
  const auto source = open_dataset(folder_, camera());
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 7u);
  EXPECT_EQ(frames[0].depth.at<float>(3, 5), 0.0F);
  EXPECT_EQ(frames[0].depth.at<float>(3, 6), 0.0F);
  EXPECT_FLOAT_EQ(frames[0].depth.at<float>(3, 7), 1.5F);
  EXPECT_TRUE(frames[1].depth.empty());
  EXPECT_TRUE(frames[0].T_world_camera && frames[1].T_world_camera);
  for (const int i : {2, 3, 4, 5}) EXPECT_FALSE(frames[static_cast<std::size_t>(i)].T_world_camera) << i;
  EXPECT_EQ(source->notes().at("image without a valid pose; no truth there"), 4u);
  EXPECT_EQ(source->skipped().at("colour image cannot be decoded"), 1u);
  EXPECT_EQ(source->skipped().at("colour image is 32x24 but the camera 64x48 pixels"), 1u);
  EXPECT_EQ(source->skipped_depth().at("depth image is 32x24 but the colour image 64x48 pixels"), 1u);
  EXPECT_EQ(source->skipped_depth().at("no depth image near in time"), 1u);
  EXPECT_EQ(source->skipped_depth().at("depth image without a colour image"), 1u);
}

TEST_F(SevenScenes, ASceneIsNoSequence) {
  for (int sequence : {2, 1}) {
    const std::string folder = "seq-0" + std::to_string(sequence);
    fs::create_directories(folder_ / folder);
    write_colour(folder_ / folder / "frame-000000.color.png", cv::Mat(48, 64, CV_8UC3));
  }
  EXPECT_EQ(dataset_format(folder_), std::nullopt);
  EXPECT_NE(refused().find("give one of them, such as " + (folder_ / "seq-01").string()), std::string::npos);
}

TEST_F(SevenScenes, AFolderOfRealImagesIsReadAsTheSameInAnotherLayout) {
  const fs::path kitchen = fs::path(ROSLAM_TEST_DATA) / "slam/kitchen";
  if (!fs::exists(kitchen)) GTEST_SKIP() << kitchen << " is not at hand";
  const auto colour = read_tum_list(kitchen / "rgb.txt");
  const auto depth = read_tum_list(kitchen / "depth.txt");
  const auto truth = read_trajectory(kitchen / "groundtruth.txt").trajectory;
  ASSERT_EQ(colour.size(), truth.size());
  for (int i = 0; i < 40; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const auto file = [&](const char* format) { return folder_ / numbered(format, i); };
    fs::create_symlink(fs::absolute(kitchen / colour[n].file), file("frame-%06d.color.png"));
    fs::create_symlink(fs::absolute(kitchen / depth[n].file), file("frame-%06d.depth.png"));
    put(numbered("frame-%06d.pose.txt", i), matrix_text(truth[n].T_world_camera.matrix()));
  }
  const auto frames = all_frames(*open_dataset(folder_, {}));
  const auto tum = open_dataset(kitchen, camera_preset("7scenes"));
  EXPECT_EQ(tum->size(), 300u);
  ASSERT_EQ(frames.size(), 40u);
  for (const Frame& frame : frames) {
    const auto same = tum->next();
    ASSERT_TRUE(same && same->T_world_camera && frame.T_world_camera);
    EXPECT_EQ(cv::norm(frame.colour, same->colour, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(frame.depth, same->depth, cv::NORM_INF), 0.0);
    EXPECT_NEAR(frame.timestamp + 1.0, same->timestamp, 1e-6);
    EXPECT_LT((frame.T_world_camera->inverse() * *same->T_world_camera).log().norm(), 1e-5);
  }
  // Depth of the first image, moved by the truth, lies on that of the last; by the inverse it does not.
  const Camera camera = *camera_preset("7scenes");
  const auto median_error = [&](const SE3& T_b_a) {
    std::vector<double> errors;
    for (int y = 4; y < 480; y += 8) {
      for (int x = 4; x < 640; x += 8) {
        const double z = frames[0].depth.at<float>(y, x);
        const Eigen::Vector3d p = T_b_a * camera.unproject({x, y}, z);
        const Eigen::Vector2d at = camera.project(p);
        if (z <= 0.0 || p.z() <= 0.0 || !(at.x() > 1 && at.y() > 1 && at.x() < 638 && at.y() < 478)) continue;
        const double seen =
            frames[39].depth.at<float>(static_cast<int>(at.y() + 0.5), static_cast<int>(at.x() + 0.5));
        if (seen > 0.0) errors.push_back(std::abs(seen - p.z()));
      }
    }
    std::sort(errors.begin(), errors.end());
    return errors.at(errors.size() / 2);
  };
  const SE3 motion = frames[39].T_world_camera->inverse() * *frames[0].T_world_camera;
  EXPECT_GT(motion.translation().norm(), 0.03);
  EXPECT_LT(median_error(motion), 0.03);
  EXPECT_LT(median_error(motion), 0.6 * median_error(motion.inverse()));
}

class ScanNet : public DatasetFolder {
 protected:
  // colour: camera of the colour files; T_rig_*: of the two sensors.
  void write(const Camera& colour, const SE3& T_rig_colour, const SE3& T_rig_depth) const {
    for (const char* part : {"color", "depth", "pose"}) fs::create_directories(folder_ / part);
    for (int i = 0; i < kFrames; ++i) {
      const SE3 T_world_rig = pose_of_view(i);
      const std::string number = std::to_string(i);
      write_colour(folder_ / ("color/" + number + ".jpg"),
                   see_plane(plane_, colour, T_world_rig * T_rig_colour).colour);
      write_depth(folder_ / ("depth/" + number + ".png"),
                  see_plane(plane_, small_camera(), T_world_rig * T_rig_depth).depth, 1000.0);
      put("pose/" + number + ".txt", matrix_text(T_world_rig.matrix()));
    }
    put("intrinsic/intrinsic_color.txt", intrinsics(colour));
    put("intrinsic/intrinsic_depth.txt", intrinsics(small_camera()));
    put("intrinsic/extrinsic_color.txt", matrix_text(T_rig_colour.matrix()));
    put("intrinsic/extrinsic_depth.txt", matrix_text(T_rig_depth.matrix()));
  }
  static std::string intrinsics(const Camera& camera) {
    Eigen::Matrix4d K = Eigen::Matrix4d::Identity();
    K.topLeftCorner<3, 3>() << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
    return matrix_text(K);
  }
  // The small camera with twice as many pixels: the centre of pixel 0 is at 0, that of the large one's at
  // -1/4 of it.
  static Camera large() {
    Camera camera = small_camera();
    camera.width *= 2;
    camera.height *= 2;
    camera.fx *= 2;
    camera.fy *= 2;
    camera.cx = 2 * camera.cx + 0.5;
    camera.cy = 2 * camera.cy + 0.5;
    return camera;
  }
};

TEST_F(ScanNet, ColourIsScaledToDepthWhereBothAgree) {
  write(large(), {}, {});
  EXPECT_EQ(dataset_format(folder_), DatasetFormat::kScanNet);
  const auto source = open_dataset(folder_, {});
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 10u);
  EXPECT_NEAR(source->camera().cx, small_camera().cx, 1e-9);
  EXPECT_NEAR(source->camera().fy, small_camera().fy, 1e-9);
  EXPECT_EQ(frames[0].colour.size(), cv::Size(64, 48));
  EXPECT_TRUE(source->notes().empty());
  expect_consistent(plane_, source->camera(), frames, kRounding, 7.0);
  // Colour and depth of one pixel belong to one point.
  const Eigen::Vector3d point =
      *frames[5].T_world_camera * source->camera().unproject({40, 11}, frames[5].depth.at<float>(11, 40));
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(frames[5].colour.at<cv::Vec3b>(11, 40)[c], plane_.colour(point)[c], 4.0);
}

TEST_F(ScanNet, DepthIsBroughtToColourWhereTheyDiffer) {
  Camera colour = large();
  colour.fx *= 1.05;
  colour.cy += 3.0;
  const SE3 T_rig_colour(so3_exp({0.01, 0.02, -0.01}), {0.03, 0.0, 0.01});
  const SE3 T_rig_depth(so3_exp({-0.01, 0.0, 0.02}), {-0.05, 0.01, 0.0});
  write(colour, T_rig_colour, T_rig_depth);
  const auto source = open_dataset(folder_, {});
  const Camera camera = source->camera();
  EXPECT_NEAR(camera.fx, 61.0 * 1.05, 1e-9);
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 10u);
  EXPECT_EQ(source->notes().count("depth was registered to colour by the calibration of both"), 1u);
  for (int i = 0; i < kFrames; ++i) {
    const Frame& frame = frames[static_cast<std::size_t>(i)];
    ASSERT_TRUE(frame.T_world_camera);
    EXPECT_LT((frame.T_world_camera->inverse() * pose_of_view(i) * T_rig_colour).log().norm(), 1e-5);
    const PlaneImage seen = see_plane(plane_, camera, *frame.T_world_camera);
    int known = 0;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const double z = frame.depth.at<float>(y, x);
        for (int c = 0; c < 3; ++c)
          ASSERT_NEAR(frame.colour.at<cv::Vec3b>(y, x)[c], seen.colour.at<cv::Vec3b>(y, x)[c], 7);
        if (z <= 0.0) continue;
        ++known;
        ASSERT_NEAR(z, seen.depth.at<double>(y, x), 0.02);  // half a pixel of the nearest one
      }
    }
    EXPECT_GT(known, 48 * 64 / 2);
  }
}

TEST_F(ScanNet, LostPosesAndBadCalibrationAreTold) {
  write(large(), {}, {});
  put("pose/4.txt", "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n");
  const auto frames = all_frames(*open_dataset(folder_, {}));
  ASSERT_EQ(frames.size(), 10u);
  EXPECT_FALSE(frames[4].T_world_camera);
  EXPECT_TRUE(frames[5].T_world_camera);
  put("intrinsic/intrinsic_depth.txt", "61 0 0\n");
  EXPECT_NE(refused().find("intrinsic_depth.txt: is no 4x4 matrix of intrinsics"), std::string::npos);
  Camera other = small_camera();
  other.width = 100;
  EXPECT_NE(refused(other).find("the colour images are 128x96 but the camera 100x48"), std::string::npos);
  fs::remove_all(folder_ / "color");
  fs::create_directory(folder_ / "color");
  EXPECT_NE(refused().find("color has no image that can be read"), std::string::npos);
}

}  // namespace
}  // namespace roslam
