// SPDX-License-Identifier: BSD-3-Clause
// Folders of stereo pairs: EuRoC and KITTI. Real ones are checked by the epipolar geometry of their images.
#include <opencv2/features2d.hpp>

#include "tests/dataset_scene.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

// Median distance in pixels of matched features from the epipolar lines that a motion gives (Sampson).
double epipolar_error(const cv::Mat& image_a, const Camera& a, const cv::Mat& image_b, const Camera& b,
                      const SE3& T_b_a) {
  const auto orb = cv::ORB::create(1500);
  std::vector<cv::KeyPoint> keys_a, keys_b;
  cv::Mat words_a, words_b;
  orb->detectAndCompute(image_a, {}, keys_a, words_a);
  orb->detectAndCompute(image_b, {}, keys_b, words_b);
  std::vector<cv::DMatch> matches;
  cv::BFMatcher(cv::NORM_HAMMING, true).match(words_a, words_b, matches);
  const Eigen::Matrix3d E = skew(T_b_a.translation()) * T_b_a.rotation().toRotationMatrix();
  std::vector<double> errors;
  for (const auto& match : matches) {
    if (match.distance > 30) continue;
    const auto ray = [](const Camera& camera, const cv::Point2f& at) {
      return camera.unproject(camera.undistort({at.x, at.y}), 1.0);
    };
    const Eigen::Vector3d x = ray(a, keys_a[static_cast<std::size_t>(match.queryIdx)].pt);
    const Eigen::Vector3d y = ray(b, keys_b[static_cast<std::size_t>(match.trainIdx)].pt);
    const Eigen::Vector3d line_b = E * x, line_a = E.transpose() * y;
    errors.push_back(a.fx * std::abs(y.dot(E * x)) /
                     std::sqrt(line_a.head<2>().squaredNorm() + line_b.head<2>().squaredNorm()));
  }
  EXPECT_GT(errors.size(), 50u);
  if (errors.empty()) return 1e9;
  std::sort(errors.begin(), errors.end());
  return errors[errors.size() / 2];
}

// Rows of a table of numbers, read by other means than the library's.
std::vector<std::vector<double>> table(const fs::path& file) {
  std::vector<std::vector<double>> rows;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream words(line);
    rows.emplace_back();
    for (double number; words >> number;) rows.back().push_back(number);
  }
  return rows;
}

Eigen::Matrix4d homogeneous(const std::vector<double>& row, std::size_t first) {  // p, q (w x y z)
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  double w = row[first + 3], x = row[first + 4], y = row[first + 5], z = row[first + 6];
  const double norm = std::sqrt(w * w + x * x + y * y + z * z);
  for (double* part : {&w, &x, &y, &z}) *part /= norm;
  T.topLeftCorner<3, 3>() << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y),
      2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
  T.topRightCorner<3, 1>() << row[first], row[first + 1], row[first + 2];
  return T;
}

TEST(EurocRecording, TruthOfTheCameraAndTheRightImages) {
  const fs::path folder = fs::path(ROSLAM_TEST_DATA) / "slam/euroc_mh01";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not at hand";
  EXPECT_EQ(dataset_format(folder), DatasetFormat::kEuroc);
  const auto source = open_dataset(folder, {}, DatasetUse::kImages);
  const auto& listed = dynamic_cast<FolderSource&>(*source);
  EXPECT_EQ(source->size(), 170u);
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 170u);
  EXPECT_TRUE(source->skipped().empty() && source->skipped_depth().empty() && source->notes().empty());
  EXPECT_EQ(source->camera().distortion[1], 0.07395907);
  ASSERT_TRUE(listed.right());
  EXPECT_NEAR(listed.right()->baseline(), 0.110, 0.0005);
  EXPECT_GT(listed.right()->T_left_right.translation().x(), 0.109);

  Eigen::Matrix4d T_body_camera;  // cam0/sensor.yaml
  T_body_camera << 0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975, 0.999557249008,
      0.0149672133247, 0.025715529948, -0.064676986768, -0.0257744366974, 0.00375618835797, 0.999660727178,
      0.00981073058949, 0, 0, 0, 1;
  std::size_t with_truth = 0;
  for (const auto& row : table(folder / "mav0/state_groundtruth_estimate0/data.csv")) {
    for (const Frame& frame : frames) {
      if (std::abs(frame.timestamp - row[0] * 1e-9) > 1e-6) continue;  // they are taken at the same time
      ++with_truth;
      ASSERT_TRUE(frame.T_world_camera);
      const Eigen::Matrix4d expected = homogeneous(row, 1) * T_body_camera;
      EXPECT_LT((frame.T_world_camera->matrix() - expected).cwiseAbs().maxCoeff(), 2e-6);
    }
  }
  EXPECT_EQ(with_truth, 170u);
  for (const std::size_t i : {40U, 90U, 140U}) {
    EXPECT_TRUE(frames[i].depth.empty());
    EXPECT_EQ(listed.files(i).right.filename(), listed.files(i).colour.filename());
    const cv::Mat right = cv::imread(listed.files(i).right.string());
    const auto& camera = source->camera();
    const SE3 T_left_right = listed.right()->T_left_right;
    EXPECT_LT(epipolar_error(frames[i].colour, camera, right, listed.right()->camera, T_left_right.inverse()),
              1.0);
    const SE3 motion = frames[i + 6].T_world_camera->inverse() * *frames[i].T_world_camera;
    const double error = epipolar_error(frames[i].colour, camera, frames[i + 6].colour, camera, motion);
    const double inverse =
        epipolar_error(frames[i].colour, camera, frames[i + 6].colour, camera, motion.inverse());
    EXPECT_LT(error, 1.5) << i;
    EXPECT_LT(2.0 * error, inverse) << i;
  }
}

TEST(KittiRecording, TruthAndBaseline) {
  const fs::path folder = fs::path(ROSLAM_TEST_DATA) / "slam/kitti06_stereo";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not at hand";
  EXPECT_EQ(dataset_format(folder), DatasetFormat::kKitti);
  const auto source = open_dataset(folder, {}, DatasetUse::kImages);
  const auto& listed = dynamic_cast<FolderSource&>(*source);
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 51u);
  EXPECT_TRUE(source->skipped().empty() && source->skipped_depth().empty() && source->notes().empty());
  EXPECT_EQ(source->camera().width, 1226);
  EXPECT_EQ(source->camera().fx, 707.0912);
  EXPECT_NEAR(source->camera().fps, 1.0 / 0.1037, 1e-6);
  ASSERT_TRUE(listed.right());
  EXPECT_NEAR(listed.right()->baseline(), 379.8145 / 707.0912, 1e-9);
  const auto poses = table(folder / "poses.txt");
  double path = 0.0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    ASSERT_TRUE(frames[i].T_world_camera);
    EXPECT_NEAR(frames[i].timestamp, 0.1037 * static_cast<double>(i), 1e-6);
    const Eigen::Vector3d t = frames[i].T_world_camera->translation();
    EXPECT_LT((t - Eigen::Vector3d(poses[i][3], poses[i][7], poses[i][11])).norm(), 1e-9);
    if (i > 0) path += (t - frames[i - 1].T_world_camera->translation()).norm();
  }
  EXPECT_NEAR(path, 60.0, 5.0);
  const cv::Mat right = cv::imread(listed.files(20).right.string());
  const auto& camera = source->camera();
  EXPECT_LT(epipolar_error(frames[20].colour, camera, right, camera, listed.right()->T_left_right.inverse()),
            1.0);
  const SE3 motion = frames[22].T_world_camera->inverse() * *frames[20].T_world_camera;
  EXPECT_LT(epipolar_error(frames[20].colour, camera, frames[22].colour, camera, motion), 1.0);
}

class Stereo : public DatasetFolder {};

TEST_F(Stereo, EurocWithInertialSamples) {
  const SE3 T_body_left(so3_exp({0.3, -1.2, 0.5}), {0.1, 0.2, -0.3});
  const SE3 T_body_imu(so3_exp({0.1, 0.0, 0.0}), {0.0, 0.05, 0.0});
  const auto sensor = [](const SE3& T) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = T.matrix();
    std::ostringstream text;
    text.precision(12);
    text << "T_BS:\n  cols: 4\n  rows: 4\n  data: [";
    for (int i = 0; i < 16; ++i) text << (i > 0 ? ", " : "") << m.data()[i];
    return text.str() + "]\n";
  };
  const std::string camera =
      "rate_hz: 20\nresolution: [64, 48]\nintrinsics: [61, 58, 30.5, 25]\n"
      "distortion_model: radial-tangential\ndistortion_coefficients: [0.01, 0, 0, 0]\n";
  put("mav0/cam0/sensor.yaml", sensor(T_body_left) + camera);
  put("mav0/cam0/data/a.png", "");
  std::string images = "#timestamp [ns],filename\r\n", truth, inertial = "#timestamp [ns],w,a\n";
  for (int i = 0; i < 8; ++i) {
    const std::string time = std::to_string(1'400'000'000'000'000'000 + i * 50'000'000L);
    const std::string file = time + ".png";
    write_colour(folder_ / "mav0/cam0/data" / file, cv::Mat(48, 64, CV_8UC1, cv::Scalar(i)));
    images += time + "," + file + "\r\n";
    const SE3 body = pose_of_view(i);
    std::ostringstream line;
    line.precision(12);
    line << time << "," << body.translation().x() << "," << body.translation().y() << ","
         << body.translation().z() << "," << body.rotation().w() << "," << body.rotation().x() << ","
         << body.rotation().y() << "," << body.rotation().z() << ",0,0,0,0,0,0,0,0,0\n";
    truth += i == 5 ? time + ",nan,0,0,1,0,0,0\n" : line.str();
    inertial += time + ",0.1,0.2," + std::to_string(i) + ",9.8,0,0\n";
  }
  put("mav0/cam0/data.csv", images);
  put("mav0/state_groundtruth_estimate0/data.csv", truth);
  put("mav0/imu0/data.csv", inertial + "a line\n");
  put("mav0/imu0/sensor.yaml",
      sensor(T_body_imu) + "gyroscope_noise_density: 1e-4\ngyroscope_random_walk: 2e-5\n");
  EXPECT_NE(refused().find("has the images of one camera only"), std::string::npos);
  for (const fs::path& folder : {folder_, folder_ / "mav0"}) {
    const auto source = open_dataset(folder, {}, DatasetUse::kImages);
    const auto frames = all_frames(*source);
    ASSERT_EQ(frames.size(), 8u);
    for (const std::size_t i : {0U, 3U, 7U}) {
      EXPECT_LT((frames[i].T_world_camera->inverse() * pose_of_view(static_cast<int>(i)) * T_body_left)
                    .log()
                    .norm(),
                1e-5);
      EXPECT_EQ(frames[i].colour.at<cv::Vec3b>(4, 4), cv::Vec3b::all(static_cast<uchar>(i)));
    }
    ASSERT_EQ(frames[3].inertial.size(), 1u);
    EXPECT_EQ(frames[3].inertial[0].turn_rate.z(), 3.0);
    ASSERT_TRUE(source->camera().imu);
    EXPECT_LT(
        (source->camera().imu->T_camera_imu.inverse() * T_body_left.inverse() * T_body_imu).log().norm(),
        1e-5);
    EXPECT_EQ(source->camera().imu->gyroscope_walk, 2e-5);
    EXPECT_EQ(source->notes().at("line of the ground truth that is no pose, skipped"), 1u);
    EXPECT_EQ(source->notes().at("line of data.csv that is no sample, skipped"), 1u);
  }
  put("mav0/cam0/sensor.yaml", sensor(T_body_left) +
                                   "resolution: [64, 48]\nintrinsics: [61, 58, 30.5, 25]\n"
                                   "distortion_model: omnidirectional\ndistortion_coefficients: [0.1]\n");
  EXPECT_NE(
      refused({}, DatasetUse::kImages).find("has the distortion model 'omnidirectional'; supported: "),
      std::string::npos);
  const std::string fisheye = sensor(T_body_left) +
                              "resolution: [64, 48]\nintrinsics: [61, 58, 30.5, 25]\n"
                              "distortion_model: equidistant\ndistortion_coefficients: ";
  put("mav0/cam0/sensor.yaml", fisheye + "[0.01, 0.002, 0, 0]\n");
  EXPECT_EQ(open_dataset(folder_, {}, DatasetUse::kImages)->camera().model, LensModel::kFisheye);
  put("mav0/cam0/sensor.yaml", fisheye + "[0.01, 0.002]\n");
  EXPECT_NE(refused({}, DatasetUse::kImages).find("distortion has 2 values"), std::string::npos);
  put("mav0/cam0/sensor.yaml", "resolution: [64, 48, 1]\nintrinsics: [61, 58, 30.5, 25]\n");
  EXPECT_NE(refused({}, DatasetUse::kImages).find("has 3 numbers in 'resolution', not 2"),
            std::string::npos);
  put("mav0/cam0/data.csv", "1,a.png\nsoon,b.png\n");
  put("mav0/cam0/sensor.yaml", sensor(T_body_left) + camera);
  EXPECT_NE(refused({}, DatasetUse::kImages).find("data.csv:2: expected 'timestamp,file'"),
            std::string::npos);
}

TEST_F(Stereo, KittiColourCameraLiesBesideTheFirst) {
  const fs::path sequence = folder_ / "sequences/07";
  for (const char* camera : {"image_2", "image_3"}) {
    fs::create_directories(sequence / camera);
    for (const char* file : {"000000.png", "000001.png", "000002.png"})
      write_colour(sequence / camera / file, cv::Mat(48, 64, CV_8UC3, cv::Scalar(1, 2, 3)));
  }
  // Camera 2 is 0.06 m to the left of camera 0 and 0.01 m above it; camera 3 0.48 m to the right.
  put("sequences/07/calib.txt",
      "P0: 60 0 30 0 0 60 25 0 0 0 1 0\nP2: 60 0 30 3.6 0 60 25 0.6 0 0 1 0\n"
      "P3: 60 0 30 -28.8 0 60 25 0 0 0 1 0\n");
  put("sequences/07/times.txt", "0\n0.1\n");
  put("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n0 0 1 5 0 1 0 6 -1 0 0 7\n");
  const auto source = open_dataset(sequence / "", {}, DatasetUse::kImages);
  const auto frames = all_frames(*source);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(source->size(), 3u);
  EXPECT_EQ(source->skipped().at("colour image without a time"), 1u);
  EXPECT_LT((frames[0].T_world_camera->translation() - Eigen::Vector3d(-0.06, -0.01, 0)).norm(), 1e-9);
  EXPECT_LT((frames[1].T_world_camera->translation() - Eigen::Vector3d(5, 5.99, 7.06)).norm(), 1e-9);
  const auto& right = dynamic_cast<FolderSource&>(*source).right();
  ASSERT_TRUE(right);
  EXPECT_LT((right->T_left_right.translation() - Eigen::Vector3d(0.54, 0.01, 0)).norm(), 1e-9);
  put("sequences/07/calib.txt", "P0: 60 0 30 0\n");
  EXPECT_THROW(open_dataset(sequence, {}, DatasetUse::kImages), InputError);
  EXPECT_THROW(open_dataset(sequence, {}), InputError);
}

}  // namespace
}  // namespace roslam
